import itertools

import numpy as np
import pytest

from tests.exchange.tracks.made import positions
from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks


def whole(b, pixel=0.25, unit="micron", extra="", seconds=0.1):
    """TrackMate's file of spots and edges, after its TmXmlWriter."""
    spots, tracks = [], []
    for i in range(b.shape[1]):
        seen = [k for k in range(len(b)) if np.isfinite(b[k, i]).all()]
        for k in seen:
            x, y = b[k, i] * pixel
            spots.append(f'<Spot ID="{1000 * i + k}" name="ID" FRAME="{k}" POSITION_X="{x!r}" POSITION_Y="{y!r}"/>')
        edges = "".join(
            f'<Edge SPOT_SOURCE_ID="{1000 * i + k}" SPOT_TARGET_ID="{1000 * i + j}"/>'
            for k, j in itertools.pairwise(seen)
        )
        tracks.append(f'<Track name="Track_{i}" TRACK_ID="{i}">{edges}{extra if not i else ""}</Track>')
    return (
        f'<?xml version="1.0"?><TrackMate version="7.6"><Model spatialunits="{unit}" timeunits="sec"><AllSpots>'
        + "".join(spots).replace("np.float64(", "").replace(")", "")
        + f"</AllSpots><AllTracks>{''.join(tracks)}</AllTracks></Model><Settings><ImageData width='640' height='480' "
        f"pixelwidth='{pixel}' pixelheight='{pixel}' timeinterval='{seconds}'/></Settings></TrackMate>"
    )


def test_positions_are_divided_by_the_size_of_the_pixel(tmp_path):
    b = positions()
    (tmp_path / "cam1.xml").write_text(whole(b))
    tracks = read_tracks(tmp_path / "cam1.xml", Convention(), "here")
    np.testing.assert_allclose(placed(tracks, Convention(), "here"), b, rtol=1e-14)
    assert tracks.rate == pytest.approx(10)
    assert tracks.size == (640, 480)
    assert not tracks.named


def test_a_track_that_splits_is_cut_there(tmp_path):
    b = positions(10, 1)
    b[:] = np.nan_to_num(b, nan=300.0)
    text = whole(b, extra='<Edge SPOT_SOURCE_ID="4" SPOT_TARGET_ID="900"/>').replace(
        "<AllSpots>", '<AllSpots><Spot ID="900" FRAME="5" POSITION_X="1" POSITION_Y="2"/>'
    )
    (tmp_path / "cam1.xml").write_text(text)
    tracks = read_tracks(tmp_path / "cam1.xml", Convention(), "here")
    found = {n: np.flatnonzero(np.isfinite(tracks.b[:, i, 0])).tolist() for i, n in enumerate(tracks.names)}
    assert sorted(found.values()) == [[0, 1, 2, 3, 4], [5], [5, 6, 7, 8, 9]]


def test_the_short_file_is_read_in_pixels_and_refused_in_other_units(tmp_path):
    text = (
        '<Tracks nTracks="1" spaceUnits="{}" frameInterval="0.02" timeUnits="sec"><particle nSpots="2">'
        '<detection t="0" x="10.5" y="20" z="0"/><detection t="1" x="11.5" y="21" z="0"/></particle></Tracks>'
    )
    (tmp_path / "cam1.xml").write_text(text.format("pixel"))
    tracks = read_tracks(tmp_path / "cam1.xml", Convention(), "here")
    assert tracks.b[:, 0].tolist() == [[10.5, 20], [11.5, 21]]
    assert tracks.rate == pytest.approx(50)
    (tmp_path / "cam1.xml").write_text(text.format("micron"))
    with pytest.raises(VidtrackError, match="pixel size that is not stated"):
        read_tracks(tmp_path / "cam1.xml", Convention(), "here")


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (whole(positions())[:-300], "cut off or damaged"),
        ("<TrackMate><Model/></TrackMate>", "no tracks"),
        ("<TrackMate/>", "no Model"),
        (whole(positions()).replace('FRAME="3"', 'FRAME="x"'), "no FRAME"),
    ],
)
def test_a_file_that_is_not_whole_is_refused_in_one_line(tmp_path, text, what):
    (tmp_path / "cam1.xml").write_text(text)
    with pytest.raises(VidtrackError, match=what) as error:
        read_tracks(tmp_path / "cam1.xml", Convention(), "here")
    assert "\n" not in str(error.value)
