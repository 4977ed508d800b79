# Needs: <experiment>.yaml, a scenario, where the experiment that the config names is not there yet: the demo.
# Makes: the experiment's folder, as a laboratory would have. Then Snakemake is called once more, to process it.


rule render:
    input:
        scenario=lambda w: SCENARIO,
    log:
        ".snakemake/vidtrack/render.log",
    threads: workflow.cores or 1
    resources:
        mem_mb=1000,
        runtime=60,
    params:
        folder=EXPERIMENT.folder,
    message:
        "Rendering {params.folder} from {input.scenario}"
    shell:
        "python -m vidtrack.simulate {input.scenario:q} {params.folder:q} --threads {threads} 2> {log:q}"
        " || {{ cat {log:q} >&2; exit 1; }}"
