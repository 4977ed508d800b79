# Needs: runs/<run>/trajectories and the run's reference.csv (a contact sensor) or truth.csv (a better instrument).
# Makes: runs/<run>/comparison.json, and .parquet with the two records side by side.

COMPARED = [
    name
    for name in LOCATED
    if EXPERIMENT.runs[name].reference or EXPERIMENT.runs[name].truth
]
COMPARE_ORDERS = {
    run: placed(
        "compare",
        orders.compare(SETTINGS, EXPERIMENT, run),
        [EXPERIMENT.runs[run].reference, EXPERIMENT.runs[run].truth],
        run,
    )
    for run in COMPARED
}
COMPARISONS = [
    f"{RESULTS}/runs/{run}/comparison.{kind}"
    for run in COMPARED
    for kind in ("json", "parquet")
]


rule compare:
    input:
        order=lambda w: COMPARE_ORDERS[w.run],
        trajectories=f"{RESULTS}/runs/{{run}}/trajectories.parquet",
        field=lambda w: (
            f"{RESULTS}/calibration/backprojection.json"
            if MODES[w.run] == "space"
            else []
        ),
        reference=lambda w: ancient(EXPERIMENT.runs[w.run].reference or []),
        truth=lambda w: ancient(EXPERIMENT.runs[w.run].truth or []),
    output:
        comparison=f"{RESULTS}/runs/{{run}}/comparison.json",
        series=f"{RESULTS}/runs/{{run}}/comparison.parquet",
    log:
        f"{RESULTS}/logs/compare/{{run}}.log",
    message:
        "Holding {wildcards.run} against its contact sensor"
    shell:
        "python -m vidtrack compare --settings {input.order:q} --log {log:q}"
        " --input trajectories {input.trajectories:q} --input field {input.field:q}"
        " --input reference {input.reference:q} --input truth {input.truth:q}"
        " --output comparison {output.comparison:q} --output series {output.series:q}"
