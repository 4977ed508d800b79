"""The overlay's job draws the points of its own camera alone."""

import numpy as np
import pandas as pd

from vidtrack.files.records import read_png, write_png
from vidtrack.files.tables import write_parquet
from vidtrack.jobs import overlay
from vidtrack.workflow.job import Job


def test_points_of_another_camera_are_not_drawn(tmp_path):
    write_png(tmp_path / "picture.png", np.full((80, 100), 30, np.uint8))
    points = pd.DataFrame({"tag": ["1"], "Xf": [20.0], "Yf": [20.0], "used": [True], "reason": [""]})
    write_parquet(tmp_path / "points.parquet", points, units="m", provenance={})
    kinds = ("", "_projected", "_from_located")
    own = {f"{axis}f{kind}": [20.0] for axis in "XY" for kind in kinds}
    far = {f"{axis}f{kind}": [70.0] for axis in "XY" for kind in kinds}
    inputs = {name: str(tmp_path / name) for name in ("picture.png", "points.parquet")}
    inputs = {"picture": inputs["picture.png"], "points": inputs["points.parquet"]}

    def drawn(name, table):
        write_parquet(tmp_path / "table.parquet", table, units="m", provenance={})
        out = str(tmp_path / f"{name}.png")
        given = {**inputs, "table": str(tmp_path / "table.parquet")}
        overlay.run(Job({"camera": "cam1"}, given, {"overlay": out}))
        return read_png(out)

    alone = pd.DataFrame({"tag": ["1"], "camera": ["cam1"], **own})
    both = pd.concat([alone, pd.DataFrame({"tag": ["1"], "camera": ["cam2"], **far})], ignore_index=True)
    assert np.array_equal(drawn("alone", alone), drawn("both", both))
    assert not np.array_equal(drawn("alone", alone), drawn("other", both.assign(camera="cam1")))
