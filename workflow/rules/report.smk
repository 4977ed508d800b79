# Needs: all that the other rules make.
# Makes: report.html, the whole experiment on one page that needs nothing beside it.

REPORTED = [VERDICT, *JUDGED]
REPORTED += [
    f"{RESULTS}/calibration/{name}"
    for camera in CALIBRATED
    for name in (f"{camera}/search.parquet", f"overlay_{camera}.png")
]
REPORTED += [path for path in CENTROIDS if path.endswith(".parquet")]
REPORTED += [f"{RESULTS}/runs/{run}/kinematics.parquet" for run in LOCATED]
REPORTED += [f"{RESULTS}/runs/{run}/bodies.parquet" for run in BODIED]
REPORTED += [path for path in COMPARISONS if path.endswith(".parquet")]
REPORTED += [
    f"{RESULTS}/runs/{run}/waterline.{kind}"
    for run in WATERLINES
    for kind in ("parquet", "npz")
]


rule report:
    input:
        order=placed("report", orders.report(SETTINGS, EXPERIMENT), []),
        results=REPORTED,
    output:
        report=f"{RESULTS}/report.html",
    log:
        f"{RESULTS}/logs/report.log",
    message:
        "Writing the report"
    shell:
        "python -m vidtrack report --settings {input.order:q} --log {log:q} --input results {input.results:q}"
        " --output report {output.report:q}"
