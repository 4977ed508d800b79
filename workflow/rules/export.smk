# Needs: the results of a run, and the config's `export`.
# Makes: runs/<run>/export/: the files of other programs, and <format>.json that says what their reader should know.
import re

EXPORTS = []
WANTED = {run: report_orders.exported(SETTINGS, run) for run in LOCATED}
EXPORTED = {}  # format, files, results that it reads: the runs
if any(
    report_orders.exported(SETTINGS, run) for run in EXPERIMENT.runs
):  # it loads the writers
    from vidtrack.exchange.formats import FORMATS, places
    from vidtrack.exchange.results import layout_of, result_paths, unsuited

    if problems := unsuited(SETTINGS, EXPERIMENT.runs.values()):
        sys.exit("\n".join(f"vidtrack: {problem}" for problem in problems))
    for run, names in WANTED.items():
        own = layout_of(SETTINGS, EXPERIMENT.runs[run])
        for name in names:
            if FORMATS[name].suits(own):
                BOOK.add(
                    "export", report_orders.export(SETTINGS, run, name), [], run, name
                )
                files = tuple(places(name, own._replace(name="{run}")))
                read = result_paths(RESULTS, FORMATS[name], own._replace(name="{run}"))
                if "cameras" in read:
                    seen = [os.path.dirname(path) for path in read["cameras"]]
                    read["cameras"] = [
                        f"{p}/{locating(os.path.basename(p))}" for p in seen
                    ]
                read = tuple((key, tuple(paths)) for key, paths in read.items())
                EXPORTED.setdefault((name, files, read), []).append(run)


# A shell command is put together once more when its job runs: by then the loop is over.
PATHS = {}


def of_run(paths):
    return results(lambda w: [path.format(run=w.run) for path in paths])


for (name, files, read), runs in EXPORTED.items():
    made = [f"{RESULTS}/runs/{{run}}/export/{file}" for file in files]
    record = f"{RESULTS}/runs/{{run}}/export/{name}.json"
    EXPORTS += [path.format(run=run) for run in runs for path in (*made, record)]

    title = f"export_{name}_{len(PATHS)}"
    PATHS[title] = "".join(f" --input {key} {{input.{key}:q}}" for key, _ in read)
    PATHS[title] += "".join(
        f" --output file_{i} {{output.file_{i}:q}}" for i in range(len(made))
    )

    rule:
        name:
            title
        input:
            **{key: of_run(paths) for key, paths in read},
        output:
            **{f"file_{i}": path for i, path in enumerate(made)},
            record=record,
            account=account("export", "{run}", name),
        log:
            f"{LOGS}/export/{{run}}/{name}.log",
        benchmark:
            f"{BENCHMARKS}/export/{{run}}/{name}.tsv"
        wildcard_constraints:
            run="|".join(map(re.escape, runs)),
        resources:
            mem_mb=600,
            runtime=10,
        params:
            **order("export", "run", parts=(name,)),
        message:
            f"Writing {{wildcards.run}} as {name}"
        shell:
            "printf '%s\\n' {params:q} | python -m vidtrack export --account {output.account:q} --log {log:q}"
            f" --output record {{output.record:q}}{PATHS[locals().get('rule', title)]}"
