# Needs: all that the other rules make.
# Makes: report.html, the verdict with a line a run and a line a camera; under report/ a page of the calibration and one
# of each run, with its summary. A page needs nothing beside it, and is written again only when what it shows changes.
# Where they are asked for: runs/<run>/overlay_<camera>.mp4, each recording with what was found drawn over it.


from vidtrack.analysis.repeats import repeats

FILMS = {
    (run, camera): f"{RESULTS}/runs/{run}/overlay_{camera}" for run, camera in TRACKS
}
# Films that were asked for on the command line once are kept up to date, and have a poster on the page.
FILMED = [
    key
    for key, stem in FILMS.items()
    if SETTINGS.report.overlay or os.path.exists(f"{stem}.mp4")
]
OFFERED = [("overlay_film", *key) for key in FILMS if key not in FILMED]
for run, camera in FILMS:
    BOOK.add(
        "overlay_film",
        report_orders.overlay_film(SETTINGS, EXPERIMENT, run, camera),
        [files_of(EXPERIMENT.runs[run], camera)],
        run,
        camera,
    )

SHOWN = [path for path in CENTROIDS if path.endswith(".parquet")]
SHOWN += [f"{RESULTS}/runs/{run}/kinematics.parquet" for run in LOCATED]
SHOWN += [f"{RESULTS}/runs/{run}/bodies.parquet" for run in BODIED]
SHOWN += [f"{RESULTS}/runs/{run}/motions.parquet" for run in ANALYSED if run in BODIED]
SHOWN += [f"{RESULTS}/runs/{run}/background/{camera}.png" for run, camera in TRACKS]
SHOWN += [path for path in COMPARISONS if path.endswith(".parquet")]
SHOWN += [
    f"{RESULTS}/runs/{run}/waterline.{kind}"
    for run in WATERLINES
    for kind in ("parquet", "npz")
]
OF_CALIBRATION = [p for p in JUDGED if not p.startswith(f"{RESULTS}/runs/")]
PICTURED = [
    f"{RESULTS}/calibration/{name}"
    for camera in CALIBRATED
    for name in (
        f"{camera}/search.parquet",
        f"{camera}/picture.png",
        f"overlay_{camera}.png",
    )
]
if CALIBRATED:
    PICTURED.append(f"{RESULTS}/calibration/backprojection.parquet")
JUDGED_OF = by_run(JUDGED)
PAGED = [run for run in EXPERIMENT.runs if run in JUDGED_OF]
REPORT = f"{RESULTS}/report.html"
CALIBRATION_PAGE = f"{RESULTS}/report/calibration.html"


SHOWN += [f"{FILMS[key]}.jpg" for key in FILMED]


# What the page of each run is made of.
ALSO_SHOWN = by_run(SHOWN)
SHOWN_OF = {
    run: [*JUDGED_OF[run], *ALSO_SHOWN.get(run, []), *OF_CALIBRATION] for run in PAGED
}
# Of repeats of a run the analysis, for the type A part of its uncertainty.
ROWS = report_orders.campaign_rows(SETTINGS, EXPERIMENT)
REPEATS = [[run for run in group if run in ANALYSED] for group in repeats(ROWS)]
for group in REPEATS:
    for run in group:
        others = [f"{RESULTS}/runs/{o}/analysis.json" for o in group if o != run]
        SHOWN_OF[run] = SHOWN_OF.get(run, []) + others
CAMPAIGN_PAGE = f"{RESULTS}/report/campaign.html"
CAMPAIGN = bool(EXPERIMENT.campaign) or any(len(group) > 1 for group in REPEATS)
PAGES = [f"{RESULTS}/report/run_{run}.html" for run in PAGED]
PAGES += [CALIBRATION_PAGE] if CALIBRATED or WAVED else []
REPORTED = [VERDICT, *OF_CALIBRATION]
REPORTED += [f"{RESULTS}/report/run_{run}.json" for run in PAGED]
REPORTED += [CALIBRATION_PAGE] if CALIBRATED or WAVED else []
if CAMPAIGN:
    PAGES.append(CAMPAIGN_PAGE)
    REPORTED.append(CAMPAIGN_PAGE)
    BOOK.add(
        "campaign", report_orders.campaign(SETTINGS, EXPERIMENT), [EXPERIMENT.campaign]
    )
BOOK.add(
    "report", report_orders.report(SETTINGS, EXPERIMENT) | {"results": listed(REPORTED)}
)
for run in PAGED:
    BOOK.add(
        "report_run",
        report_orders.report_run(SETTINGS, EXPERIMENT, run, LEFT_OUT)
        | {"results": listed(SHOWN_OF[run])},
        [],
        run,
    )
if CALIBRATED or WAVED:
    BOOK.add(
        "report_calibration",
        report_orders.report_calibration(SETTINGS)
        | {"results": listed([*OF_CALIBRATION, *PICTURED])},
    )

# All pages in one file, to be handed on: where the config asks for it, or the command line.
ONE_FILE = f"{RESULTS}/report_one_file.html"
BOOK.add("report_one_file", {"pages": listed([REPORT, *PAGES])})
if not SETTINGS.report.one_file and not os.path.exists(ONE_FILE):
    OFFERED.append(("report_one_file",))


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
        mem_mb=400,
        runtime=10,
    params:
        **order("report"),
    message:
        "Writing the report"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack report --account {output.account:q} --log {log:q}"
        " --input results {input.results:q} --output report {output.report:q}"


rule report_run:
    input:
        results=results(lambda w: SHOWN_OF[w.run]),
    output:
        page=report(f"{RESULTS}/report/run_{{run}}.html", category="Runs"),
        summary=f"{RESULTS}/report/run_{{run}}.json",
        account=account("report_run", "{run}"),
    log:
        f"{LOGS}/report_run/{{run}}.log",
    benchmark:
        f"{BENCHMARKS}/report_run/{{run}}.tsv"
    resources:
        mem_mb=lambda w, input: 800 + 4 * input.size_mb,
        runtime=lambda w, input: 10 + input.size_mb // 2,
    params:
        **order("report_run", "run"),
    message:
        "Writing the page of {wildcards.run}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack report_run --account {output.account:q} --log {log:q}"
        " --input results {input.results:q} --output page {output.page:q} --output summary {output.summary:q}"


rule overlay_film:
    input:
        video=lambda w: ancient(EXPERIMENT.runs[w.run].videos[w.camera]),
        centroids=results(f"{RESULTS}/runs/{{run}}/centroids/{{camera}}.parquet"),
        reading=results(f"{RESULTS}/runs/{{run}}/centroids/{{camera}}.json"),
        trajectories=results(f"{RESULTS}/runs/{{run}}/trajectories.parquet"),
        record=results(f"{RESULTS}/runs/{{run}}/locate.json"),
        camera=results(lambda w: of_located(w, locating)),
        labelling=results(lambda w: of_located(w, "labelling.json")),
    output:
        film=f"{RESULTS}/runs/{{run}}/overlay_{{camera}}.mp4",
        poster=f"{RESULTS}/runs/{{run}}/overlay_{{camera}}.jpg",
        account=account("overlay_film", "{run}", "{camera}"),
    log:
        f"{LOGS}/overlay_film/{{run}}/{{camera}}.log",
    benchmark:
        f"{BENCHMARKS}/overlay_film/{{run}}/{{camera}}.tsv"
    resources:
        mem_mb=800,
        runtime=lambda w, input: 10 + input.size_mb // 10,
    params:
        **order("overlay_film", "run", "camera"),
    message:
        "Drawing what was found over the recording of {wildcards.run} by {wildcards.camera}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack overlay_film --account {output.account:q} --log {log:q}"
        " --input video {input.video:q} --input centroids {input.centroids:q} --input reading {input.reading:q}"
        " --input trajectories {input.trajectories:q} --input record {input.record:q}"
        " --input camera {input.camera:q} --input labelling {input.labelling:q}"
        " --output film {output.film:q} --output poster {output.poster:q}"


rule report_one_file:
    input:
        report=results(REPORT),
        pages=results(lambda w: PAGES),
    output:
        whole=ONE_FILE,
        account=account("report_one_file"),
    log:
        f"{LOGS}/report_one_file.log",
    benchmark:
        f"{BENCHMARKS}/report_one_file.tsv"
    resources:
        mem_mb=lambda w, input: 400 + 8 * input.size_mb,
        runtime=10,
    params:
        **order("report_one_file"),
    message:
        "Writing all pages of the report as one file"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack report_one_file --account {output.account:q} --log {log:q}"
        " --input report {input.report:q} --input pages {input.pages:q} --output whole {output.whole:q}"


rule campaign:
    input:
        records=results(
            lambda w: [f"{RESULTS}/runs/{r}/analysis.json" for r in ANALYSED]
        ),
    output:
        record=f"{RESULTS}/campaign.json",
        page=report(CAMPAIGN_PAGE, category="Experiment"),
        account=account("campaign"),
    log:
        f"{LOGS}/campaign.log",
    benchmark:
        f"{BENCHMARKS}/campaign.tsv"
    resources:
        mem_mb=800,
        runtime=10,
    params:
        **order("campaign"),
    message:
        "Writing the page of the campaign"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack campaign --account {output.account:q} --log {log:q}"
        " --input records {input.records:q} --output record {output.record:q} --output page {output.page:q}"


rule report_calibration:
    input:
        results=results(lambda w: [*OF_CALIBRATION, *PICTURED]),
    output:
        page=report(CALIBRATION_PAGE, category="Calibration"),
        account=account("report_calibration"),
    log:
        f"{LOGS}/report_calibration.log",
    benchmark:
        f"{BENCHMARKS}/report_calibration.tsv"
    priority: 1
    resources:
        mem_mb=800,
        runtime=10,
    params:
        **order("report_calibration"),
    message:
        "Writing the page of the calibration"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack report_calibration --account {output.account:q}"
        " --log {log:q} --input results {input.results:q} --output page {output.page:q}"
