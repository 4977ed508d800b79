"""Six degrees of freedom with their units."""

from tests.figures.drawn import run, texts
from vidtrack.figures import bodies


def test_bodies_show_six_degrees_of_freedom():
    table = run(body="float", **dict.fromkeys(("roll", "pitch", "yaw"), 1.0))
    table = table.assign(**dict.fromkeys(("sigma_roll", "sigma_pitch", "sigma_yaw"), 0.1))
    figure = bodies.six_degrees(table, "in", "float")
    assert {"x (in)", "roll (deg)", "pitch (deg)", "yaw (deg)"} <= set(texts(figure))
