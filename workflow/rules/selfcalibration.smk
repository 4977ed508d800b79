# Needs: what the cameras saw of a floating body (calibration.self), and their calibration.
# Makes: runs/<run>/body_sights.parquet; calibration/self.json and calibration/<camera>/refined.json, by which runs are
# located.

if SELF_RUNS:
    for run in SELF_RUNS:
        BOOK.add(
            "body_sights", self_orders.body_sights(SETTINGS, EXPERIMENT, run), [], run
        )
    BOOK.add(
        "self_calibrate",
        self_orders.self_calibrate(SETTINGS, EXPERIMENT),
        [],
        "calibration",
    )
    CALIBRATION.append(f"{RESULTS}/calibration/self.json")

    rule body_sights:
        input:
            centroids=of_cameras("centroids/{camera}.parquet"),
            tracklets=of_cameras("tracklets/{camera}.parquet"),
            readings=of_cameras("centroids/{camera}.json"),
            cameras=results(lambda w: calibrations(w.run, "camera.json")),
            points=results(lambda w: calibrations(w.run, "points.parquet")),
            labelling=results(lambda w: calibrations(w.run, "labelling.json")),
            steadiness=results(lambda w: followed(w.run)),
            clocks=results(lambda w: own_clocks(w.run)),
        output:
            sights=f"{RESULTS}/runs/{{run}}/body_sights.parquet",
            account=account("body_sights", "{run}"),
        log:
            f"{LOGS}/body_sights/{{run}}.log",
        benchmark:
            f"{BENCHMARKS}/body_sights/{{run}}.tsv"
        resources:
            mem_mb=400,
            runtime=lambda w, input: 10 + input.size_mb,
        params:
            **order("body_sights", "run"),
        message:
            "Locating the body of {wildcards.run} for self-calibration"
        shell:
            "printf '%s\\n' {params:q} | python -m vidtrack body_sights --account {output.account:q} --log {log:q}"
            " --input centroids {input.centroids:q} --input tracklets {input.tracklets:q}"
            " --input readings {input.readings:q}"
            " --input cameras {input.cameras:q} --input points {input.points:q}"
            " --input labelling {input.labelling:q} --input clocks {input.clocks:q}"
            " --input steadiness {input.steadiness:q}"
            " --output sights {output.sights:q}"

    rule self_calibrate:
        input:
            cameras=results(
                lambda w: [
                    f"{RESULTS}/calibration/{c}/camera.json" for c in SELF_CAMERAS
                ]
            ),
            points=results(
                lambda w: [
                    f"{RESULTS}/calibration/{c}/points.parquet" for c in SELF_CAMERAS
                ]
            ),
            sights=results(
                lambda w: [
                    f"{RESULTS}/runs/{run}/body_sights.parquet" for run in SELF_RUNS
                ]
            ),
        output:
            **{
                f"camera_{i}": f"{RESULTS}/calibration/{camera}/refined.json"
                for i, camera in enumerate(SELF_CAMERAS)
            },
            record=f"{RESULTS}/calibration/self.json",
            account=account("self_calibrate", "calibration"),
        log:
            f"{LOGS}/self_calibrate/calibration.log",
        benchmark:
            f"{BENCHMARKS}/self_calibrate/calibration.tsv"
        resources:
            mem_mb=600,
            runtime=20,
        params:
            **order("self_calibrate", parts=("calibration",)),
        message:
            "Refining the cameras by the body that floats before them"
        shell:
            "printf '%s\\n' {params:q} | python -m vidtrack self_calibrate --account {output.account:q} --log {log:q}"
            " --input cameras {input.cameras:q} --input points {input.points:q} --input sights {input.sights:q}"
            " --output record {output.record:q}"
            + "".join(
                f" --output camera_{i} {{output.camera_{i}:q}}"
                for i in range(len(SELF_CAMERAS))
            )
