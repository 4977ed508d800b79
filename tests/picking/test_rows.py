import json

import numpy as np
import pandas as pd

from vidtrack.picking.rows import point_of, rows_of


def test_what_is_missing_in_a_table_is_null_in_json():
    table = pd.DataFrame({"tag": ["1", "2"], "Xf": [3.5, np.nan], "other": [1, 2]})
    rows = rows_of(table, ("tag", "Xf", "sd"))
    assert json.loads(json.dumps(rows, allow_nan=False)) == [{"tag": "1", "Xf": 3.5}, {"tag": "2", "Xf": None}]


def test_a_point_without_residual_is_distinguished_from_one_that_fits():
    row = {"clip": "front", "tag": 7, "Xf": 1.0, "Yf": 2.0, "found": True, "reason": np.nan}
    assert point_of(row)["residual_x"] is None
    assert point_of({**row, "residual_x": 0.25, "used": False, "reason": "far off"})["residual_x"] == 0.25
    assert point_of({**row, "used": False, "found": True})["used"] is False
    assert point_of(row)["reason"] == ""
