# Needs: sensitivity/<scenario>.yaml, a rig on paper and what to vary in it.
# Makes: sensitivity/<scenario>/, tables and figures of the accuracy that it would have.

PREDICTED_TABLES = [
    f"{name}.{kind}"
    for name in ("table", "cameras", "volume")
    for kind in ("parquet", "csv")
]
PREDICTIONS = [
    f"{RESULTS}/sensitivity/{name}/{file}"
    for name in EXPERIMENT.scenarios
    for file in [*PREDICTED_TABLES, "record.json", "sweeps.png", "volume.png"]
]
for name, path in EXPERIMENT.scenarios.items():
    BOOK.add("sensitivity", {}, [path], name)


rule sensitivity:
    input:
        scenario=lambda w: ancient(EXPERIMENT.scenarios[w.scenario]),
    output:
        table=f"{RESULTS}/sensitivity/{{scenario}}/table.parquet",
        table_csv=f"{RESULTS}/sensitivity/{{scenario}}/table.csv",
        cameras=f"{RESULTS}/sensitivity/{{scenario}}/cameras.parquet",
        cameras_csv=f"{RESULTS}/sensitivity/{{scenario}}/cameras.csv",
        volume=f"{RESULTS}/sensitivity/{{scenario}}/volume.parquet",
        volume_csv=f"{RESULTS}/sensitivity/{{scenario}}/volume.csv",
        record=f"{RESULTS}/sensitivity/{{scenario}}/record.json",
        sweeps=report(
            f"{RESULTS}/sensitivity/{{scenario}}/sweeps.png",
            category="Predicted accuracy",
        ),
        volume_map=report(
            f"{RESULTS}/sensitivity/{{scenario}}/volume.png",
            category="Predicted accuracy",
        ),
        account=account("sensitivity", "{scenario}"),
    log:
        f"{LOGS}/sensitivity/{{scenario}}.log",
    benchmark:
        f"{BENCHMARKS}/sensitivity/{{scenario}}.tsv"
    resources:
        mem_mb=800,
        runtime=120,
    params:
        **order("sensitivity", "scenario"),
    message:
        "Predicting the accuracy of {wildcards.scenario}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack sensitivity --account {output.account:q} --log {log:q}"
        " --input scenario {input.scenario:q}"
        " --output table {output.table:q} --output table_csv {output.table_csv:q}"
        " --output cameras {output.cameras:q} --output cameras_csv {output.cameras_csv:q}"
        " --output volume {output.volume:q} --output volume_csv {output.volume_csv:q}"
        " --output record {output.record:q} --output sweeps {output.sweeps:q} --output volume_map {output.volume_map:q}"
