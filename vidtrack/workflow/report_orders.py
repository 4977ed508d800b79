"""Exactly the settings by which results are judged, shown and handed to other programs; as `workflow.orders`."""

from __future__ import annotations

from vidtrack.files.csv_checked import checked_csv
from vidtrack.files.csv_columns import CAMPAIGN
from vidtrack.files.experiment import Experiment, Run, awaited_runs
from vidtrack.settings.config import Settings
from vidtrack.workflow.left_out import NOTHING, LeftOut
from vidtrack.workflow.own_settings import Order, crop_of, own_of, recording_of, targets_of


def verdict(settings: Settings, experiment: Experiment, left: LeftOut = NOTHING) -> Order:
    """What the config asks of each run, so that what is missing is seen to be missing."""
    runs = {name: _asked(settings, run, left) for name, run in experiment.runs.items()}
    awaited = awaited_runs(settings, experiment)
    return {"runs": runs} | ({"awaited": awaited} if awaited else {})


def overlay_film(settings: Settings, experiment: Experiment, run: str, camera: str) -> Order:
    """How the recording is opened over which what was found is drawn."""
    return {
        "run": run,
        "camera": camera,
        "crop": crop_of(settings, run, camera),
        "recording": recording_of(settings, experiment.runs[run], camera),
    }


def campaign_rows(settings: Settings, experiment: Experiment) -> list[Order]:
    """The runs of the campaign: those of runs.csv with their conditions, and those that it does not list."""
    listed = checked_csv(experiment.campaign, CAMPAIGN, others="ignore") if experiment.campaign else {}
    columns = {key: listed[key] for key in ("run", "H", "T", "heading", "scale", "repeat", "notes") if key in listed}
    rows: list[Order] = [dict(zip(columns, cells, strict=True)) for cells in zip(*columns.values(), strict=True)]
    names = {row["run"] for row in rows}
    rows = [row | {"listed": True} for row in rows]
    rows += [{"run": run, "listed": False} for run in experiment.runs if run not in names]
    for row in rows:
        row |= {key: None for key in ("H", "T", "heading", "scale") if row.get(key) != row.get(key)}  # NaN
        if row.get("scale") is None:
            row["scale"] = settings.scale
        asked = own_of(settings, row["run"]).analysis
        row["analysis"] = asked.model_dump() if asked else None
    return rows


def campaign(settings: Settings, experiment: Experiment) -> Order:
    """Under which conditions each run was made, and what is asked of it."""
    return _titled(settings) | {"rows": campaign_rows(settings, experiment)}


def report(settings: Settings, experiment: Experiment) -> Order:
    """What the first page of the report shows."""
    return _titled(settings) | {"runs": list(experiment.runs)}


def report_calibration(settings: Settings) -> Order:
    """What the page of the calibration says of itself."""
    return _titled(settings) | {"cameras": sorted(settings.cameras)}


def report_run(settings: Settings, experiment: Experiment, run: str, left: LeftOut = NOTHING) -> Order:
    """What the page of a run says of itself, and what is asked of the run."""
    return report_calibration(settings) | {"run": run, "asked": _asked(settings, experiment.runs[run], left)}


def _asked(settings: Settings, run: Run, left: LeftOut) -> Order:
    own = own_of(settings, run.name)
    without = left.of_run(run.name)
    return {
        **({"without": without} if without else {}),
        **({} if settings.calibration.same_balls else {"same_balls": False}),
        "mode": own.mode,
        "cameras": list(run.videos),
        "targets": targets_of(settings, run) if own.mode != "waterline" else None,
    }


def _titled(settings: Settings) -> Order:
    return {"title": settings.title or "Experiment", "units": settings.units}


def exported(settings: Settings, run: str) -> tuple[str, ...]:
    """The formats in which a run's results are wanted too."""
    own = own_of(settings, run).export
    return settings.export if own is None else own


def export(settings: Settings, run: str, format_name: str) -> Order:
    """What a file of another program says beside the numbers."""
    own = own_of(settings, run)
    axes = own.axes or settings.axes
    order: Order = {"units": settings.units, "run": run, "format": format_name, "mode": own.mode}
    return order | {"axes": axes.model_dump() if axes else None}
