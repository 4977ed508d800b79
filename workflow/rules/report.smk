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
REPORT = f"{RESULTS}/report.html"
BOOK.add("report", orders.report(SETTINGS, EXPERIMENT) | {"results": listed(REPORTED)})


rule report:
    input:
        results=results(lambda w: REPORTED),
    output:
        report=report(REPORT, category="Experiment"),
        account=account("report"),
    log:
        f"{LOGS}/report.log",
    benchmark:
        f"{BENCHMARKS}/report.tsv"
    resources:
        mem_mb=lambda w, input: 800 + 4 * input.size_mb,
        runtime=lambda w, input: 10 + input.size_mb // 2,
    params:
        **order("report"),
    message:
        "Writing the report"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack report --account {output.account:q} --log {log:q}"
        " --input results {input.results:q} --output report {output.report:q}"
