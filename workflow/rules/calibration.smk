# Needs: calibration/points.csv, calibration/<clip>/<camera>.<ext>, and picks.csv where someone named a few points.
# Makes: calibration/<camera>/sightings, points and camera.json; backprojection tables; overlays.
# Clips filmed after the test (calibration.after) go the same way, under calibration_after, and end in stability.json.

CAMERAS = EXPERIMENT.cameras_in_clips()
BUNDLED = SETTINGS.calibration.refine == "bundle"
SETS = {"calibration": [], "calibration_after": []}
CALIBRATION_ORDERS = {}
for clip_set, after in (("calibration", False), ("calibration_after", True)):
    for camera in CAMERAS:
        clips = [
            EXPERIMENT.clips[c]
            for c in orders.clips_of(SETTINGS, EXPERIMENT, camera, after)
        ]
        if clips:
            SETS[clip_set].append(camera)
            CALIBRATION_ORDERS["sight", clip_set, camera] = placed(
                "calibration_points",
                orders.calibration_points(SETTINGS, EXPERIMENT, camera, after),
                [
                    EXPERIMENT.points,
                    *(p for clip in clips for p in (clip.videos[camera], clip.picks)),
                ],
                clip_set,
                camera,
            )
for camera in CAMERAS:
    CALIBRATION_ORDERS["calibrate", camera] = placed(
        "calibrate", orders.calibrate(SETTINGS, camera), [], camera
    )
CALIBRATED = SETS["calibration"]
OVERLAY_ORDERS = {
    camera: placed("overlay", {"camera": camera}, [], camera) for camera in CALIBRATED
}


def clips_seen_by(w):
    after = w.set == "calibration_after"
    return [
        EXPERIMENT.clips[c]
        for c in orders.clips_of(SETTINGS, EXPERIMENT, w.camera, after)
    ]


CALIBRATION = [
    f"{RESULTS}/calibration/{camera}/{name}"
    for camera in CALIBRATED
    for name in ("points.parquet", "camera.json")
]
if CALIBRATED:
    CALIBRATION += [
        f"{RESULTS}/calibration/overlay_{camera}.png" for camera in CALIBRATED
    ]
    CALIBRATION += [
        f"{RESULTS}/calibration/backprojection.{kind}" for kind in ("parquet", "json")
    ]
if SETS["calibration_after"]:
    CALIBRATION.append(f"{RESULTS}/calibration_after/stability.json")


wildcard_constraints:
    set="calibration|calibration_after",


rule calibration_points:
    input:
        order=lambda w: CALIBRATION_ORDERS["sight", w.set, w.camera],
        points=ancient(EXPERIMENT.points or []),
        videos=lambda w: ancient([clip.videos[w.camera] for clip in clips_seen_by(w)]),
        picks=lambda w: ancient([clip.picks for clip in clips_seen_by(w) if clip.picks]),
        # Clips filmed after the test need no picks of their own: the balls are where they were before it.
        before=lambda w: (
            f"{RESULTS}/calibration/{w.camera}/sightings.parquet"
            if w.set == "calibration_after" and w.camera in CALIBRATED
            else []
        ),
    output:
        sightings=f"{RESULTS}/{{set}}/{{camera}}/sightings.parquet",
        picture=f"{RESULTS}/{{set}}/{{camera}}/picture.png",
        record=f"{RESULTS}/{{set}}/{{camera}}/labelling.json",
    log:
        f"{RESULTS}/logs/calibration_points/{{set}}.{{camera}}.log",
    message:
        "Finding and naming the calibration points that {wildcards.camera} sees"
    shell:
        "python -m vidtrack calibration_points --settings {input.order:q} --log {log:q}"
        " --input points {input.points:q} --input videos {input.videos:q} --input picks {input.picks:q}"
        " --input before {input.before:q}"
        " --output sightings {output.sightings:q} --output picture {output.picture:q} --output record {output.record:q}"


rule calibrate:
    input:
        order=lambda w: CALIBRATION_ORDERS["calibrate", w.camera],
        sightings=f"{RESULTS}/{{set}}/{{camera}}/sightings.parquet",
        picture=f"{RESULTS}/{{set}}/{{camera}}/picture.png",
    output:
        points=f"{RESULTS}/{{set}}/{{camera}}/points.parquet",
        camera=f"{RESULTS}/{{set}}/{{camera}}/{'alone' if BUNDLED else 'camera'}.json",
        search=f"{RESULTS}/{{set}}/{{camera}}/search.parquet",
    log:
        f"{RESULTS}/logs/calibrate/{{set}}.{{camera}}.log",
    message:
        "Calibrating {wildcards.camera}"
    shell:
        "python -m vidtrack calibrate --settings {input.order:q} --log {log:q}"
        " --input sightings {input.sightings:q} --input picture {input.picture:q}"
        " --output points {output.points:q} --output camera {output.camera:q} --output search {output.search:q}"


if BUNDLED:

    for clip_set, members in SETS.items():
        if members:

            rule:
                name:
                    "bundle" if clip_set == "calibration" else "bundle_after"
                input:
                    order=placed(
                        "bundle", orders.bundle(SETTINGS, members), [], clip_set
                    ),
                    alone=[
                        f"{RESULTS}/{clip_set}/{camera}/alone.json"
                        for camera in members
                    ],
                    points=[
                        f"{RESULTS}/{clip_set}/{camera}/points.parquet"
                        for camera in members
                    ],
                output:
                    **{
                        camera: f"{RESULTS}/{clip_set}/{camera}/camera.json"
                        for camera in members
                    },
                log:
                    f"{RESULTS}/logs/bundle/{clip_set}.log",
                params:
                    outputs=" ".join(
                        f"--output {c} '{RESULTS}/{clip_set}/{c}/camera.json'"
                        for c in members
                    ),
                message:
                    "Refining all cameras and the surveyed points together"
                shell:
                    "python -m vidtrack bundle --settings {input.order:q} --log {log:q}"
                    " --input alone {input.alone:q} --input points {input.points:q} {params.outputs}"


if CALIBRATED:

    rule back_project:
        input:
            order=placed("back_project", orders.back_project(SETTINGS, CALIBRATED), []),
            cameras=[
                f"{RESULTS}/calibration/{camera}/camera.json" for camera in CALIBRATED
            ],
            points=[
                f"{RESULTS}/calibration/{camera}/points.parquet"
                for camera in CALIBRATED
            ],
        output:
            table=f"{RESULTS}/calibration/backprojection.parquet",
            record=f"{RESULTS}/calibration/backprojection.json",
        log:
            f"{RESULTS}/logs/back_project.log",
        message:
            "Holding the calibration against its points"
        shell:
            "python -m vidtrack back_project --settings {input.order:q} --log {log:q}"
            " --input cameras {input.cameras:q} --input points {input.points:q}"
            " --output table {output.table:q} --output record {output.record:q}"

    rule overlay:
        input:
            order=lambda w: OVERLAY_ORDERS[w.camera],
            picture=f"{RESULTS}/calibration/{{camera}}/picture.png",
            points=f"{RESULTS}/calibration/{{camera}}/points.parquet",
            table=f"{RESULTS}/calibration/backprojection.parquet",
        output:
            overlay=f"{RESULTS}/calibration/overlay_{{camera}}.png",
        log:
            f"{RESULTS}/logs/overlay/{{camera}}.log",
        message:
            "Drawing the points over the picture of {wildcards.camera}"
        shell:
            "python -m vidtrack overlay --settings {input.order:q} --log {log:q}"
            " --input picture {input.picture:q} --input points {input.points:q} --input table {input.table:q}"
            " --output overlay {output.overlay:q}"


if SETS["calibration_after"]:

    rule stability:
        input:
            order=placed(
                "stability",
                orders.back_project(SETTINGS, SETS["calibration_after"]),
                [],
            ),
            before=[
                f"{RESULTS}/calibration/{camera}/camera.json"
                for camera in SETS["calibration_after"]
            ],
            after=[
                f"{RESULTS}/calibration_after/{camera}/camera.json"
                for camera in SETS["calibration_after"]
            ],
            before_points=[
                f"{RESULTS}/calibration/{camera}/points.parquet"
                for camera in SETS["calibration_after"]
            ],
            after_points=[
                f"{RESULTS}/calibration_after/{camera}/points.parquet"
                for camera in SETS["calibration_after"]
            ],
        output:
            record=f"{RESULTS}/calibration_after/stability.json",
        log:
            f"{RESULTS}/logs/stability.log",
        message:
            "Comparing the calibrations from before and after the test"
        shell:
            "python -m vidtrack stability --settings {input.order:q} --log {log:q}"
            " --input before {input.before:q} --input after {input.after:q}"
            " --input before_points {input.before_points:q} --input after_points {input.after_points:q}"
            " --output record {output.record:q}"
