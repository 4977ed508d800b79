# Needs: all that the other rules make.
# Makes: report.html, the whole experiment on one page that needs nothing beside it.

REPORTED = {
    "cameras": [f"{RESULTS}/calibration/{camera}/camera.json" for camera in CALIBRATED],
    "points": [
        f"{RESULTS}/calibration/{camera}/points.parquet" for camera in CALIBRATED
    ],
    "searches": [
        f"{RESULTS}/calibration/{camera}/search.parquet" for camera in CALIBRATED
    ],
    "labellings": [
        f"{RESULTS}/calibration/{camera}/labelling.json" for camera in CALIBRATED
    ],
    "overlays": [
        f"{RESULTS}/calibration/overlay_{camera}.png" for camera in CALIBRATED
    ],
    "backprojection": [
        f"{RESULTS}/calibration/backprojection.{kind}"
        for kind in ("parquet", "json")
        if CALIBRATED
    ],
    "stability": (
        [f"{RESULTS}/calibration_after/stability.json"]
        if SETS["calibration_after"]
        else []
    ),
    "centroids": [path for path in CENTROIDS if path.endswith(".parquet")],
    "readings": [path for path in CENTROIDS if path.endswith(".json")],
    "trajectories": [f"{RESULTS}/runs/{run}/trajectories.parquet" for run in LOCATED],
    "kinematics": [f"{RESULTS}/runs/{run}/kinematics.parquet" for run in LOCATED],
    "locations": [f"{RESULTS}/runs/{run}/locate.json" for run in LOCATED],
    "bodies": [f"{RESULTS}/runs/{run}/bodies.parquet" for run in BODIED],
    "waterlines": [
        f"{RESULTS}/runs/{run}/waterline.{kind}"
        for run in WATERLINES
        for kind in ("parquet", "npz")
    ],
    "comparisons": COMPARISONS,
}


rule report:
    input:
        **REPORTED,
        order=placed("report", orders.report(SETTINGS, EXPERIMENT), []),
    output:
        report=f"{RESULTS}/report.html",
    log:
        f"{RESULTS}/logs/report.log",
    params:
        inputs=" ".join(
            f"--input {name} " + " ".join(f"'{p}'" for p in paths)
            for name, paths in REPORTED.items()
        ),
    message:
        "Writing the report"
    shell:
        "python -m vidtrack report --settings {input.order:q} --log {log:q} {params.inputs}"
        " --output report {output.report:q}"
