"""A run of two cameras as the thesis's files, read back as the old programs and vidtrack's readers have them."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.exchange.thesis.rig import cameras, points, projected_by_back
from vidtrack.arranging.old_files import old_folder
from vidtrack.errors import VidtrackError
from vidtrack.exchange.measured import Run
from vidtrack.exchange.thesis.back import read_calced, read_fblocate, read_iti, read_list
from vidtrack.exchange.thesis.camparm import read_camparm
from vidtrack.exchange.thesis.location import read_location
from vidtrack.exchange.thesis.outcam import camera_of, read_outcam
from vidtrack.exchange.thesis.points import read_sighted, read_targets, read_world
from vidtrack.exchange.thesis.results import FILES, write
from vidtrack.exchange.thesis.tracks import read_taped
from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points

FRAMES, LATE = 50, 3
"""Frames of cam1; cam2 began this many later."""
START = 36059.9
"""10:00:59;27 of drop-frame tape: the record goes over a minute, at which its labels leave out two."""
NAMES = ("bow", "mast é")


def path_of(k, n=FRAMES):
    t = np.arange(n) / 30
    return np.stack([30 + 20 * np.sin(3 * t + k), 20 + 8 * np.cos(4 * t), 10 + 5 * np.sin(5 * t) + k], -1)


def labels(n):
    """Drop-frame labels from 10:00:59;27 on."""
    own = [f"10:00:59;{f:02d}" for f in range(27, 30)] + [f"10:01:00;{f:02d}" for f in range(2, 30)]
    return (own + [f"10:01:01;{f:02d}" for f in range(30)])[:n]


def run(own=None, names=NAMES, tags=None, step=1001 / 30000, **changes):
    """Every target is seen in every frame, but for the second one, which cam1 loses in frames 10 to 14."""
    own = own or cameras()
    at = START + np.arange(FRAMES) * step
    rows, joined, tracklets, centroids, seen = [], [], {}, {}, {}
    for k, name in enumerate(names):
        p = path_of(k)
        located = np.ones(FRAMES, bool)
        located[:LATE] = False
        located[10:15] &= k == 0
        table = pd.DataFrame({"time_s": at, "timecode": labels(FRAMES), "target": name, "miss": 0.0, "flag": ""})
        table[["x", "y", "z"]] = p
        rows.append(table[located])
    for c, camera in enumerate(own):
        keep = np.arange(FRAMES) >= LATE * c
        number = np.arange(FRAMES)[keep] - LATE * c
        pieces = []
        for k, name in enumerate(names):
            b = project(camera, path_of(k))[keep]
            piece = pd.DataFrame({"frame": number, "time_s": at[keep], "Xf": b[:, 0], "Yf": b[:, 1], "tracklet": k})
            if k == 1 and c == 0:
                piece = piece.drop(index=range(10, 15))
            pieces.append(piece)
            one = {"camera": camera.name, "tracklet": k, "track": name, "target": name, "start_s": 0.0, "end_s": 1e6}
            joined.append(one)
        tracklets[camera.name] = pd.concat(pieces, ignore_index=True)
        centroids[camera.name] = pd.DataFrame({"frame": number, "time_s": at[keep], "target": names[0]})
        p = points()
        b = project(camera, p) + 0.02 * np.random.default_rng(c).normal(size=(len(p), 2))
        table = pd.DataFrame({"tag": tags or [str(n) for n in range(1, len(p) + 1)], "used": True, "pixels": 40})
        table[["x", "y", "z"]], table[["Xf", "Yf"]] = p, b
        seen[camera.name] = table
    tables = {"trajectories": pd.concat(rows, ignore_index=True), "associations": pd.DataFrame(joined)}
    by_name = {camera.name: camera for camera in own}
    given = {"centroids": centroids, "cameras": by_name, "tracklets": tracklets, "points": seen}
    return Run("pluck", "in", tables, **(given | changes))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("old")
    for name, content in write(run()).files.items():
        (place / name).write_bytes(content)
    return place


def test_every_file_is_written_and_the_same_numbers_make_the_same_bytes(folder):
    assert sorted(path.name for path in folder.iterdir()) == sorted(FILES)
    again = write(run()).files
    assert all(again[path.name] == path.read_bytes() for path in folder.iterdir())


def test_the_calibration_projects_as_back_does_with_its_files(folder):
    camparm = read_camparm(folder / "camparm.dat")
    for k, camera in enumerate(cameras(), 1):
        out, fixed = read_outcam(folder / f"outcam{k}.prn"), camparm.cameras[k - 1]
        theirs = projected_by_back(out.R, out.T, out.Sx, out.f, out.kappa1, fixed, points())
        np.testing.assert_allclose(theirs, project(camera, points()), atol=5e-3)
        assert camparm.field[k - 1] == pytest.approx(100, rel=0.25)


def test_a_lens_with_other_terms_comes_as_near_as_one_term_can_and_says_how_near(folder):
    own = [camera.with_(p1=2e-6, kappa2=1e-7) for camera in cameras()]
    made = write(run(own))
    said = [float(note.split("within ")[1].split(" px")[0]) for note in made.notes if "lens of outcam" in note]
    assert len(said) == 2
    assert 1e-4 < max(said) < 0.5


def test_points_survey_and_tags_come_back_to_the_last_digit(folder):
    for read, name in ((read_targets, "balls.dat"), (read_targets, "targets.dat"), (read_world, "world.prn")):
        survey = read(folder / name)
        assert survey.tags == tuple(str(n) for n in range(1, 25))
        np.testing.assert_array_equal(survey.p, points())
    for k, camera in enumerate(cameras(), 1):
        seen = read_sighted(folder / f"cam{k}.prn")
        np.testing.assert_allclose(seen.b, run().points[camera.name][["Xf", "Yf"]], atol=5.001e-3)
        np.testing.assert_allclose(seen.p, points(), atol=5.001e-3)
        assert (seen.pixels == 40).all()


def test_tags_that_are_words_are_numbered_and_said():
    made = write(run(tags=[f"A{n}" for n in range(24)]))
    assert any(note.startswith("points are numbered: 0 is A0, 1 is A1") for note in made.notes)
    assert b"\n3 1 " in made.files["balls.dat"]


def test_tracks_come_back_row_by_row_also_over_a_minute_of_drop_frame_tape(folder):
    for k, camera in enumerate(cameras()):
        taped = read_taped(folder / f"cam{k + 1}vid.prn")
        assert taped.code[0] == ("10:00:59:27", "10:01:00:00")[k]  # counted on: no label is left out
        assert np.diff(taped.frame).tolist() == [1] * (FRAMES - 1 - LATE * k)
        for target, name in enumerate(NAMES):
            b = project(camera, path_of(target))[LATE * k :]
            if k == 0 and target == 1:
                assert np.isnan(taped.b[10:15, 1]).all(), name
                b[10:15] = np.nan
            np.testing.assert_allclose(taped.b[:, target], b, atol=5.001e-3)


def test_location_has_the_target_with_the_most_positions(folder):
    found = read_location(folder / "location.prn")
    assert found.first == found.second
    assert found.first[0] == "10:01:00:00"
    np.testing.assert_allclose(found.p, path_of(0)[LATE:], atol=5.001e-3)
    assert any("location.prn has bow alone" in note for note in write(run()).notes)


def test_what_was_written_is_located_again_where_it_was(folder):
    camparm = read_camparm(folder / "camparm.dat")
    own = [camera_of(read_outcam(folder / f"outcam{k}.prn"), camparm.cameras[k - 1]) for k in (1, 2)]
    b = [read_taped(folder / f"cam{k}vid.prn").b[:, 0] for k in (1, 2)]
    located = locate_points(own, np.stack([b[0][LATE:], b[1]]), sd=0.01).point
    np.testing.assert_allclose(located, path_of(0)[LATE:], atol=0.01)


def test_back_is_summed_up_as_it_was(folder):
    listed, calced = read_list(folder / "list.prn"), read_calced(folder / "calced.prn")
    error = listed.located - listed.surveyed
    np.testing.assert_allclose(listed.surveyed, points(), atol=5.001e-3)
    np.testing.assert_allclose(calced.mean, np.abs(error).mean(0), atol=6e-3)
    assert calced.points == 24
    assert calced.mean_all == pytest.approx(np.abs(error).mean(), abs=6e-3)
    screen = read_fblocate(folder / "fblocate.prn")
    for k, camera in enumerate(cameras()):
        np.testing.assert_allclose(screen[:, k], project(camera, listed.located), atol=0.08)
        alone = read_iti(folder / f"vid{k + 1}iti.prn")
        np.testing.assert_allclose(alone[:, 0], project(camera, points()), atol=0.0501)
        np.testing.assert_allclose(alone[:, 1], project(camera.without_lens(), points()), atol=0.0501)


def test_an_experiment_is_made_of_the_folder(folder):
    old = old_folder(str(folder), "in", run="pluck")
    assert [tag for tag, *_ in old.points] == [str(n) for n in range(1, 25)]
    assert len(old.copies) == 4


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"step": 1 / 120}, "no NTSC time code"),
        ({"own": [*cameras(), cameras()[0].with_(name="cam3")]}, "3 cameras, and the thesis's programs have two"),
        ({"own": [camera.with_(projection="equidistant") for camera in cameras()]}, "its lens is wide"),
    ],
)
def test_what_the_files_cannot_hold_is_refused_in_one_line(changes, what):
    with pytest.raises(VidtrackError, match=what) as error:
        write(run(**changes))
    assert "\n" not in str(error.value)


def test_a_calibration_without_points_is_refused():
    whole = run()
    nothing = {name: table.iloc[:0] for name, table in whole.points.items()}
    with pytest.raises(VidtrackError, match="camera cam1 has no calibration points"):
        write(run(points=nothing))


NAMED = (
    "camparm.dat targets.dat balls.dat calocate.prn cam.dat world.dat calibrat.prn cam1.prn cam2.prn world.prn "
    "outcam1.prn calced.prn list.prn fblocate.prn leftiti.prn rightiti.prn vid1iti.prn cam1vid.prn location.prn"
)


def test_the_documentation_names_a_test_that_writes_and_reads_each_file():
    page = (Path(__file__).parents[3] / "docs/old-files.md").read_text()
    rows = [line.split("|")[1:-1] for line in page.split("## The files")[1].splitlines() if line.startswith("| `")]
    tests = {name: row[-1] for row in rows for name in re.findall(r"`([\w.]+)`", row[0])}
    assert set(NAMED.split()) | set(FILES) <= set(tests)
    for cell in set(tests.values()):
        file, test = re.search(r"`(\w+\.py)::(\w+)`", cell).groups()
        text = (Path(__file__).parent / file).read_text().split(f"def {test}(")[1].split("\ndef ")[0]
        assert "write_" in text
        assert "read_" in text
