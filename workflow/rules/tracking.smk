# Needs: runs/<run>/<camera>.<ext>, and runs/<run>/targets.csv where someone placed the boxes.
# Makes: runs/<run>/centroids/<camera>.parquet, every target in every frame, and .json, an account of the reading;
# runs/<run>/tracklets/<camera>.parquet, all that was followed, in stretches of certain identity;
# runs/<run>/windows/<camera>.parquet, pieces of pictures in which targets were sought in vain;
# runs/<run>/light/<camera>.parquet, how bright each picture was and when; runs/<run>/background/<camera>.png and
# .parquet, its background at the beginning, and how far patches of it moved.

TRACKS = [
    (name, camera)
    for name, run in EXPERIMENT.runs.items()
    if name not in SETTINGS.runs or SETTINGS.runs[name].mode != "waterline"
    for camera in run.videos
]
CENTROIDS = [
    f"{RESULTS}/runs/{run}/centroids/{camera}.{kind}"
    for run, camera in TRACKS
    for kind in ("parquet", "json")
]
for run, camera in TRACKS:
    if camera in EXPERIMENT.runs[run].tracks:
        continue  # another program has followed them: see importing.smk
    BOOK.add(
        "track",
        orders.track(SETTINGS, EXPERIMENT, run, camera),
        [files_of(EXPERIMENT.runs[run], camera), EXPERIMENT.runs[run].targets],
        run,
        camera,
    )


rule track:
    input:
        video=lambda w: ancient(EXPERIMENT.runs[w.run].videos[w.camera]),
        targets=lambda w: ancient(EXPERIMENT.runs[w.run].targets or []),
    output:
        centroids=f"{RESULTS}/runs/{{run}}/centroids/{{camera}}.parquet",
        record=f"{RESULTS}/runs/{{run}}/centroids/{{camera}}.json",
        tracklets=f"{RESULTS}/runs/{{run}}/tracklets/{{camera}}.parquet",
        windows=f"{RESULTS}/runs/{{run}}/windows/{{camera}}.parquet",
        light=f"{RESULTS}/runs/{{run}}/light/{{camera}}.parquet",
        background=f"{RESULTS}/runs/{{run}}/background/{{camera}}.parquet",
        picture=f"{RESULTS}/runs/{{run}}/background/{{camera}}.png",
        account=account("track", "{run}", "{camera}"),
    log:
        f"{LOGS}/track/{{run}}/{{camera}}.log",
    benchmark:
        f"{BENCHMARKS}/track/{{run}}/{{camera}}.tsv"
    # One core a recording where many wait; a single recording takes what there is.
    threads: max(1, (workflow.cores or 1) // max(1, len(TRACKS)))
    resources:
        mem_mb=600,
        runtime=lambda w, input: 10 + input.size_mb // 20,
    params:
        **order("track", "run", "camera"),
    message:
        "Following the targets of {wildcards.run} in {wildcards.camera}"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack track --account {output.account:q}"
        " --threads {threads} --log {log:q}"
        " --input video {input.video:q} --input targets {input.targets:q}"
        " --output centroids {output.centroids:q} --output tracklets {output.tracklets:q}"
        " --output windows {output.windows:q}"
        " --output record {output.record:q} --output light {output.light:q}"
        " --output background {output.background:q} --output picture {output.picture:q}"
