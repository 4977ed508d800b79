"""Every number in a table is that of the record it is made of, rounded: no other number gets in.

Records are filled with numbers that occur once each, so that a number in a table shows where it comes from. A number
may stand there as it is, as a percentage, or as 1/N of it; rounded to the digits that are shown.
"""

import re

import numpy as np
import pytest

from tests.analysis.test_campaign import RECORDS, ROWS
from tests.analysis.test_uncertainty import AXES as MOTION_AXES
from tests.analysis.test_uncertainty import BUDGET, motions
from tests.stages.test_analysis import AXES, body_in_waves, swinging
from vidtrack.analysis.campaign import campaign
from vidtrack.analysis.uncertainty import uncertainty_statement
from vidtrack.files.records import plain
from vidtrack.report import analysis_sections, calibration_sections, campaign_page, run_sections, uncertainty_sections
from vidtrack.report.run_summary import run_summary
from vidtrack.results import RunResults
from vidtrack.stages.analysis import analysis

NUMBER = re.compile(r"(?<![\w.])(1/)?(-?\d+(?:,\d{3})*(?:\.\d+)?)(?:·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?( %)?")
POWERS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def numbers_of(record):
    """Every number of a record, wherever it lies."""
    if isinstance(record, dict):
        return [v for inner in record.values() for v in numbers_of(inner)]
    if isinstance(record, (list, tuple, np.ndarray)):
        return [v for inner in record for v in numbers_of(inner)]
    if isinstance(record, bool) or record is None or isinstance(record, str):
        return []
    return [float(record)] if np.isfinite(record) else []


def shown(text):
    """(value, half a unit of its last digit) of each number in a cell."""
    for one_over, digits, power, percent in NUMBER.findall(text):
        plain_digits = digits.replace(",", "")
        decimals = len(plain_digits.partition(".")[2])
        if "." not in plain_digits:  # 1250 may be rounded to tens
            decimals = -(len(plain_digits) - len(plain_digits.rstrip("0")))
        scale = 10.0 ** int(power.translate(POWERS)) if power else 1.0
        value, half = float(plain_digits) * scale, 0.5 * 10.0**-decimals * scale
        yield (1 / value, half / value**2) if one_over else (value / 100, half / 100) if percent else (value, half)


def strangers(table, record):
    """The numbers in a table's body that stand in no place of the record."""
    known = np.array([*numbers_of(record), 0.0])
    found = []
    for row in table.rows:
        for cell in row[1:]:
            found += [
                (row[0], cell)
                for value, half in shown(cell)
                if not (np.abs(known - value) <= 1.02 * half + 1e-12 * np.abs(known)).any()
            ]
    return found


RNG = np.random.default_rng(3)


def once(shape):
    """A number that occurs nowhere else."""
    return float(np.round(RNG.uniform(0.1, 0.9), 12)) if shape is None else {key: once(None) for key in shape}


def analysed():
    bodies, gauge = body_in_waves(np.random.default_rng(1))
    nothing = swinging(np.random.default_rng(2)).iloc[:0]
    how = {
        "axes": AXES,
        "waves": {"elevation": "eta", "depth": 3.0},
        "units": "m",
        "points": {"float": {"CoG": (1, 0, 2)}},
    }
    return plain(analysis(nothing, bodies, gauge, uncertainty={"gradients": np.full((1, 3, 3), 1e-3)}, **how).record)


def released():
    return plain(analysis(swinging(np.random.default_rng(0)), decay={}, units="in").record)


@pytest.mark.parametrize("record", [analysed(), released()], ids=["waves", "decay"])
def test_tables_of_the_analysis(record):
    tables = analysis_sections.analysis_tables(record, "m")
    assert len(tables) > 1
    for table in tables:
        assert strangers(table, record) == [], table.caption


def test_tables_of_the_uncertainty_statement():
    record = uncertainty_statement(BUDGET, motions(point=0.2631), MOTION_AXES, [motions(sd=1.0), motions(sd=1.3)])
    for table in uncertainty_sections.uncertainty_tables(plain(record), "m"):
        rows = [row[:-1] for row in table.rows]  # what would halve it is made of them, and tested where it is made
        assert strangers(table.__class__(table.caption, table.header, rows), record) == []


def test_tables_of_a_campaign():
    record = plain(campaign(ROWS, RECORDS))
    page = campaign_page.campaign_page(record, units="m", title="t", provenance={})
    for table in page.sections[0].tables:
        assert strangers(table, record) == [], table.caption


def test_tables_of_a_comparison():
    keys = ("gain", "bias", "rms", "max_abs", "correlation", "n")
    axes = {key: once("xyz") for key in ("bias", "mean_abs", "rms_by_axis", "max_abs")}
    record = {"lag_s": 0.2, "before": once(keys), "after": once(keys), "truth": {"n": 9, **axes}}
    for made in (run_sections.comparison_table(record, "m"), run_sections.truth_table(record, "m")):
        assert strangers(made, record) == []


def test_tables_of_locating_reading_and_run_up():
    tracks = {"cam1": ["t1"], "cam2": ["t2"]}
    targets = {"t1": {"tracks": tracks, "ambiguous": False, **once(("error_px", "error"))}}
    locate = {"correspondence": {"tolerance_px": 3.0, "tolerance": 0.5, "targets": targets}}
    assert strangers(run_sections.correspondence_table(locate, "m"), locate) == []
    heights = once(("mean_z", "sd_z", "lowest_z", "highest_z", "setup", "S", "Sinc", "Sig", "R2", "Rmax", "Tz"))
    shore = {"transects": {"a": {"frames": 800, "located": 800, "run_ups": 17, "crests": 9, **heights}}}
    extra = {"share": 1.0}
    assert strangers(run_sections.run_up_table(shore, "m"), {**shore, **extra}) == []
    smooth = {"smoothing": [{"target": "t1", "axis": "x", **once(("noise_sd", "noise_ratio", "spacing_s"))}]}
    assert strangers(run_sections.smoothing_table(smooth, "m"), smooth) == []
    pixels = {"mean": 61.25, "min": 55.0, "max": 70.0}
    own = {"samples": 240, "measured": 0.9875, "reading": {"frames": 241}, "time": {"source": "tmcd"}}
    readings = {"cam1": {**own, "targets": {"t": {"flags": {"lost": 0.0125}, "pixels": pixels}}}}
    assert strangers(run_sections.reading_table(readings), readings) == []


def test_the_table_of_all_runs():
    summary = {**run_summary("r", RunResults()), "targets": 1, "samples": 240, "located": 240}
    summary |= once(("length_s", "sigma_worst_axis", "rms")) | {
        "lag_s": 0.2,
        "lag_sd_s": 0.00031,
        "truth_one_over": 24500.0,
    }
    table = run_sections.runs_table([summary], "m")
    assert strangers(table, {**summary, "share": 1.0, "part": 1 / 24500.0}) == []


def test_tables_of_the_calibration():
    back = {key: once("xyz") for key in ("mean_abs", "max_abs")} | once(("mean_3d", "max_3d"))
    back |= {
        "largest_distance": 1.0,
        "diagonal_field": 1.0,
        "worst": {a: {"tag": "7", "error": once(None)} for a in "xyz"},
    }
    back["held_out"] = {key: once("xyz") for key in ("mean_abs", "max_abs")} | once(("mean_3d", "max_3d"))
    back["floor"] = {"mean_abs": once("xyz"), "mean_3d": once(None)}
    back["measures"] = {"cam1": {"distorted": once(("mean", "sd", "max", "sse"))}}
    back["n_points"] = 64
    for table in calibration_sections.accuracy_section(back, "m").tables:
        assert strangers(table, {**back, "tag": 7}) == [], table.caption
    names = ("Cx", "Cy", "f", "Sx", "kappa1")
    camera = {"camera": "cam1", "dx": 0.01, "dy": 0.02, **once(names), "standard_errors": once((*names, "t_x"))}
    camera |= {"position": [1.25, 2.75, 3.125], "position_sd": [0.0125, 0.02, 0.03]}
    table = calibration_sections._parameter_table(camera, "m")
    assert strangers(table, camera) == []


def test_a_number_that_is_in_no_record_is_noticed():
    record = released()
    table = analysis_sections.decay_table(record["decay"])
    rows = [[name, "0.81234", *rest[1:]] for name, *rest in table.rows]
    assert len(strangers(table.__class__(table.caption, table.header, rows), record)) == len(rows)
