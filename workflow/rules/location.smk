# Needs: the centroid tables of a run and, in mode space, the calibration of its cameras; where clocks are estimated,
# the sound and light of its recordings.
# Makes: runs/<run>/clocks.json, trajectories, kinematics and, where the config names bodies, bodies; motions, decay and
# waves where it asks for an analysis; the water's edge on transects.

# What follows targets; a run of mode waterline has none.
LOCATED = list(dict.fromkeys(run for run, _ in TRACKS))
MODES = {
    name: SETTINGS.runs[name].mode if name in SETTINGS.runs else "space"
    for name in EXPERIMENT.runs
}
STEADY = [run for run in LOCATED if steady(run)]
TAGGED = [name for name, run in SETTINGS.runs.items() if run.tags and name in LOCATED]
BODIED = [
    name
    for name, run in SETTINGS.runs.items()
    if (run.bodies or run.tags) and name in LOCATED
]
ANALYSED = [
    name
    for name, run in SETTINGS.runs.items()
    if (run.analysis or run.axes or (SETTINGS.axes and run.bodies)) and name in LOCATED
]


CLOCKED = [run for run in LOCATED if orders.clocks(SETTINGS, EXPERIMENT, run)["sought"]]
WATERLINES = {
    name: run.waterline.camera or next(iter(EXPERIMENT.runs[name].videos))
    for name, run in SETTINGS.runs.items()
    if run.waterline and name in EXPERIMENT.runs
}
PROFILES = {
    run: list(profiles(SETTINGS, EXPERIMENT.runs[run]).values()) for run in WATERLINES
}
LOCATIONS = [
    f"{RESULTS}/runs/{run}/{name}"
    for run in LOCATED
    for name in ("trajectories.parquet", "trajectories.csv", "kinematics.parquet")
]
LOCATIONS += [f"{RESULTS}/runs/{run}/bodies.parquet" for run in BODIED]
LOCATIONS += [f"{RESULTS}/runs/{run}/waterline.parquet" for run in WATERLINES]
LOCATIONS += [
    f"{RESULTS}/runs/{run}/{name}"
    for run in ANALYSED
    for name in ("analysis.json", "motions.parquet")
]


for run in LOCATED:
    known = MODES[run] == "plane" and SETTINGS.runs[run].plane.points
    BOOK.add(
        "locate",
        orders.locate(SETTINGS, EXPERIMENT, run),
        [EXPERIMENT.points] if known else [],
        run,
    )
    if run in STEADY:
        BOOK.add("steadiness", orders.steadiness(SETTINGS, EXPERIMENT, run), [], run)
    BOOK.add("kinematics", orders.kinematics(SETTINGS), [], run)
for run in CLOCKED:
    BOOK.add(
        "clocks", orders.clocks(SETTINGS, EXPERIMENT, run), whole_recordings(run), run
    )
for run in TAGGED:
    BOOK.add(
        "tag_poses",
        tag_orders.tag_poses(orders.locate(SETTINGS, EXPERIMENT, run)),
        [],
        run,
    )
for run in BODIED:
    BOOK.add("bodies", orders.bodies(SETTINGS, run), [], run)
for run in ANALYSED:
    channels = channels_path(SETTINGS, EXPERIMENT.runs[run])
    BOOK.add("analysis", orders.analysis(SETTINGS, EXPERIMENT, run), [channels], run)
for run, camera in WATERLINES.items():
    BOOK.add(
        "waterline",
        orders.waterline(SETTINGS, EXPERIMENT, run, camera),
        [files_of(EXPERIMENT.runs[run], camera), *PROFILES[run]],
        run,
    )


rule clocks:
    input:
        videos=lambda w: ancient(recordings(w.run)),
        light=of_cameras("light/{camera}.parquet", filmed),
        readings=of_cameras("centroids/{camera}.json", filmed),
    output:
        record=f"{RESULTS}/runs/{{run}}/clocks.json",
        account=account("clocks", "{run}"),
    log:
        f"{LOGS}/clocks/{{run}}.log",
    benchmark:
        f"{BENCHMARKS}/clocks/{{run}}.tsv"
    resources:
        mem_mb=600,
        runtime=lambda w, input: 10 + input.size_mb // 20,
    params:
        **order("clocks", "run"),
    message:
        "Estimating the clocks of {wildcards.run} from sound and light"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack clocks --account {output.account:q} --log {log:q}"
        " --input videos {input.videos:q} --input light {input.light:q} --input readings {input.readings:q}"
        " --output record {output.record:q}"


rule locate:
    input:
        centroids=of_cameras("centroids/{camera}.parquet"),
        tracklets=of_cameras("tracklets/{camera}.parquet"),
        windows=of_cameras("windows/{camera}.parquet", filmed),
        readings=of_cameras("centroids/{camera}.json"),
        cameras=results(lambda w: calibrations(w.run, locating)),
        points=results(lambda w: calibrations(w.run, "points.parquet")),
        sightings=results(lambda w: of_plane(w.run, "sightings.parquet")),
        labelling=results(
            lambda w: calibrations(w.run, "labelling.json")
            or of_plane(w.run, "labelling.json")
        ),
        steadiness=results(lambda w: followed(w.run)),
        clocks=results(lambda w: own_clocks(w.run)),
    output:
        trajectories=f"{RESULTS}/runs/{{run}}/trajectories.parquet",
        csv=f"{RESULTS}/runs/{{run}}/trajectories.csv",
        associations=f"{RESULTS}/runs/{{run}}/associations.parquet",
        record=f"{RESULTS}/runs/{{run}}/locate.json",
        account=account("locate", "{run}"),
    log:
        f"{LOGS}/locate/{{run}}.log",
    benchmark:
        f"{BENCHMARKS}/locate/{{run}}.tsv"
    resources:
        mem_mb=400,
        runtime=lambda w, input: 10 + input.size_mb,
    params:
        **order("locate", "run"),
    message:
        "Locating the targets of {wildcards.run}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack locate --account {output.account:q} --log {log:q}"
        " --input centroids {input.centroids:q} --input tracklets {input.tracklets:q}"
        " --input windows {input.windows:q} --input readings {input.readings:q}"
        " --input cameras {input.cameras:q} --input points {input.points:q} --input sightings {input.sightings:q}"
        " --input labelling {input.labelling:q} --input clocks {input.clocks:q}"
        " --input steadiness {input.steadiness:q}"
        " --output trajectories {output.trajectories:q} --output csv {output.csv:q}"
        " --output associations {output.associations:q} --output record {output.record:q}"


rule steadiness:
    input:
        backgrounds=of_cameras("background/{camera}.parquet", steady),
        pictures=of_cameras("background/{camera}.png", steady),
        readings=of_cameras("centroids/{camera}.json", steady),
        cameras=results(lambda w: calibrations(w.run, "camera.json", steady)),
        points=results(lambda w: calibrations(w.run, "points.parquet", steady)),
        sightings=results(
            lambda w: calibrations(w.run, "sightings.parquet", steady)
            or of_plane(w.run, "sightings.parquet")
        ),
        labelling=results(
            lambda w: calibrations(w.run, "labelling.json", steady)
            or of_plane(w.run, "labelling.json")
        ),
        calibrated=results(
            lambda w: calibrations(w.run, "background.png", steady)
            or of_plane(w.run, "background.png")
        ),
    output:
        table=f"{RESULTS}/runs/{{run}}/steadiness.parquet",
        record=f"{RESULTS}/runs/{{run}}/steadiness.json",
        account=account("steadiness", "{run}"),
    log:
        f"{LOGS}/steadiness/{{run}}.log",
    benchmark:
        f"{BENCHMARKS}/steadiness/{{run}}.tsv"
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("steadiness", "run"),
    message:
        "Comparing the backgrounds of {wildcards.run} with those of the calibration"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack steadiness --account {output.account:q} --log {log:q}"
        " --input backgrounds {input.backgrounds:q} --input pictures {input.pictures:q}"
        " --input readings {input.readings:q} --input cameras {input.cameras:q} --input points {input.points:q}"
        " --input sightings {input.sightings:q} --input labelling {input.labelling:q}"
        " --input calibrated {input.calibrated:q}"
        " --output table {output.table:q} --output record {output.record:q}"


rule kinematics:
    input:
        trajectories=results(f"{RESULTS}/runs/{{run}}/trajectories.parquet"),
    output:
        kinematics=f"{RESULTS}/runs/{{run}}/kinematics.parquet",
        record=f"{RESULTS}/runs/{{run}}/kinematics.json",
        account=account("kinematics", "{run}"),
    log:
        f"{LOGS}/kinematics/{{run}}.log",
    benchmark:
        f"{BENCHMARKS}/kinematics/{{run}}.tsv"
    resources:
        mem_mb=400,
        runtime=lambda w, input: 10 + input.size_mb,
    params:
        **order("kinematics", "run"),
    message:
        "Velocities and accelerations of {wildcards.run}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack kinematics --account {output.account:q} --log {log:q}"
        " --input trajectories {input.trajectories:q} --output kinematics {output.kinematics:q}"
        " --output record {output.record:q}"


rule tag_poses:
    input:
        centroids=of_cameras("centroids/{camera}.parquet"),
        readings=of_cameras("centroids/{camera}.json"),
        cameras=results(lambda w: calibrations(w.run, "camera.json")),
        points=results(lambda w: calibrations(w.run, "points.parquet")),
        labelling=results(lambda w: calibrations(w.run, "labelling.json")),
        located=results(f"{RESULTS}/runs/{{run}}/locate.json"),
        trajectories=results(f"{RESULTS}/runs/{{run}}/trajectories.parquet"),
    output:
        poses=f"{RESULTS}/runs/{{run}}/tag_poses.parquet",
        record=f"{RESULTS}/runs/{{run}}/tag_poses.json",
        account=account("tag_poses", "{run}"),
    log:
        f"{LOGS}/tag_poses/{{run}}.log",
    benchmark:
        f"{BENCHMARKS}/tag_poses/{{run}}.tsv"
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("tag_poses", "run"),
    message:
        "Poses of the coded tags in {wildcards.run}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack tag_poses --account {output.account:q} --log {log:q}"
        " --input centroids {input.centroids:q} --input readings {input.readings:q}"
        " --input cameras {input.cameras:q} --input points {input.points:q} --input labelling {input.labelling:q}"
        " --input located {input.located:q} --input trajectories {input.trajectories:q}"
        " --output poses {output.poses:q} --output record {output.record:q}"


rule bodies:
    input:
        trajectories=results(f"{RESULTS}/runs/{{run}}/trajectories.parquet"),
        poses=results(
            lambda w: (
                f"{RESULTS}/runs/{w.run}/tag_poses.parquet" if w.run in TAGGED else []
            )
        ),
        posed=results(
            lambda w: (
                f"{RESULTS}/runs/{w.run}/tag_poses.json" if w.run in TAGGED else []
            )
        ),
    output:
        bodies=f"{RESULTS}/runs/{{run}}/bodies.parquet",
        record=f"{RESULTS}/runs/{{run}}/bodies.json",
        account=account("bodies", "{run}"),
    log:
        f"{LOGS}/bodies/{{run}}.log",
    benchmark:
        f"{BENCHMARKS}/bodies/{{run}}.tsv"
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("bodies", "run"),
    message:
        "Six degrees of freedom of the bodies in {wildcards.run}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack bodies --account {output.account:q} --log {log:q}"
        " --input trajectories {input.trajectories:q} --input poses {input.poses:q} --input posed {input.posed:q}"
        " --output bodies {output.bodies:q}"
        " --output record {output.record:q}"


rule analysis:
    input:
        trajectories=results(f"{RESULTS}/runs/{{run}}/trajectories.parquet"),
        bodies=results(
            lambda w: (
                f"{RESULTS}/runs/{w.run}/bodies.parquet" if w.run in BODIED else []
            )
        ),
        channels=lambda w: ancient(
            channels_path(SETTINGS, EXPERIMENT.runs[w.run]) or []
        ),
        light=results(lambda w: of_lamp(w.run, "light/{camera}.parquet")),
        located=results(f"{RESULTS}/runs/{{run}}/locate.json"),
    output:
        record=f"{RESULTS}/runs/{{run}}/analysis.json",
        motions=f"{RESULTS}/runs/{{run}}/motions.parquet",
        account=account("analysis", "{run}"),
    log:
        f"{LOGS}/analysis/{{run}}.log",
    benchmark:
        f"{BENCHMARKS}/analysis/{{run}}.tsv"
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("analysis", "run"),
    message:
        "Motions, decay and waves of {wildcards.run}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack analysis --account {output.account:q} --log {log:q}"
        " --input trajectories {input.trajectories:q} --input bodies {input.bodies:q}"
        " --input channels {input.channels:q} --input light {input.light:q} --input located {input.located:q}"
        " --output record {output.record:q} --output motions {output.motions:q}"


rule waterline:
    input:
        video=lambda w: ancient(EXPERIMENT.runs[w.run].videos[WATERLINES[w.run]]),
        profiles=lambda w: ancient(PROFILES[w.run]),
        camera=results(
            lambda w: (
                f"{RESULTS}/calibration/{WATERLINES[w.run]}/{locating(WATERLINES[w.run])}"
            )
        ),
        labelling=results(
            lambda w: f"{RESULTS}/calibration/{WATERLINES[w.run]}/labelling.json"
        ),
    output:
        waterline=f"{RESULTS}/runs/{{run}}/waterline.parquet",
        timestack=f"{RESULTS}/runs/{{run}}/waterline.npz",
        record=f"{RESULTS}/runs/{{run}}/waterline.json",
        account=account("waterline", "{run}"),
    log:
        f"{LOGS}/waterline/{{run}}.log",
    benchmark:
        f"{BENCHMARKS}/waterline/{{run}}.tsv"
    threads: max(1, (workflow.cores or 1) // max(1, len(WATERLINES) + len(TRACKS)))
    resources:
        mem_mb=800,
        runtime=lambda w, input: 10 + input.size_mb // 20,
    params:
        **order("waterline", "run"),
    message:
        "Following the water's edge in {wildcards.run}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack waterline --account {output.account:q}"
        " --threads {threads} --log {log:q}"
        " --input video {input.video:q} --input profiles {input.profiles:q} --input camera {input.camera:q}"
        " --input labelling {input.labelling:q}"
        " --output waterline {output.waterline:q} --output timestack {output.timestack:q}"
        " --output record {output.record:q}"
