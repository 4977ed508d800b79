"""The track stage on drawn recordings, and on a real ball."""

import inspect
from fractions import Fraction
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.discs import picture
from vidtrack.errors import VidtrackError
from vidtrack.settings.detection import Detect
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.timing.timebase import time_base
from vidtrack.timing.timecode import parse
from vidtrack.tracking.initiation.clip import Clip
from vidtrack.video.reader import open_video

RATE = Fraction(30000, 1001)
REAL = Path(__file__).parents[2] / "../shared/real/ball-toss"
COLUMNS = ["frame", "field", "time_s", "timecode", "target", "Xf", "Yf", "pixels", "total_pixels"]
COLUMNS += ["box_x", "box_y", "box_w", "box_h", "flag"]


def path(n=1):
    """Targets on circles of 50 px about (150, 100), 90 frames a turn; t in frames gives (n, 2) px."""

    def at(t):
        angle = 2 * np.pi * (t / 90 + np.arange(n) / n)
        return np.stack([150 + 50 * np.cos(angle), 100 + 50 * np.sin(angle)], axis=-1)

    return at


def recorded(at, k=60, *, shape=(200, 300), interlaced=None, dtype=np.uint8, still=(), corrupt=(), speed=1.0):
    """Frames and info of k pictures of balls of radius 5 px; interlaced: the field that comes first."""
    rng = np.random.default_rng(0)

    def drawn(t):
        balls = [*((*p, 5.0) for p in at(speed * t) if np.isfinite(p).all()), *still]
        return picture(shape, balls, noise=2.0, rng=rng, dtype=dtype)

    frames = []
    for i in range(k):
        luma = drawn(i)
        if interlaced:
            luma[1 if interlaced == "top" else 0 :: 2] = drawn(i + 0.5)[1 if interlaced == "top" else 0 :: 2]
        frames.append(Frame(i, i / RATE, luma, i in corrupt, None))
    info = VideoInfo(
        shape[1],
        shape[0],
        RATE,
        bits=8 if dtype is np.uint8 else 10,
        field_order=interlaced or "progressive",
        time=time_base(RATE, parse("10:00:00:00", RATE), source="test"),
    )
    return frames, info


def tracked(frames, info, **settings):
    got = track(frames, info, **settings)
    return got.centroids, got.diagnostics


def boxes(*rows):
    return pd.DataFrame(rows, columns=["target", "Xf", "Yf"])


def test_the_table_is_what_the_contract_says():
    at = path(2)
    frames, info = recorded(at, 20)
    table, diagnostics = tracked(frames, info, targets=2)
    assert set(COLUMNS) <= set(table.columns)
    assert len(table) == 40
    assert table["target"].tolist() == ["t1", "t2"] * 20
    assert table["frame"].tolist() == np.repeat(range(20), 2).tolist()
    assert (table["field"] == "frame").all()
    assert table["timecode"].iloc[[0, -1]].tolist() == ["10:00:00:00", "10:00:00:19"]
    assert table["time_s"].iloc[[0, -1]].tolist() == pytest.approx([36000.0, 36000.0 + 19 / float(RATE)], abs=1e-9)
    assert (table["flag"] == "").all()
    assert (table[["box_w", "box_h"]] == 50).all().all()
    assert diagnostics["measured"] == 1
    assert diagnostics["begun"] == "2 from motion, 0 from brightness"


def test_targets_found_without_a_start_are_where_they_are():
    at = path(3)
    frames, info = recorded(at)
    table = track(frames, info, targets=["a", "b", "c"]).centroids
    truth = np.array([at(k) for k in range(60)])
    order = np.lexsort((truth[0, :, 0], truth[0, :, 1]))
    error = table[["Xf", "Yf"]].to_numpy().reshape(60, 3, 2) - truth[:, order]
    assert 0.003 < np.sqrt((error**2).mean()) < 0.010


def test_start_boxes_name_the_targets():
    at = path(2)
    frames, info = recorded(at, 10)
    (x1, y1), (x2, y2) = at(0).round()
    table = track(frames, info, start_boxes=boxes(["left", x2, y2], ["right", x1, y1])).centroids
    first = table[table["frame"] == 0].set_index("target")
    assert first.loc["left", "Xf"] < first.loc["right", "Xf"]


@pytest.mark.parametrize("order", ["top", "bottom"])
@pytest.mark.parametrize("fields", ["auto", "set"])
def test_fields_are_two_samples_in_the_order_of_time(order, fields):
    """10 px a frame: the woven frame would be off by 2.5 px."""
    at = path(1)
    frames, info = recorded(at, 40, interlaced=order, speed=2.9)
    if fields == "auto":
        info = VideoInfo(**{**vars(info), "field_order": "bottom" if order == "top" else "top"})  # a lie
    table, diagnostics = tracked(frames, info, targets=1, fields="auto" if fields == "auto" else order)
    assert len(table) == 80
    assert table["field"].iloc[0] == order
    assert np.diff(table["time_s"]) == pytest.approx(0.5 / float(RATE), abs=1e-9)
    truth = np.array([at(2.9 * t)[0] for t in np.arange(80) / 2])
    error = (table[["Xf", "Yf"]].to_numpy() - truth)[~table["Xf"].isna()]
    assert len(error) >= 78
    x, y = np.sqrt((error**2).mean(axis=0))
    assert 0.003 < x < 0.012
    assert 0.02 < y < 0.1  # half of the lines: the top and bottom of the ball fall between them
    if fields == "auto":
        assert "the motion is used" in diagnostics["fields"]


def test_a_wrong_order_of_fields_is_called_out():
    frames, info = recorded(path(1), 60, interlaced="top")
    problems = track(frames, info, fields="bottom").diagnostics["problems"]
    assert any("Set detect.fields to top" in line for line in problems)


def test_ten_bit_dark_targets_are_found():
    frames, info = recorded(path(2), 20, dtype=np.uint16)
    turned = [frame._replace(luma=1023 - frame.luma) for frame in frames]
    a = track(frames, info, targets=2, threshold=120).centroids
    b = track(turned, info, targets=2, threshold=135, polarity="dark").centroids
    assert not a["Xf"].isna().any()
    for column in ("Xf", "Yf", "pixels", "total_pixels"):
        assert a[column].to_numpy() == pytest.approx(b[column].to_numpy(), abs=2e-3)


@pytest.mark.parametrize(("start", "end"), [(10, 19), ("10:00:00:10", "10:00:00:19")])
def test_start_and_end_are_frames_or_time_codes(start, end):
    frames, info = recorded(path(1), 40)
    table = track(frames, info, start=start, end=end).centroids
    assert table["frame"].tolist() == list(range(10, 20))
    assert table["timecode"].iloc[0] == "10:00:00:10"


def test_what_cannot_be_done_is_said_in_one_line():
    frames, info = recorded(path(1), 5)
    with pytest.raises(VidtrackError, match=r"detect\.start: no frame of the recording lies"):
        track(frames, info, start=100)
    with pytest.raises(VidtrackError, match=r"detect\.end: '10:61:00:00'|detect\.end: .*does not exist"):
        track(frames, info, end="10:61:00:00")
    with pytest.raises(VidtrackError, match="the recording carries none"):
        track(frames, VideoInfo(300, 200, RATE), start="10:00:00:00")
    with pytest.raises(VidtrackError, match=r"targets.csv: no start box for target 'b' in a camera that has a\."):
        track(frames, info, targets=["a", "b"], start_boxes=boxes(["a", 200, 100]))


def test_a_target_that_comes_later_is_found_when_it_comes():
    def at(t):
        return np.array([[20 + 3 * (t - 70), 100.0]]) if t > 70 else np.full((1, 2), np.nan)

    frames, info = recorded(at, 150)
    table, diagnostics = tracked(frames, info, targets=["ball", "other"])
    ball = table[table["target"] == "ball"]
    assert diagnostics["begun"] == "0 from motion, 0 from brightness"
    assert ball.loc[ball["frame"] < 70, "Xf"].isna().all()
    assert ball.loc[ball["frame"] > 95, "Xf"].notna().all()
    truth = np.array([at(k)[0, 0] for k in ball["frame"]])
    assert np.nanmax(np.abs(ball["Xf"] - truth)) < 0.1
    assert [line.split(":")[0] for line in diagnostics["problems"]] == ["never found", "ball"]
    assert "other: 1 of 2 targets are to be seen" in diagnostics["problems"][0]
    assert "ball: seen in samples 7" in diagnostics["problems"][1]


def test_the_same_recording_gives_the_same_table():
    frames, info = recorded(path(4), 30)
    first, second = (track(frames, info, targets=4).centroids for _ in range(2))
    pd.testing.assert_frame_equal(first, second)


def test_diagnostics_tell_what_was_lost_and_show_it():
    def at(t):
        return path(1)(t) if not 20 <= t < 25 else np.full((1, 2), np.nan)

    frames, info = recorded(at, 40, corrupt=(33,))
    table, diagnostics = tracked(frames, info)
    told = diagnostics["targets"]["t1"]
    assert told["measured"] == pytest.approx(34 / 40, abs=0.03)
    assert told["flags"]["lost"] == pytest.approx(5 / 40, abs=0.03)
    assert told["flags"]["corrupt"] == pytest.approx(1 / 40)
    assert told["pixels"]["mean"] == pytest.approx(78, abs=5)
    assert {worst["flag"] for worst in diagnostics["worst"]} >= {"lost;predicted", "recovered"}
    assert diagnostics["worst"][0]["picture"].shape == (50, 50)
    assert table.loc[table["Xf"].isna(), "flag"].ne("").all()


def test_a_still_is_a_recording_of_one_frame():
    frames, _ = recorded(path(3), 1)
    table = track(frames, VideoInfo(300, 200, RATE, is_still=True), targets=3).centroids
    assert len(table) == 3
    assert not table["Xf"].isna().any()


@pytest.mark.skipif(not REAL.exists(), reason="the real recording is not here")
def test_a_real_ball_is_found_by_its_motion_and_followed_within_a_pixel():
    """In frames 0 and 1 it is hidden in the hand: nothing is reported."""
    with open_video(str(REAL / "runs/toss/cam1.mp4")) as video:
        table, diagnostics = tracked(video.frames(), video.info, targets=["ball"])
    hand = pd.read_csv(REAL / "hand_tracked.csv").merge(table, on="frame", suffixes=("_hand", ""))
    assert len(hand) == 11
    off = np.hypot(hand["Xf"] - hand["Xf_hand"], hand["Yf"] - hand["Yf_hand"])
    assert off.max() < 1
    assert off.max() > 0.2  # clicks by hand are no better
    assert table.loc[table["frame"] < 2, "Xf"].isna().all()
    assert (table.loc[table["frame"] >= 2, "flag"] == "").all()
    assert diagnostics["begun"] == "1 from motion, 0 from brightness"


def stored(full, contrast, noise, *, level, dark, bits, k=25):
    """A recording whose levels (stored) end at `full`: one ball of radius 5 px on a curve; and where it is."""
    at = np.stack([60 + 2.3 * np.arange(k), 60 + 30 * np.sin(np.arange(k) / 7)], axis=1)
    rng = np.random.default_rng(3)
    frames = []
    for i, place in enumerate(at):
        ball = [(*place, 5.0, -contrast if dark else contrast)]
        drawn = picture((120, 180), ball, level=level, noise=noise, rng=rng, dtype=float)
        luma = np.clip(np.rint(drawn), 0, full).astype(np.uint8 if bits == 8 else np.uint16)
        frames.append(Frame(i, i / RATE, luma, False, None))
    return frames, VideoInfo(180, 120, RATE, bits=bits, field_order="progressive"), at


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("kind", ["weighted", "binary", "ellipse"])
@pytest.mark.parametrize(
    ("full", "contrast", "noise", "bits"), [(1023, 480, 8, 16), (4095, 1920, 32, 16), (65535, 1500, 25, 16)]
)
def test_few_levels_of_many_measure_as_well_as_all_of_them(full, contrast, noise, bits, kind, dark):
    level = (20_000 if full == 65535 else 0.1 * full) + (contrast if dark else 0)
    frames, info, at = stored(full, contrast, noise, level=level, dark=dark, bits=bits)
    wide, whole, _ = stored(255, 120, 2, level=145 if dark else 25, dark=dark, bits=8)
    wishes = {"polarity": "dark" if dark else "bright", "centroid": kind}
    table, told = tracked(frames, info, **wishes)
    usual, _ = tracked(wide, whole, **wishes)
    off, expected = (np.sqrt(np.mean((t[["Xf", "Yf"]].to_numpy() - at) ** 2)) for t in (table, usual))
    assert told["stretch"]["gain"] > 10
    assert (table["flag"] == "").all()
    assert off < 1.15 * expected + 0.001


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize(("kind", "most"), [("weighted", 0.09), ("binary", 0.12), ("ellipse", 0.06)])
def test_a_contrast_of_six_grey_levels_is_enough(kind, most, dark):
    frames, info, at = stored(255, 6, 0.5, level=100, dark=dark, bits=8)
    table, _ = tracked(frames, info, polarity="dark" if dark else "bright", centroid=kind)
    off = table[["Xf", "Yf"]].to_numpy() - at
    assert (table["flag"] == "").all()
    assert 0.02 < np.sqrt(np.mean(off**2)) < most


def test_gain_and_offset_may_be_given_and_thresholds_are_on_their_scale():
    frames, info, at = stored(255, 6, 0.5, level=100, dark=False, bits=8)
    as_stored, _ = tracked(frames, info, gain=1, offset=0)
    assert as_stored["Xf"].isna().all()
    table, told = tracked(frames, info, gain=20, offset=96, threshold=140)
    assert told["stretch"] == {"gain": 20, "offset": 96}
    assert told["threshold"] == 140
    assert np.abs(table[["Xf", "Yf"]].to_numpy() - at).max() < 0.4
    assert table["background"].mean() == pytest.approx(80, abs=3)


def test_a_faint_target_that_comes_late_is_stretched_when_it_comes():
    frames, info, at = stored(4095, 1000, 16, level=300, dark=False, bits=16)
    empty, _, _ = stored(4095, 0, 16, level=300, dark=False, bits=16, k=15)
    later = [f._replace(index=15 + i, time=(15 + i) / RATE) for i, f in enumerate(frames)]
    table, told = tracked(empty + later, info)
    assert told["stretch"]["gain"] > 10
    assert np.abs(table[["Xf", "Yf"]].to_numpy()[18:] - at[3:]).max() < 0.1


def test_twelve_bits_in_sixteen_are_saturated_where_the_sensor_ends():
    frames, info, _ = stored(4095, 6000, 32, level=480, dark=False, bits=16)
    assert (track(frames, info).centroids["flag"] == "saturated").all()


@pytest.mark.parametrize(("kind", "low", "high"), [("weighted", 0.6, 1.9), ("ellipse", 0.25, 1.9)])
@pytest.mark.parametrize("over", [2.0, 5.0])
def test_the_sd_of_saturated_targets_tells_their_clipped_rims_also_at_rest(kind, low, high, over):
    at = np.array([(30 + 38.37 * i, 30 + 41.61 * j) for j in range(4) for i in range(6)])
    frames, info = recorded(lambda t: np.zeros((0, 2)), 6, still=[(*p, 5.0, 225 * over) for p in at])
    table, _ = tracked(frames, info, targets=24, centroid=kind)
    assert (table["flag"] == "saturated").all()
    found = table.groupby("target")[["Xf", "Yf", "sd_x", "sd_y"]].mean().to_numpy()
    nearest = np.linalg.norm(found[:, None, :2] - at, axis=-1).argmin(1)
    ratio = np.sqrt(np.mean((found[:, :2] - at[nearest]) ** 2) / np.mean(found[:, 2:] ** 2))
    assert low < ratio < high


def shaded(left, speed, k=50):
    """A ball in whose light an edge, `speed` px a frame, leaves a share; and where the ball is."""
    rng, at = np.random.default_rng(0), np.stack([60 + 2.3 * np.arange(k), np.full(k, 60.3)], axis=1)
    frames = []
    for i, place in enumerate(at):
        lit = np.where(np.arange(220) < speed * i, left, 1.0) * picture((120, 220), [(*place, 6.0, 170)], dtype=float)
        luma = np.clip(np.rint(lit + rng.normal(0, 2, lit.shape)), 0, 255).astype(np.uint8)
        frames.append(Frame(i, i / RATE, luma, False, None))
    return frames, VideoInfo(220, 120, RATE, field_order="progressive"), at


def test_while_a_shadow_s_edge_goes_over_a_target_its_sd_tells_so_and_only_then():
    frames, info, at = shaded(0.6, 5)
    table, _ = tracked(frames, info)
    off = np.abs(table["Xf"].to_numpy() - at[:, 0])
    edge = np.abs(5 * np.arange(50) - at[:, 0]) < 6
    assert 0.3 < off[edge].max() < 2.5 * table["sd_x"][edge].max(), "it is pulled, and told"
    assert (off < 4 * table["sd_x"]).all()
    far = np.abs(5 * np.arange(50) - at[:, 0]) > 20
    assert table["sd_x"][far].max() < 0.04


def test_a_target_that_loses_more_than_half_of_its_light_is_found_by_its_own_level():
    frames, info, at = shaded(0.42, 8)
    table, _ = tracked(frames, info)
    assert table["Xf"].notna().mean() > 0.97
    far = np.abs(8 * np.arange(50) - at[:, 0]) > 20
    assert np.nanmax(np.abs(table["Xf"].to_numpy() - at[:, 0])[far]) < 0.1


def test_defaults_are_those_of_the_config():
    said = inspect.signature(track).parameters
    config = Detect()
    for name in set(type(config).model_fields) - {"colour", "sd"}:  # the reader's, and of tracks that are imported
        assert said[name].default == getattr(config, name), name


def faint_and_fast(distance):
    """One ball that goes `distance` px a frame along a row, and a brighter one that stays."""

    def at(t):
        return np.array([[40 + distance * t, 60.0]])

    return recorded(at, 12, still=[(240.0, 160.0, 7.0)])


@pytest.mark.parametrize(("max_step", "row"), [(0.15, 60), (0.02, 160)])
def test_a_target_that_moves_further_than_max_step_is_not_found_by_its_motion(max_step, row):
    frames, info = faint_and_fast(15.0)  # 15 px of a diagonal of 361 px: 0.042
    table, _ = tracked(frames, info, max_step=max_step)
    assert table.Yf.iloc[0] == pytest.approx(row, abs=0.5)


@pytest.mark.parametrize(("min_motion", "row"), [(1.5, 60), (100.0, 160)])
def test_what_moves_less_than_min_motion_is_found_by_its_brightness(min_motion, row):
    frames, info = faint_and_fast(2.0)
    table, _ = tracked(frames, info, min_motion=min_motion)
    assert table.Yf.iloc[0] == pytest.approx(row, abs=0.5)


def test_each_limit_of_the_config_reaches_the_detection(monkeypatch):
    opened = []

    class Spy(Clip):
        def __init__(self, *given):
            super().__init__(*given)
            opened.append(self.detection)

    monkeypatch.setattr("vidtrack.stages.track.Clip", Spy)
    limits = {"max_step": 0.3, "min_motion": 7.0, "max_clutter": 0.5, "max_occlusion": 90}
    tracked(*recorded(path(), 4), **limits)
    assert {name: getattr(opened[0], name) for name in limits} == limits
