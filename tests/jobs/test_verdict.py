"""The verdict's job reads what lies under results/ and writes verdict.json."""

import pandas as pd

from vidtrack.files.records import read_json, write_json
from vidtrack.files.tables import write_parquet
from vidtrack.jobs import verdict
from vidtrack.workflow.job import Job


def test_a_warning_of_one_camera_and_a_target_that_was_lost_are_in_the_verdict(tmp_path):
    run = tmp_path / "results" / "runs" / "pluck"
    (run / "centroids").mkdir(parents=True)
    write_json(run / "centroids/cam1.json", {"problems": ["2 pictures are missing (before frame 50)"]}, {})
    write_json(run / "locate.json", {"mode": "plane"}, {})
    table = pd.DataFrame({"time_s": [0.0, 0.1], "target": "t1", "x": [1.0, None], "y": [1.0, None], "z": None})
    write_parquet(run / "trajectories.parquet", table, units="m", provenance={})
    paths = [str(run / name) for name in ("centroids/cam1.json", "locate.json", "trajectories.parquet")]
    asked = {"pluck": {"mode": "plane", "cameras": ["cam1"], "targets": 1}}
    out = str(tmp_path / "results/verdict.json")
    verdict.run(Job({"runs": asked}, {"results": paths}, {"verdict": out}, {"vidtrack": "1"}))
    record = read_json(out)
    assert [reason["text"].split(" (")[0] for reason in record["runs"]["pluck"]["reasons"]] == [
        "cam1: 2 pictures are missing",
        "target t1: 1 of 2 samples were located; the longest gap lasts 0.1 s, from 0.10 s",
    ]
    assert record["provenance"] == {"vidtrack": "1"}
