# Needs: the centroid tables of a run and, in mode space, the calibration of its cameras; where clocks are sought, what
# its recordings' sound and light tell of them.
# Makes: runs/<run>/clocks.json, trajectories, kinematics and, where the config names bodies, bodies; the water's edge on
# transects.

# What follows targets; a run of mode waterline has none.
LOCATED = list(dict.fromkeys(run for run, _ in TRACKS))
MODES = {
    name: SETTINGS.runs[name].mode if name in SETTINGS.runs else "space"
    for name in EXPERIMENT.runs
}
BODIED = [name for name, run in SETTINGS.runs.items() if run.bodies and name in LOCATED]
LOCATE_ORDERS = {
    run: placed(
        "locate",
        orders.locate(SETTINGS, EXPERIMENT, run),
        (
            [EXPERIMENT.points]
            if MODES[run] == "plane" and SETTINGS.runs[run].plane.points
            else []
        ),
        run,
    )
    for run in LOCATED
}
CLOCKED = {
    run: order
    for run in LOCATED
    if (order := orders.clocks(SETTINGS, EXPERIMENT, run))["sought"]
}
WATERLINES = {
    name: run.waterline.camera or next(iter(EXPERIMENT.runs[name].videos))
    for name, run in SETTINGS.runs.items()
    if run.waterline
}
LOCATIONS = [
    f"{RESULTS}/runs/{run}/{name}"
    for run in LOCATED
    for name in ("trajectories.parquet", "trajectories.csv", "kinematics.parquet")
]
LOCATIONS += [f"{RESULTS}/runs/{run}/bodies.parquet" for run in BODIED]
LOCATIONS += [f"{RESULTS}/runs/{run}/waterline.parquet" for run in WATERLINES]


def calibrations(run, name):
    """A file of each camera's calibration, where the run is located in space."""
    return (
        [f"{RESULTS}/calibration/{c}/{name}" for c in EXPERIMENT.runs[run].videos]
        if MODES[run] == "space"
        else []
    )


def plane_sightings(run):
    """The known points in the plane, as the run's camera saw them."""
    plane = SETTINGS.runs[run].plane if MODES[run] == "plane" else None
    camera = next(iter(EXPERIMENT.runs[run].videos))
    return (
        f"{RESULTS}/calibration/{camera}/sightings.parquet"
        if plane and plane.points
        else []
    )


if CLOCKED:
    CLOCK_ORDERS = {
        run: placed(
            "clocks",
            order,
            list(EXPERIMENT.runs[run].videos.values()),
            run,
        )
        for run, order in CLOCKED.items()
    }

    rule clocks:
        input:
            order=lambda w: CLOCK_ORDERS[w.run],
            videos=lambda w: ancient(list(EXPERIMENT.runs[w.run].videos.values())),
            light=lambda w: [
                f"{RESULTS}/runs/{w.run}/light/{c}.parquet"
                for c in EXPERIMENT.runs[w.run].videos
            ],
            readings=lambda w: [
                f"{RESULTS}/runs/{w.run}/centroids/{c}.json"
                for c in EXPERIMENT.runs[w.run].videos
            ],
        output:
            record=f"{RESULTS}/runs/{{run}}/clocks.json",
        log:
            f"{RESULTS}/logs/clocks/{{run}}.log",
        message:
            "What sound and light tell of the clocks in {wildcards.run}"
        shell:
            "python -m vidtrack clocks --settings {input.order:q} --log {log:q}"
            " --input videos {input.videos:q} --input light {input.light:q} --input readings {input.readings:q}"
            " --output record {output.record:q}"


rule locate:
    input:
        order=lambda w: LOCATE_ORDERS[w.run],
        centroids=lambda w: [
            f"{RESULTS}/runs/{w.run}/centroids/{c}.parquet"
            for c in EXPERIMENT.runs[w.run].videos
        ],
        readings=lambda w: [
            f"{RESULTS}/runs/{w.run}/centroids/{c}.json"
            for c in EXPERIMENT.runs[w.run].videos
        ],
        cameras=lambda w: calibrations(w.run, "camera.json"),
        points=lambda w: calibrations(w.run, "points.parquet"),
        sightings=lambda w: plane_sightings(w.run),
        clocks=lambda w: (
            f"{RESULTS}/runs/{w.run}/clocks.json" if w.run in CLOCKED else []
        ),
    output:
        trajectories=f"{RESULTS}/runs/{{run}}/trajectories.parquet",
        csv=f"{RESULTS}/runs/{{run}}/trajectories.csv",
        record=f"{RESULTS}/runs/{{run}}/locate.json",
    log:
        f"{RESULTS}/logs/locate/{{run}}.log",
    message:
        "Locating the targets of {wildcards.run}"
    shell:
        "python -m vidtrack locate --settings {input.order:q} --log {log:q}"
        " --input centroids {input.centroids:q} --input readings {input.readings:q}"
        " --input cameras {input.cameras:q} --input points {input.points:q} --input sightings {input.sightings:q}"
        " --input clocks {input.clocks:q}"
        " --output trajectories {output.trajectories:q} --output csv {output.csv:q} --output record {output.record:q}"


rule kinematics:
    input:
        order=placed("kinematics", orders.kinematics(SETTINGS), []),
        trajectories=f"{RESULTS}/runs/{{run}}/trajectories.parquet",
    output:
        kinematics=f"{RESULTS}/runs/{{run}}/kinematics.parquet",
        record=f"{RESULTS}/runs/{{run}}/kinematics.json",
    log:
        f"{RESULTS}/logs/kinematics/{{run}}.log",
    message:
        "Velocities and accelerations of {wildcards.run}"
    shell:
        "python -m vidtrack kinematics --settings {input.order:q} --log {log:q}"
        " --input trajectories {input.trajectories:q} --output kinematics {output.kinematics:q}"
        " --output record {output.record:q}"


if BODIED:
    BODY_ORDERS = {
        run: placed("bodies", orders.bodies(SETTINGS, run), [], run) for run in BODIED
    }

    rule bodies:
        input:
            order=lambda w: BODY_ORDERS[w.run],
            trajectories=f"{RESULTS}/runs/{{run}}/trajectories.parquet",
        output:
            bodies=f"{RESULTS}/runs/{{run}}/bodies.parquet",
        log:
            f"{RESULTS}/logs/bodies/{{run}}.log",
        message:
            "Six degrees of freedom of the bodies in {wildcards.run}"
        shell:
            "python -m vidtrack bodies --settings {input.order:q} --log {log:q}"
            " --input trajectories {input.trajectories:q} --output bodies {output.bodies:q}"


if WATERLINES:
    PROFILES = {
        run: list(profiles(SETTINGS, EXPERIMENT.runs[run]).values())
        for run in WATERLINES
    }
    WATERLINE_ORDERS = {
        run: placed(
            "waterline",
            orders.waterline(SETTINGS, run, camera),
            [EXPERIMENT.runs[run].videos[camera], *PROFILES[run]],
            run,
        )
        for run, camera in WATERLINES.items()
    }

    rule waterline:
        input:
            order=lambda w: WATERLINE_ORDERS[w.run],
            video=lambda w: ancient(EXPERIMENT.runs[w.run].videos[WATERLINES[w.run]]),
            profiles=lambda w: ancient(PROFILES[w.run]),
            camera=lambda w: f"{RESULTS}/calibration/{WATERLINES[w.run]}/camera.json",
        output:
            waterline=f"{RESULTS}/runs/{{run}}/waterline.parquet",
            timestack=f"{RESULTS}/runs/{{run}}/waterline.npz",
            record=f"{RESULTS}/runs/{{run}}/waterline.json",
        log:
            f"{RESULTS}/logs/waterline/{{run}}.log",
        message:
            "Following the water's edge in {wildcards.run}"
        shell:
            "python -m vidtrack waterline --settings {input.order:q} --log {log:q}"
            " --input video {input.video:q} --input profiles {input.profiles:q} --input camera {input.camera:q}"
            " --output waterline {output.waterline:q} --output timestack {output.timestack:q}"
            " --output record {output.record:q}"
