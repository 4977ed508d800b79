"""Tables of coded tags are those of a tracked recording, and what is wrong with a tag is found."""

from fractions import Fraction

import cv2
import numpy as np
import pytest

from tests.discs import disc
from vidtrack.association.tracklets import COLUMNS
from vidtrack.geometry.camera import Camera
from vidtrack.simulate.board_picture import board_picture, drawing
from vidtrack.stages.coded_tags import apart_from_tags, behind_targets, coded_tags
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.timing.timebase import time_base
from vidtrack.tracking.tag_reading.tag_reader import TagReader, TagsSeen

CLOCK = time_base(Fraction(30))


def seen(flag, ids=(7,), side=60.0):
    """Tags with flags (k, n), all of whose corners stand still."""
    flag = np.array(flag, np.intp)
    k, n = flag.shape
    b = np.where((flag == 0)[..., None, None], [[10.0, 10], [70, 10], [70, 70], [10, 70]], np.nan)
    return TagsSeen(
        np.array(ids),
        np.arange(k),
        np.full(k, "frame", object),
        np.arange(k) / 30,
        np.zeros(k),
        b,
        np.where(np.isfinite(b), 0.02, np.nan),
        flag,
        np.where(flag != 1, side, np.nan),
        np.full((k, n), 0.6),
        np.full((k, n), 180.0),
    )


def tables(flag, named=(7,), **how):
    return coded_tags(seen(flag, **how), CLOCK, modules=8, named=named, where="camera cam1")


def codes(done):
    return [finding.code for finding in done.findings]


def test_each_corner_is_a_target_that_names_itself():
    done = tables([[0]] * 5)
    assert done.centroids["target"].unique().tolist() == ["tag7_1", "tag7_2", "tag7_3", "tag7_4"]
    assert len(done.centroids) == 20
    assert done.centroids.groupby("target")["time_s"].apply(list).iloc[0] == pytest.approx([k / 30 for k in range(5)])
    assert list(done.tracklets) == list(COLUMNS)
    assert done.tracklets["bound"].all()
    assert done.record["tags"]["tag7"]["side_px"] == 60
    assert codes(done) == []


def test_a_tag_that_is_not_seen_is_nan_with_a_flag():
    done = tables([[0], [1], [2], [3], [0]])
    one = done.centroids[done.centroids["target"] == "tag7_3"]
    assert one["flag"].tolist() == ["", "lost", "twice", "blurred", ""]
    assert one["Xf"].isna().tolist() == [False, True, True, True, False]


def test_a_number_that_is_seen_once_and_named_nowhere_is_a_false_reading():
    done = tables([[0, 1], [0, 0], [0, 1], [0, 1]], ids=(7, 300))
    assert "tag300_1" not in set(done.centroids["target"])
    assert done.record["false_tags"] == [300]
    assert "tag300_1" in set(tables([[0, 1], [0, 0]], ids=(7, 300), named=(7, 300)).centroids["target"])


@pytest.mark.parametrize(
    ("flag", "how", "code"),
    [
        ([[1]] * 4, {}, "tag-unseen"),
        ([[0]] * 9 + [[2]], {}, "tag-twice"),
        ([[0]] * 9 + [[3]], {}, "tag-blurred"),
        ([[0]] * 4, {"side": 20.0}, "tag-small"),
    ],
)
def test_what_is_wrong_with_a_tag_is_found(flag, how, code):
    assert codes(tables(flag, **how)) == [code]


def test_corners_come_behind_the_targets_in_the_frames_in_which_targets_were_followed():
    own, ball = tables([[0]] * 6), tables([[0]] * 4, ids=(3,), named=(3,))
    diagnostics = {"targets": {"ball": {}}, "measured": 0.5}
    centroids, tracklets, both = behind_targets(own, ball.centroids, ball.tracklets, diagnostics, followed=True)
    assert centroids["frame"].max() == 3
    assert centroids["target"].unique().tolist() == [f"tag{n}_{corner}" for n in (3, 7) for corner in range(1, 5)]
    assert tracklets["tracklet"].is_monotonic_increasing
    assert both["measured"] == 0.5
    assert list(both["targets"]) == ["ball", *(f"tag7_{corner}" for corner in range(1, 5))]


def test_where_no_target_is_followed_the_tags_are_all_that_was_measured():
    own, none = tables([[0], [1]]), tables(np.empty((0, 0)), ids=(), named=())
    centroids, _, both = behind_targets(own, none.centroids, none.tracklets, {"targets": {}}, followed=False)
    assert len(centroids) == 8
    assert both["measured"] == 0.5
    assert both["tags"] == own.record["tags"]


SIZE = (320, 200)
FLAT = Camera(159.5, 99.5, 1, 1, 1.0, 500.0, 0.0, np.eye(3), np.zeros(3), SIZE)


def beside(path, *, polarity="bright", k=16):
    """A ball on a path (k, 2) px beside a tag that sways in the left half of the picture: centroids, tags, findings."""
    rng = np.random.default_rng(2)
    level = 30.0 if polarity == "bright" else 200.0
    R = cv2.Rodrigues(np.array([0.2, 0.3, 0.1]))[0] @ np.diag([1.0, -1.0, -1.0])
    T = np.array([-65, 0, 500.0]) - R @ [24, 24, 0]
    sheet = board_picture(FLAT, R, T, drawing("apriltag", 1, 1, first=7), 48.0, background=level, bright=235.0)
    frames = []
    for i in range(k):
        turn = cv2.getRotationMatrix2D((95, 100), 8 * np.sin(i / 3), 1.0) + np.float32([[0, 0, i / 2], [0, 0, i / 3]])
        picture = cv2.warpAffine(sheet, turn, SIZE, borderMode=cv2.BORDER_REPLICATE)
        (x, y), ball = path[i].astype(int), np.zeros(SIZE[::-1])
        ball[y - 8 : y + 9, x - 8 : x + 9] = disc((17, 17), *(path[i] - [x - 8, y - 8]), 5.0)
        picture = picture * (1 - ball) + (210.0 if polarity == "bright" else 40.0) * ball
        luma = np.clip(picture + rng.normal(0, 1.5, picture.shape), 0, 255).astype(np.uint8)
        frames.append(Frame(i, Fraction(i, 30), luma, False, None))
    info = VideoInfo(*SIZE, Fraction(30), field_order="progressive")
    reader = TagReader("36h11", info, cover=True)
    tracked = track(reader.over(frames), info, targets=1, polarity=polarity)
    own = apart_from_tags(tracked.centroids, tracked.tracklets, reader.patches, "camera cam1")
    return own, reader.seen()


@pytest.mark.parametrize("polarity", ["bright", "dark"])
def test_a_ball_beside_a_tag_is_followed_and_the_tag_is_read(polarity):
    path = np.stack([250 + 30 * np.sin(np.arange(16) / 4), 60 + 4.5 * np.arange(16)], -1)
    (centroids, tracklets, findings), tags = beside(path, polarity=polarity)
    assert np.abs(centroids[["Xf", "Yf"]].to_numpy() - path).max() < 0.15
    assert (centroids["flag"] == "").all()
    assert len(tracklets) == 16
    assert findings == []
    assert tags.ids.tolist() == [7]
    assert (tags.flag == 0).all()


def test_a_ball_that_passes_the_tag_s_paper_is_measured_apart_from_it_alone():
    """Hidden and flagged while it touches, and right wherever it has no flag."""
    path = np.stack([280 - 14.0 * np.arange(16), np.full(16, 60.0)], -1)
    (centroids, tracklets, findings), _ = beside(path)
    off = np.abs(centroids[["Xf", "Yf"]].to_numpy() - path).max(1)
    good = (centroids["flag"] == "").to_numpy()
    assert 5 <= good.sum() <= 14
    assert np.nanmax(off) < 0.25
    assert centroids.loc[~good, "flag"].str.contains("merged|lost").any()
    assert np.isnan(off[~good]).any()
    assert len(tracklets) <= np.isfinite(off).sum() + 2
    assert [f.code for f in findings] in ([], ["target-at-tag"])
