"""What a run's tables and sentences say is what the records hold, for all targets and all clocks."""

from vidtrack.report.run_sections import (
    bodies_table,
    clock_lines,
    clock_table,
    comparison_table,
    correspondence_table,
    reading_table,
    run_section,
    run_up_table,
    runs_table,
    smoothing_table,
    truth_table,
)
from vidtrack.report.run_summary import run_summary
from vidtrack.results import RunResults


def reading(**targets):
    video, time = {"rate": 30000 / 1001}, {"source": "tmcd"}
    record = {"reading": {"frames": 240}, "video": video, "time": time, "samples": 480, "measured": 0.5}
    return record | {"targets": targets}


def counted(mean, least, most, **flags):
    return {"flags": flags, "pixels": {"mean": mean, "sd": 1.0, "min": least, "max": most}}


def test_pixels_and_flags_are_those_of_all_targets():
    record = reading(a=counted(60.0, 50.0, 70.0, lost=0.5), b=counted(20.0, 9.0, 22.0), c={"flags": {}, "pixels": {}})
    (row,) = reading_table({"cam1": record}).rows
    assert row == ["cam1", "240", "29.97", "tmcd", "480", "50 %", "lost 17 %", "40", "9–70"]
    (bare,) = reading_table({"cam1": reading()}).rows
    assert bare[-3:] == ["none", "–", "–"]


def test_a_line_of_the_runs_is_its_summary_and_one_without_positions_has_none():
    own = {"run": "pluck", "targets": 1, "length_s": 7.8, "samples": 4, "located": 3, "sigma_worst_axis": 0.03}
    own |= {"lag_s": 0.200098, "lag_sd_s": 0.0001, "rms": 0.05, "truth_one_over": 21900.0}
    bare = run_summary("bare", RunResults()) | {"targets": 1}
    table = runs_table([own, bare, run_summary("beach", RunResults())], "in")
    assert table.rows[0] == ["pluck", "1", "7.8", "4", "75 %", "0.03", "0.20010", "0.05", "1/21,900"]
    assert table.rows[1][-3:] == ["–", "–", "–"]
    assert list(table.keys) == ["run-pluck", "run-bare"]


def test_a_run_that_failed_has_a_section_all_the_same():
    section = run_section("pluck", RunResults(), "in")
    assert (section.key, section.title, list(section.tables)) == ("run-pluck", "pluck", [])
    assert section.lines == ["Nothing was located in this run: see the verdict."]


def test_clocks_that_were_not_set_are_not_shown():
    still = {"offset_s": 0.0, "rate_ppm": 0.0, "source": "config"}
    assert clock_table({"clocks": {"cameras": {"cam1": still}}}) is None
    assert clock_lines({"clocks": {"cameras": {"cam1": still}}}) == []


def test_a_clock_is_given_in_milliseconds_with_the_methods_that_estimated_it():
    by = {
        "motion": {"offset_s": 0.0123, "offset_s_sd": 0.0002, "used": True},
        "sound": {"offset_s": 0.02, "offset_s_sd": 0.007, "used": False},
    }
    own = {"offset_s": 0.0123, "offset_s_sd": 0.0002, "offset_s_95": [0.0119, 0.0127], "source": "motion"}
    own |= {"rate_ppm": -50.0, "rate_ppm_sd": 2.0, "witnesses": by}
    locate = {"clocks": {"cameras": {"cam2": own}}}
    assert clock_table(locate).rows == [["cam2", "12.30", "0.20", "-50.0", "2.0", "motion"]]
    (line,) = clock_lines(locate)
    assert line == (
        "12.3 ms are added to the time of cam2 (95 %: 11.90 to 12.70), estimated from the motion; "
        "it runs 50 ± 2 ppm fast. Each alone, with one standard error: motion 12.3 ± 0.2 ms, sound 20 ± 7 ms."
    )
    by["sound"]["used"], own["rate_ppm"] = True, 3.0
    (line,) = clock_lines(locate)
    assert "estimated from the motion and the sound" in line
    assert "ppm" not in line


def test_tracks_errors_and_doubts_of_a_match():
    target = {"tracks": {"cam1": ["a"], "cam2": []}, "error_px": 0.5, "error": 0.1, "ambiguous": True}
    locate = {"correspondence": {"targets": {"t1": target}, "tolerance_px": 3.0, "tolerance": 0.6}}
    table = correspondence_table(locate, "in")
    assert table.rows == [["t1", "a", "–", "0.5", "0.1", "ambiguous"]]
    assert "3 px (0.6 in)" in table.caption
    assert correspondence_table({}, "in") is None


def test_the_comparison_is_told_before_and_after_and_against_the_truth():
    keys = ("gain", "bias", "rms", "max_abs", "correlation", "n")
    before, after = dict.fromkeys(keys, 0.5), dict.fromkeys(keys, 0.25)
    rows = comparison_table({"lag_s": 0.2, "before": before, "after": after}, "in").rows
    assert [row[1:] for row in rows] == [["0.5", "0.25"]] * 6
    assert comparison_table({"lag_s": None}, "in") is None
    by_axis = {key: {"x": k, "y": 2 * k, "z": 3 * k} for k, key in enumerate(("bias", "mean_abs", "rms_by_axis"), 1)}
    table = truth_table({"truth": {"n": 9, "mean": 0.00732, "one_over": 21900.0, **by_axis}}, "in")
    assert table.rows[2] == ["z", "3", "6", "9", "–"]
    assert table.caption == "Video minus truth.csv, in; mean error in space 0.00732 in, 1/21,900 of the diagonal field"
    assert truth_table({"truth": {"n": 0}}, "in") is None


def test_run_up_statistics_are_those_of_the_record():
    own = {
        "located": 3,
        "frames": 4,
        "lowest_z": 1.0,
        "highest_z": 5.0,
        "setup": 3.0,
        "S": 1.5,
        "Sinc": 1.2,
        "Sig": None,
    }
    table = run_up_table({"transects": {"a": {**own, "R2": 4.5, "Rmax": 5.0, "Tz": 8.0, "run_ups": 7}}}, "m")
    assert table.rows == [["a", "4", "75 %", "3", "1.5", "1.2", "–", "4.5", "5", "1", "5", "8", "7"]]
    assert table.header[3:9] == ["set-up", "S", "Sinc", "Sig", "R2 %", "Rmax"]
    assert run_up_table({}, "m") is None


def test_a_body_is_a_line_with_the_share_of_each_flag():
    own = {"samples": 90, "located": 81, "mean_rms": 0.00512, "flags": {"missing": 0.1}}
    assert bodies_table({"bodies": {"float": own}}, "in").rows == [["float", "90", "90 %", "0.0051", "missing 10 %"]]
    assert bodies_table({}, "in") is None


def test_the_smoothings_record_is_a_line_for_each_target_and_axis():
    own = {"target": "t1", "axis": "x", "noise_sd": 0.0025, "noise_ratio": 0.333, "spacing_s": 0.094}
    assert smoothing_table({"smoothing": [own]}, "in").rows == [["t1, x", "0.0025", "0.33", "0.094"]]
    assert smoothing_table({}, "in") is None
