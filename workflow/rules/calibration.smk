# Needs: calibration/points.csv, calibration/<clip>/<camera>.<ext>, and picks.csv where someone named a few points.
# Makes: calibration/<camera>/sightings, points and camera.json; backprojection tables; overlays.
# Clips filmed after the test (calibration.after) go the same way, under calibration_after, and end in stability.json.

SETS = {"calibration": [], "calibration_after": []}
# A run in a plane needs what its camera sees of the points, and no calibration, for which they may be too few.
NEEDED = orders.calibrated(SETTINGS, EXPERIMENT)
# Cameras whose places to each other a board shows, where surveyed points place some of them too.
TIED = boarded.tied(SETTINGS, EXPERIMENT, NEEDED)
BUNDLED = {
    "calibration": bool(TIED) or SETTINGS.calibration.refine == "bundle",
    "calibration_after": SETTINGS.calibration.refine == "bundle",
}
# Cameras whose points another program digitised: see importing.smk.
DIGITISED = sorted({c for clip in EXPERIMENT.clips.values() for c in clip.digitised})


for clip_set, members in SETS.items():
    for camera in EXPERIMENT.cameras_in_clips():
        clips = clips_seen(clip_set, camera)
        after = clip_set == "calibration_after"
        if clips and camera in DIGITISED:
            BOOK.add(
                "import_points",
                import_orders.import_points(SETTINGS, EXPERIMENT, camera, after),
                [EXPERIMENT.points, *(clip.videos[camera] for clip in clips)],
                clip_set,
                camera,
            )
        elif clips:
            BOOK.add(
                "calibration_points",
                orders.calibration_points(SETTINGS, EXPERIMENT, camera, after),
                [
                    EXPERIMENT.points,
                    *(
                        p
                        for clip in clips
                        for p in (files_of(clip, camera), clip.picks)
                    ),
                ],
                clip_set,
                camera,
            )
        by_its_board = clip_set == "calibration" and camera in PLACED_BY_BOARD
        if (clips or by_its_board) and camera in NEEDED:
            members.append(camera)
            BOOK.add(
                "calibrate",
                orders.calibrate(SETTINGS, camera, camera in BOARDED),
                [orders.lens_file(SETTINGS, camera)],
                clip_set,
                camera,
            )
    if len(surveyed(clip_set)) > 1:
        BOOK.add("survey", orders.survey(SETTINGS, surveyed(clip_set)), [], clip_set)
    if BUNDLED[clip_set] and members:
        by_board = boarded.bundle(SETTINGS, BOARDED, TIED, PLACED_BY_BOARD)
        own = by_board if TIED and clip_set == "calibration" else {}
        BOOK.add("bundle", orders.bundle(SETTINGS, members) | own, [], clip_set)
CALIBRATED, CALIBRATED_AFTER = SETS.values()
# Cameras that film a wand are calibrated by it, whether or not they see surveyed points too.
WAVED = waved.wand_cameras(SETTINGS, EXPERIMENT)
WAND_FILES = {
    "camera": "camera.json",
    "points": "points.parquet",
    "labelling": "labelling.json",
    "sightings": "sightings.parquet",
    "background": "background.png",
}
WANDS = {clip: EXPERIMENT.clips[clip] for clip in waved.wand_clips(SETTINGS)}
WAND = wand_orders.wand(SETTINGS, EXPERIMENT) if WAVED else {}
for clip, own in WANDS.items():
    for camera in own.videos:
        BOOK.add(
            "track_wand",
            wand_orders.track_wand(SETTINGS, EXPERIMENT, clip, camera),
            [files_of(own, camera)],
            clip,
            camera,
        )
if WAVED:
    picks = WANDS[WAND["clip"]].picks
    BOOK.add("wand", WAND, [picks] if picks else [], "calibration")
CALIBRATION = [
    f"{RESULTS}/calibration/{camera}/{name}"
    for camera in CALIBRATED
    for name in ("points.parquet", "camera.json")
]
CALIBRATION += [
    f"{RESULTS}/calibration/{name}" for name in ("wand.json", "wand.parquet") if WAVED
]
if CALIBRATED:
    by_board = boarded.bundle(SETTINGS, BOARDED, TIED, PLACED_BY_BOARD) if TIED else {}
    own = {key: by_board[key] for key in ("boarded", "bare") if key in by_board}
    BOOK.add("back_project", orders.back_project(SETTINGS, CALIBRATED) | own)
    for camera in CALIBRATED:
        BOOK.add("overlay", {"camera": camera}, [], camera)
    CALIBRATION += [
        f"{RESULTS}/calibration/overlay_{camera}.png" for camera in CALIBRATED
    ]
    CALIBRATION += [
        f"{RESULTS}/calibration/backprojection.{kind}" for kind in ("parquet", "json")
    ]
if CALIBRATED_AFTER:
    BOOK.add("stability", orders.back_project(SETTINGS, CALIBRATED_AFTER))
    CALIBRATION.append(f"{RESULTS}/calibration_after/stability.json")


by_board = results(f"{RESULTS}/boards/{{camera}}/lens.json")


rule calibration_points:
    input:
        points=ancient(EXPERIMENT.points or []),
        videos=lambda w: ancient(
            [clip.videos[w.camera] for clip in clips_seen(w.set, w.camera)]
        ),
        picks=lambda w: ancient(
            [clip.picks for clip in clips_seen(w.set, w.camera) if clip.picks]
        ),
        # Clips filmed after the test need no picks of their own: the balls are where they were before it.
        before=results(
            lambda w: (
                f"{RESULTS}/calibration/{w.camera}/sightings.parquet"
                if w.set == "calibration_after" and w.camera in CALIBRATED
                else []
            )
        ),
    output:
        sightings=f"{RESULTS}/{{set}}/{{camera}}/sightings.parquet",
        picture=f"{RESULTS}/{{set}}/{{camera}}/picture.png",
        background=f"{RESULTS}/{{set}}/{{camera}}/background.png",
        record=f"{RESULTS}/{{set}}/{{camera}}/labelling.json",
        account=account("calibration_points", "{set}", "{camera}"),
    log:
        f"{LOGS}/calibration_points/{{set}}/{{camera}}.log",
    benchmark:
        f"{BENCHMARKS}/calibration_points/{{set}}/{{camera}}.tsv"
    threads: max(1, (workflow.cores or 1) // max(1, len(CALIBRATED)))
    resources:
        mem_mb=600,
        runtime=lambda w, input: 10 + input.size_mb // 20,
    params:
        **order("calibration_points", "set", "camera"),
    message:
        "Finding and naming the calibration points that {wildcards.camera} sees"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack calibration_points --account {output.account:q}"
        " --threads {threads} --log {log:q}"
        " --input points {input.points:q} --input videos {input.videos:q} --input picks {input.picks:q}"
        " --input before {input.before:q}"
        " --output sightings {output.sightings:q} --output picture {output.picture:q}"
        " --output background {output.background:q} --output record {output.record:q}"


rule survey:
    input:
        sightings=results(
            lambda w: [
                f"{RESULTS}/{w.set}/{c}/sightings.parquet" for c in surveyed(w.set)
            ]
        ),
        pictures=results(
            lambda w: [f"{RESULTS}/{w.set}/{c}/picture.png" for c in surveyed(w.set)]
        ),
    output:
        record=f"{RESULTS}/{{set}}/survey.json",
        account=account("survey", "{set}"),
    log:
        f"{LOGS}/survey/{{set}}.log",
    benchmark:
        f"{BENCHMARKS}/survey/{{set}}.tsv"
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("survey", "set"),
    message:
        "Judging the surveyed points by all cameras"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack survey --account {output.account:q} --log {log:q}"
        " --input sightings {input.sightings:q} --input pictures {input.pictures:q} --output record {output.record:q}"


rule calibrate:
    input:
        # one camera cannot distinguish a misplaced point from a mistaken one
        survey=results(
            lambda w: (
                f"{RESULTS}/{w.set}/survey.json"
                if len(surveyed(w.set)) > 1 and w.camera in surveyed(w.set)
                else []
            )
        ),
        sightings=results(f"{RESULTS}/{{set}}/{{camera}}/sightings.parquet"),
        labelling=results(f"{RESULTS}/{{set}}/{{camera}}/labelling.json"),
        picture=results(f"{RESULTS}/{{set}}/{{camera}}/picture.png"),
        lens=lambda w: (
            by_board(w)
            if camera_by_board(w.camera)
            else ancient(orders.lens_file(SETTINGS, w.camera) or [])
        ),
    output:
        points=f"{RESULTS}/{{set}}/{{camera}}/points.parquet",
        camera=f"{RESULTS}/{{set}}/{{camera}}/{'alone' if BUNDLED['calibration'] else 'camera'}.json",
        search=f"{RESULTS}/{{set}}/{{camera}}/search.parquet",
        account=account("calibrate", "{set}", "{camera}"),
    log:
        f"{LOGS}/calibrate/{{set}}/{{camera}}.log",
    benchmark:
        f"{BENCHMARKS}/calibrate/{{set}}/{{camera}}.tsv"
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("calibrate", "set", "camera"),
    message:
        "Calibrating {wildcards.camera}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack calibrate --account {output.account:q} --log {log:q}"
        " --input sightings {input.sightings:q} --input labelling {input.labelling:q}"
        " --input picture {input.picture:q} --input survey {input.survey:q} --input lens {input.lens:q}"
        " --output points {output.points:q} --output camera {output.camera:q} --output search {output.search:q}"


rule bundle:
    input:
        alone=of_each("calibration", "alone.json"),
        points=of_each("calibration", "points.parquet"),
        board=results(lambda w: [f"{RESULTS}/boards/boards.json"] if TIED else []),
        lenses=of_boards("lens.json") if TIED else [],
    output:
        **{
            f"camera_{i}": f"{RESULTS}/calibration/{camera}/camera.json"
            for i, camera in enumerate(CALIBRATED)
            if BUNDLED["calibration"]
        },
        account=account("bundle", "calibration"),
    log:
        f"{LOGS}/bundle/calibration.log",
    benchmark:
        f"{BENCHMARKS}/bundle/calibration.tsv"
    resources:
        mem_mb=400,
        runtime=20,
    params:
        **order("bundle", parts=("calibration",)),
    message:
        "Refining all cameras and the surveyed points together"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack bundle --account {output.account:q} --log {log:q}"
        " --input alone {input.alone:q} --input points {input.points:q}"
        " --input board {input.board:q} --input lenses {input.lenses:q}"
        + "".join(
            f" --output {camera} {{output.camera_{i}:q}}"
            for i, camera in enumerate(CALIBRATED)
        )


rule bundle_after:
    input:
        alone=of_each("calibration_after", "alone.json"),
        points=of_each("calibration_after", "points.parquet"),
    output:
        **{
            f"camera_{i}": f"{RESULTS}/calibration_after/{camera}/camera.json"
            for i, camera in enumerate(CALIBRATED_AFTER)
            if BUNDLED["calibration_after"]
        },
        account=account("bundle", "calibration_after"),
    log:
        f"{LOGS}/bundle/calibration_after.log",
    benchmark:
        f"{BENCHMARKS}/bundle/calibration_after.tsv"
    resources:
        mem_mb=400,
        runtime=20,
    params:
        **order("bundle", parts=("calibration_after",)),
    message:
        "Refining all cameras and the surveyed points of after the test together"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack bundle --account {output.account:q} --log {log:q}"
        " --input alone {input.alone:q} --input points {input.points:q}"
        + "".join(
            f" --output {camera} {{output.camera_{i}:q}}"
            for i, camera in enumerate(CALIBRATED_AFTER)
        )


rule back_project:
    input:
        cameras=of_each("calibration", "camera.json"),
        points=of_each("calibration", "points.parquet"),
        board=results(lambda w: [f"{RESULTS}/boards/boards.json"] if TIED else []),
        lenses=of_boards("lens.json") if TIED else [],
    output:
        table=f"{RESULTS}/calibration/backprojection.parquet",
        record=f"{RESULTS}/calibration/backprojection.json",
        account=account("back_project"),
    log:
        f"{LOGS}/back_project.log",
    benchmark:
        f"{BENCHMARKS}/back_project.tsv"
    priority: 1
    resources:
        mem_mb=400,
        runtime=20,
    params:
        **order("back_project"),
    message:
        "Checking the calibration on its own points"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack back_project --account {output.account:q} --log {log:q}"
        " --input cameras {input.cameras:q} --input points {input.points:q}"
        " --input board {input.board:q} --input lenses {input.lenses:q}"
        " --output table {output.table:q} --output record {output.record:q}"


rule overlay:
    input:
        picture=results(f"{RESULTS}/calibration/{{camera}}/picture.png"),
        points=results(f"{RESULTS}/calibration/{{camera}}/points.parquet"),
        table=results(f"{RESULTS}/calibration/backprojection.parquet"),
    output:
        overlay=report(
            f"{RESULTS}/calibration/overlay_{{camera}}.png", category="Calibration"
        ),
        account=account("overlay", "{camera}"),
    log:
        f"{LOGS}/overlay/{{camera}}.log",
    benchmark:
        f"{BENCHMARKS}/overlay/{{camera}}.tsv"
    priority: 1
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("overlay", "camera"),
    message:
        "Drawing the points over the picture of {wildcards.camera}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack overlay --account {output.account:q} --log {log:q}"
        " --input picture {input.picture:q} --input points {input.points:q} --input table {input.table:q}"
        " --output overlay {output.overlay:q}"


rule stability:
    input:
        before=results(
            lambda w: [
                f"{RESULTS}/calibration/{c}/camera.json" for c in CALIBRATED_AFTER
            ]
        ),
        after=of_each("calibration_after", "camera.json"),
        before_points=results(
            lambda w: [
                f"{RESULTS}/calibration/{c}/points.parquet" for c in CALIBRATED_AFTER
            ]
        ),
        after_points=of_each("calibration_after", "points.parquet"),
    output:
        record=f"{RESULTS}/calibration_after/stability.json",
        account=account("stability"),
    log:
        f"{LOGS}/stability.log",
    benchmark:
        f"{BENCHMARKS}/stability.tsv"
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("stability"),
    message:
        "Comparing the calibrations from before and after the test"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack stability --account {output.account:q} --log {log:q}"
        " --input before {input.before:q} --input after {input.after:q}"
        " --input before_points {input.before_points:q} --input after_points {input.after_points:q}"
        " --output record {output.record:q}"


rule track_wand:
    input:
        video=lambda w: ancient(WANDS[w.clip].videos[w.camera]),
    output:
        centroids=f"{RESULTS}/calibration/tracks/{{clip}}/{{camera}}.parquet",
        record=f"{RESULTS}/calibration/tracks/{{clip}}/{{camera}}.json",
        tracklets=f"{RESULTS}/calibration/tracks/{{clip}}/{{camera}}_tracklets.parquet",
        light=f"{RESULTS}/calibration/tracks/{{clip}}/{{camera}}_light.parquet",
        background=f"{RESULTS}/calibration/tracks/{{clip}}/{{camera}}_background.parquet",
        picture=f"{RESULTS}/calibration/tracks/{{clip}}/{{camera}}_background.png",
        account=account("track_wand", "{clip}", "{camera}"),
    log:
        f"{LOGS}/track_wand/{{clip}}/{{camera}}.log",
    benchmark:
        f"{BENCHMARKS}/track_wand/{{clip}}/{{camera}}.tsv"
    threads: max(1, (workflow.cores or 1) // max(1, len(WAVED)))
    resources:
        mem_mb=600,
        runtime=lambda w, input: 10 + input.size_mb // 20,
    params:
        **order("track_wand", "clip", "camera"),
    message:
        "Following the balls of {wildcards.clip} in {wildcards.camera}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack track_wand --account {output.account:q}"
        " --threads {threads} --log {log:q} --input video {input.video:q}"
        " --output centroids {output.centroids:q} --output tracklets {output.tracklets:q}"
        " --output record {output.record:q} --output light {output.light:q}"
        " --output background {output.background:q} --output picture {output.picture:q}"


rule wand:
    input:
        tracks=of_wand("{camera}_tracklets.parquet"),
        readings=of_wand("{camera}.json"),
        backgrounds=of_wand("{camera}_background.png"),
        drop=of_wand("{camera}.parquet", drop=True),
        drop_readings=of_wand("{camera}.json", drop=True),
        sightings=results(
            lambda w: [
                f"{RESULTS}/calibration/{c}/sightings.parquet"
                for c in WAND["surveyed"]
            ]
        ),
        picks=lambda w: ancient(
            [p for p in [WANDS[WAND["clip"]].picks] if p] if WAVED else []
        ),
    output:
        **{
            f"{name}_{i}": f"{RESULTS}/calibration/{camera}/{file}"
            for i, camera in enumerate(WAVED)
            for name, file in WAND_FILES.items()
            if name in ("camera", "points") or camera in WAND["bare"]
        },
        record=f"{RESULTS}/calibration/wand.json",
        table=f"{RESULTS}/calibration/wand.parquet",
        account=account("wand", "calibration"),
    log:
        f"{LOGS}/wand/calibration.log",
    benchmark:
        f"{BENCHMARKS}/wand/calibration.tsv"
    resources:
        mem_mb=600,
        runtime=20,
    params:
        **order("wand", parts=("calibration",)),
    message:
        "Calibrating the cameras by the wand"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack wand --account {output.account:q} --log {log:q}"
        " --input tracks {input.tracks:q} --input readings {input.readings:q}"
        " --input backgrounds {input.backgrounds:q}"
        " --input drop {input.drop:q} --input drop_readings {input.drop_readings:q}"
        " --input sightings {input.sightings:q} --input picks {input.picks:q}"
        " --output record {output.record:q} --output table {output.table:q}"
        + "".join(
            f" --output {name}_{i} {{output.{name}_{i}:q}}"
            for i, camera in enumerate(WAVED)
            for name in WAND_FILES
            if name in ("camera", "points") or camera in WAND["bare"]
        )
