# Needs: files of other programs in place of recordings and clips: runs/<run>/<camera>.csv and the like, tracks;
# calibration/<clip>/<camera>.csv, digitised points; calibration/<camera>.toml and the like, calibrated cameras.
# Makes: what the rules track, calibration_points and calibrate make of recordings. Where there is no such file, there is
# no rule.
from itertools import groupby

# Wildcards cannot say which camera of which run: a rule for all runs whose tracks are of the same cameras.
IMPORTED = sorted(
    (tuple(sorted(run.tracks)), name)
    for name, run in EXPERIMENT.runs.items()
    if run.tracks and (name, min(run.tracks)) in TRACKS
)
for tracked, name in IMPORTED:
    for camera in tracked:
        BOOK.add(
            "import_tracks",
            import_orders.import_tracks(SETTINGS, EXPERIMENT, name, camera),
            [EXPERIMENT.runs[name].videos[camera]],
            name,
            camera,
        )


for number, (tracked, named) in enumerate(groupby(IMPORTED, lambda each: each[0])):

    rule:
        name:
            f"import_tracks_{number}" if number else "import_tracks"
        input:
            tracks=lambda w: ancient(EXPERIMENT.runs[w.run].videos[w.camera]),
        output:
            centroids=f"{RESULTS}/runs/{{run}}/centroids/{{camera}}.parquet",
            record=f"{RESULTS}/runs/{{run}}/centroids/{{camera}}.json",
            tracklets=f"{RESULTS}/runs/{{run}}/tracklets/{{camera}}.parquet",
            light=f"{RESULTS}/runs/{{run}}/light/{{camera}}.parquet",
            background=f"{RESULTS}/runs/{{run}}/background/{{camera}}.parquet",
            picture=f"{RESULTS}/runs/{{run}}/background/{{camera}}.png",
            account=account("import_tracks", "{run}", "{camera}"),
        log:
            f"{LOGS}/import_tracks/{{run}}/{{camera}}.log",
        benchmark:
            f"{BENCHMARKS}/import_tracks/{{run}}/{{camera}}.tsv"
        wildcard_constraints:
            run=one_of(name for _, name in named),
            camera=one_of(tracked),
        resources:
            mem_mb=lambda w, input: 400 + 20 * input.size_mb,
            runtime=10,
        params:
            **order("import_tracks", "run", "camera"),
        message:
            "Reading the tracks of {wildcards.run} in {wildcards.camera}"
        shell:
            "printf '%s\\n' {params:q} | python -m vidtrack import_tracks --account {output.account:q} --log {log:q}"
            " --input tracks {input.tracks:q}"
            " --output centroids {output.centroids:q} --output tracklets {output.tracklets:q}"
            " --output record {output.record:q} --output light {output.light:q}"
            " --output background {output.background:q} --output picture {output.picture:q}"

    workflow.ruleorder(
        f"import_tracks_{number}" if number else "import_tracks", "track"
    )


GIVEN = [camera for camera in EXPERIMENT.given if camera not in CALIBRATED]
for camera in GIVEN:
    BOOK.add(
        "import_camera",
        import_orders.import_camera(SETTINGS, camera),
        import_orders.files_of_camera(SETTINGS, EXPERIMENT, camera),
        camera,
    )
CALIBRATION += [f"{RESULTS}/calibration/{camera}/camera.json" for camera in GIVEN]


if GIVEN:

    rule import_camera:
        input:
            file=lambda w: ancient(EXPERIMENT.given[w.camera]),
        output:
            camera=f"{RESULTS}/calibration/{{camera}}/camera.json",
            points=f"{RESULTS}/calibration/{{camera}}/points.parquet",
            labelling=f"{RESULTS}/calibration/{{camera}}/labelling.json",
            account=account("import_camera", "{camera}"),
        log:
            f"{LOGS}/import_camera/{{camera}}.log",
        benchmark:
            f"{BENCHMARKS}/import_camera/{{camera}}.tsv"
        wildcard_constraints:
            camera=one_of(GIVEN),
        resources:
            mem_mb=400,
            runtime=10,
        params:
            **order("import_camera", "camera"),
        message:
            "Reading the calibration of {wildcards.camera}"
        shell:
            "printf '%s\\n' {params:q} | python -m vidtrack import_camera --account {output.account:q} --log {log:q}"
            " --input file {input.file:q} --output camera {output.camera:q} --output points {output.points:q}"
            " --output labelling {output.labelling:q}"

    ruleorder: import_camera > calibrate
    ruleorder: import_camera > calibration_points


if DIGITISED:

    rule import_points:
        input:
            points=ancient(EXPERIMENT.points or []),
            files=lambda w: ancient(
                [clip.videos[w.camera] for clip in clips_seen(w.set, w.camera)]
            ),
        output:
            sightings=f"{RESULTS}/{{set}}/{{camera}}/sightings.parquet",
            picture=f"{RESULTS}/{{set}}/{{camera}}/picture.png",
            background=f"{RESULTS}/{{set}}/{{camera}}/background.png",
            record=f"{RESULTS}/{{set}}/{{camera}}/labelling.json",
            account=account("import_points", "{set}", "{camera}"),
        log:
            f"{LOGS}/import_points/{{set}}/{{camera}}.log",
        benchmark:
            f"{BENCHMARKS}/import_points/{{set}}/{{camera}}.tsv"
        wildcard_constraints:
            camera=one_of(DIGITISED),
        resources:
            mem_mb=400,
            runtime=10,
        params:
            **order("import_points", "set", "camera"),
        message:
            "Reading the calibration points that {wildcards.camera} sees"
        shell:
            "printf '%s\\n' {params:q} | python -m vidtrack import_points --account {output.account:q} --log {log:q}"
            " --input points {input.points:q} --input files {input.files:q}"
            " --output sightings {output.sightings:q} --output picture {output.picture:q}"
            " --output background {output.background:q} --output record {output.record:q}"

    ruleorder: import_points > calibration_points
