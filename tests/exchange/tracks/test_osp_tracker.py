import numpy as np
import pytest

from tests.exchange.tracks.made import positions
from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks


def step(k, x, y) -> str:
    """A marked step."""
    return (
        f'<property name="[{k}]" type="object">'
        '<object class="org.opensourcephysics.cabrillo.tracker.PointMass$FrameData">'
        f'<property name="n" type="int">{k}</property><property name="x" type="double">{x!r}</property>'
        f'<property name="y" type="double">{y!r}</property></object></property>'
    )


def trk(b, names=("ball", "ball")):
    """A .trk file after Tracker's XMLControlElement: only marked steps are there."""
    tracks = ""
    for i, name in enumerate(names):
        steps = "".join(step(k, *(b[k, i] + 0.5).tolist()) for k in range(len(b)) if np.isfinite(b[k, i]).all())
        tracks += (
            '<property name="item" type="object">'
            '<object class="org.opensourcephysics.cabrillo.tracker.PointMass">'
            f'<property name="name" type="string">{name}</property><property name="framedata" type="array" '
            f'class="[Lorg.opensourcephysics.cabrillo.tracker.PointMass$FrameData;">{steps}</property></object></property>'
        )
    return (
        '<?xml version="1.0" encoding="UTF-8"?><object class="org.opensourcephysics.cabrillo.tracker.TrackerPanel">'
        '<property name="videoclip" type="object"><object class="org.opensourcephysics.media.core.VideoClip">'
        '<property name="video_framecount" type="int">13</property></object></property><property name="clipcontrol" '
        'type="object"><object class="org.opensourcephysics.media.core.StepperClipControl">'
        '<property name="delta_t" '
        'type="double">40.0</property></object></property>'
        f'<property name="tracks" type="collection">{tracks}</property>'
        "</object>"
    )


def test_the_point_masses_of_a_trk_file_count_from_the_corner_of_the_picture(tmp_path):
    b = positions()
    (tmp_path / "cam1.trk").write_text(trk(b))
    tracks = read_tracks(tmp_path / "cam1.trk", Convention(), "here")
    assert tracks.names == ("ball", "ball'")
    assert tracks.rate == pytest.approx(25)
    np.testing.assert_allclose(placed(tracks, Convention(), "here"), b, atol=1e-12)


def test_an_exported_table_is_read_by_its_pixel_columns(tmp_path):
    text = "mass_A\nframe\tt\tx\ty\tpixelx\tpixely\n0\t0.0\t1\t2\t100.5\t200.5\n2\t0.1\t1\t2\t\t\n"
    for given, name in (
        (text, "mass_A"),
        (text.split("\n", 1)[1], "mass_A"),
        (text.replace("mass_A", "ball 2"), "ball 2"),
    ):
        (tmp_path / "cam1.txt").write_text(given)
        tracks = read_tracks(tmp_path / "cam1.txt", Convention(), "here")
        assert tracks.frame.tolist() == [0, 2]
        assert tracks.names == (name,)
        np.testing.assert_array_equal(placed(tracks, Convention(), "here")[:, 0], [[100, 200], [np.nan, np.nan]])


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("t,x,y\n0,1,2\n", "in the world of Tracker"),
        ("mass_A\nt,x,y\n0,1,2\n", "Export the columns frame, pixelx and pixely"),
        ("pixelx,pixely,t\n1,2,0\n", "no column frame"),
        (trk(positions())[:-9], "cut off or damaged"),
        (trk(np.full((3, 2, 2), np.nan)), "no point mass with marked steps"),
    ],
)
def test_what_holds_no_pixels_is_refused_in_one_line(tmp_path, text, what):
    (tmp_path / "cam1.trk").write_text(text)
    with pytest.raises(VidtrackError, match=what) as error:
        read_tracks(tmp_path / "cam1.trk", Convention(), "here")
    assert "\n" not in str(error.value)
