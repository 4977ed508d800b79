# Needs: calibration/<clip>/<camera>.<ext> of a board (calibration/<clip>/board.yaml, or calibration.board in the config).
# Makes: boards/<camera>/corners.parquet, lens.json and boards.json: lenses, and the cameras' places to each other. A
# camera without surveyed points has its sightings from there too: the board of one view is the world, or it is placed
# among the cameras that see surveyed points.

BOARDED = [
    camera
    for camera in EXPERIMENT.cameras_in_clips()
    if boarded.board_clips(SETTINGS, EXPERIMENT, camera)
]
# Where a wand places the cameras, or surveyed points do, the board gives their lenses alone.
PLACED_BY_BOARD = [
    camera
    for camera in BOARDED
    if not clips_seen("calibration", camera)
    and camera not in waved.wand_cameras(SETTINGS, EXPERIMENT)
]
for camera in BOARDED:
    BOOK.add(
        "board_corners",
        boarded.board_corners(SETTINGS, EXPERIMENT, camera),
        [
            files_of(EXPERIMENT.clips[clip], camera)
            for clip in boarded.board_clips(SETTINGS, EXPERIMENT, camera)
        ],
        camera,
    )
# Cameras that see surveyed points too: among them the board places those that see none.
BESIDE_SURVEY = [c for c in BOARDED if clips_seen("calibration", c)]
PLACING = BESIDE_SURVEY if PLACED_BY_BOARD else []
if BOARDED:
    BOOK.add(
        "boards",
        or_stop(boarded.boards, SETTINGS, EXPERIMENT, BOARDED)
        | {
            "surveyed": [c for c in BOARDED if c not in PLACED_BY_BOARD],
            "placing": PLACING,
        },
    )
for camera in PLACED_BY_BOARD:
    BOOK.add("board_sightings", {"units": SETTINGS.units, "camera": camera}, [], camera)


rule board_corners:
    input:
        videos=lambda w: ancient(
            [
                EXPERIMENT.clips[clip].videos[w.camera]
                for clip in boarded.board_clips(SETTINGS, EXPERIMENT, w.camera)
            ]
        ),
    output:
        corners=f"{RESULTS}/boards/{{camera}}/corners.parquet",
        picture=f"{RESULTS}/boards/{{camera}}/picture.png",
        record=f"{RESULTS}/boards/{{camera}}/board.json",
        account=account("board_corners", "{camera}"),
    log:
        f"{LOGS}/board_corners/{{camera}}.log",
    benchmark:
        f"{BENCHMARKS}/board_corners/{{camera}}.tsv"
    resources:
        mem_mb=800,
        runtime=lambda w, input: 10 + input.size_mb // 20,
    params:
        **order("board_corners", "camera"),
    message:
        "Finding the corners of the board that {wildcards.camera} sees"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack board_corners --account {output.account:q} --log {log:q}"
        " --input videos {input.videos:q}"
        " --output corners {output.corners:q} --output picture {output.picture:q} --output record {output.record:q}"


rule boards:
    input:
        corners=of_boards("corners.parquet"),
        records=of_boards("board.json"),
        survey=results(
            lambda w: [f"{RESULTS}/calibration/{c}/sightings.parquet" for c in PLACING]
        ),
    output:
        **{
            f"lens_{i}": f"{RESULTS}/boards/{camera}/lens.json"
            for i, camera in enumerate(BOARDED)
        },
        **{
            f"sightings_{i}": f"{RESULTS}/boards/{camera}/sightings.parquet"
            for i, camera in enumerate(BOARDED)
        },
        record=f"{RESULTS}/boards/boards.json",
        account=account("boards"),
    log:
        f"{LOGS}/boards.log",
    benchmark:
        f"{BENCHMARKS}/boards.tsv"
    resources:
        mem_mb=800,
        runtime=20,
    params:
        **order("boards"),
    message:
        "Calibrating the lenses by the board"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack boards --account {output.account:q} --log {log:q}"
        " --input corners {input.corners:q} --input records {input.records:q} --input survey {input.survey:q}"
        " --output record {output.record:q}"
        + "".join(
            f" --output {camera}_lens {{output.lens_{i}:q}}"
            f" --output {camera}_sightings {{output.sightings_{i}:q}}"
            for i, camera in enumerate(BOARDED)
        )


rule board_sightings:
    input:
        record=results(f"{RESULTS}/boards/{{camera}}/board.json"),
        picture=results(f"{RESULTS}/boards/{{camera}}/picture.png"),
        found=results(f"{RESULTS}/boards/{{camera}}/sightings.parquet"),
    output:
        sightings=f"{RESULTS}/calibration/{{camera}}/sightings.parquet",
        picture=f"{RESULTS}/calibration/{{camera}}/picture.png",
        background=f"{RESULTS}/calibration/{{camera}}/background.png",
        record=f"{RESULTS}/calibration/{{camera}}/labelling.json",
        account=account("board_sightings", "{camera}"),
    log:
        f"{LOGS}/board_sightings/{{camera}}.log",
    benchmark:
        f"{BENCHMARKS}/board_sightings/{{camera}}.tsv"
    wildcard_constraints:
        camera="|".join(map(re.escape, PLACED_BY_BOARD)) or "a^",
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("board_sightings", "camera"),
    message:
        "Taking the board's corners for the points of {wildcards.camera}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack board_sightings --account {output.account:q} --log {log:q}"
        " --input record {input.record:q} --input picture {input.picture:q} --input found {input.found:q}"
        " --output sightings {output.sightings:q} --output picture {output.picture:q}"
        " --output background {output.background:q} --output record {output.record:q}"


ruleorder: board_sightings > calibration_points
