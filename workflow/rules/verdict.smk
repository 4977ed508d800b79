# Needs: every record that the other rules make, and what a number must be judged by: points and trajectories.
# Makes: verdict.json: each calibration and each run good, doubtful, bad or failed, with reasons and what to do.

VERDICT = f"{RESULTS}/verdict.json"
JUDGED = [
    f"{RESULTS}/{clip_set}/{camera}/{name}"
    for clip_set, cameras in SETS.items()
    for camera in cameras
    for name in ("camera.json", "labelling.json", "points.parquet")
]
JUDGED += [
    f"{RESULTS}/calibration/{camera}/labelling.json"
    for camera in EXPERIMENT.cameras_in_clips()
    if camera not in NEEDED and clips_seen("calibration", camera)
]
JUDGED += [
    f"{RESULTS}/calibration/{camera}/{name}"
    for camera in WAVED
    for name in ("camera.json", "labelling.json", "points.parquet")
]
JUDGED += [f"{RESULTS}/calibration/wand.json"] if WAVED else []
JUDGED += [f"{RESULTS}/calibration/self.json"] if SELF_RUNS else []
JUDGED = list(dict.fromkeys(JUDGED))
JUDGED += [
    f"{RESULTS}/{clip_set}/survey.json"
    for clip_set in SETS
    if len(surveyed(clip_set)) > 1
]
if CALIBRATED:
    JUDGED.append(f"{RESULTS}/calibration/backprojection.json")
if CALIBRATED_AFTER:
    JUDGED.append(f"{RESULTS}/calibration_after/stability.json")
JUDGED += [path for path in CENTROIDS if path.endswith(".json")]
JUDGED += [f"{RESULTS}/runs/{run}/clocks.json" for run in CLOCKED]
JUDGED += [
    f"{RESULTS}/runs/{run}/{name}"
    for run in LOCATED
    for name in (
        "locate.json",
        "trajectories.parquet",
        "kinematics.json",
        *(["steadiness.json"] if run in STEADY else []),
    )
]
JUDGED += [
    f"{RESULTS}/calibration/{camera}/{name}"
    for camera in GIVEN
    for name in ("camera.json", "labelling.json")
]
JUDGED += [path for path in COMPARISONS if path.endswith(".json")]
JUDGED += [f"{RESULTS}/runs/{run}/bodies.json" for run in BODIED]
JUDGED += [f"{RESULTS}/runs/{run}/waterline.json" for run in WATERLINES]
JUDGED += [f"{RESULTS}/runs/{run}/analysis.json" for run in ANALYSED]
JUDGED += LEFT_OUT.records
BOOK.add(
    "verdict",
    report_orders.verdict(SETTINGS, EXPERIMENT, LEFT_OUT) | {"results": listed(JUDGED)},
)


rule verdict:
    input:
        results=results(lambda w: JUDGED),
    output:
        verdict=VERDICT,
        account=account("verdict"),
    log:
        f"{LOGS}/verdict.log",
    benchmark:
        f"{BENCHMARKS}/verdict.tsv"
    resources:
        mem_mb=400,
        runtime=10,
    params:
        **order("verdict"),
    message:
        "Judging the calibration and the runs"
    shell:
        "printf '%s\\n' {params:q} | python -m vidtrack verdict --account {output.account:q} --log {log:q}"
        " --input results {input.results:q} --output verdict {output.verdict:q}"
