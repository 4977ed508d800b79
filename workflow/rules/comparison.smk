# Needs: runs/<run>/trajectories and the run's reference.csv (a contact sensor) or truth.csv (a better instrument).
# Makes: runs/<run>/comparison.json, and .parquet with the two records side by side.

COMPARED = [
    name
    for name in LOCATED
    if EXPERIMENT.runs[name].reference or EXPERIMENT.runs[name].truth
]
COMPARISONS = [
    f"{RESULTS}/runs/{run}/comparison.{kind}"
    for run in COMPARED
    for kind in ("json", "parquet")
]
for run in COMPARED:
    BOOK.add(
        "compare",
        orders.compare(SETTINGS, EXPERIMENT, run),
        [EXPERIMENT.runs[run].reference, EXPERIMENT.runs[run].truth],
        run,
    )


rule compare:
    input:
        trajectories=results(f"{RESULTS}/runs/{{run}}/trajectories.parquet"),
        field=results(
            lambda w: (
                f"{RESULTS}/calibration/{'backprojection' if CALIBRATED else 'wand'}.json"
                if MODES[w.run] == "space"
                else []
            )
        ),
        reference=lambda w: ancient(EXPERIMENT.runs[w.run].reference or []),
        truth=lambda w: ancient(EXPERIMENT.runs[w.run].truth or []),
    output:
        comparison=f"{RESULTS}/runs/{{run}}/comparison.json",
        series=f"{RESULTS}/runs/{{run}}/comparison.parquet",
        account=account("compare", "{run}"),
    log:
        f"{LOGS}/compare/{{run}}.log",
    benchmark:
        f"{BENCHMARKS}/compare/{{run}}.tsv"
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("compare", "run"),
    message:
        "Comparing {wildcards.run} with its contact sensor"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack compare --account {output.account:q} --log {log:q}"
        " --input trajectories {input.trajectories:q} --input field {input.field:q}"
        " --input reference {input.reference:q} --input truth {input.truth:q}"
        " --output comparison {output.comparison:q} --output series {output.series:q}"
