"""The thesis's table A.3 and drawn discs are the witnesses."""

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from vidtrack.calibration.assessment.target_design import LEAST_PIXELS, centroid_noise, least_diameter, pixels_found

FIELD_CM, ROWS, COLUMNS = (622.0, 469.0), 480, 512  # appendix A.2: 6.22 x 4.69 m
HERE = os.path.join(os.path.dirname(__file__), "..", "..", "..", "data", "thesis")
TABLE_A1, TABLE_A3 = (pd.read_csv(os.path.join(HERE, f"table-{name}.csv")) for name in ("A.1", "A.3"))
CM_PER_PX = np.sqrt(FIELD_CM[0] / COLUMNS * FIELD_CM[1] / ROWS)


def test_pixels_found_are_those_of_the_thesis_experiment():
    """Ten black circles, one field looked at; its counts vary by 1 to 4 pixels (table A.3's standard deviations)."""
    predicted = pixels_found(TABLE_A3["size_cm"] / CM_PER_PX, fields=1)
    assert predicted == pytest.approx(TABLE_A3["mean_pixels"].to_numpy(), abs=1.3)
    assert predicted == pytest.approx(TABLE_A1["centroid_pixels_mean"].to_numpy(), abs=1.3)
    within = (predicted >= TABLE_A3["least_pixels"]) & (predicted <= TABLE_A3["most_pixels"])
    assert within[TABLE_A1["efficiency_percent"] > 0].all()


def test_circles_that_were_seen_in_every_sample_have_as_many_pixels_as_the_plan_asks_for():
    """The plan asks for 4; the thesis's circle of 3.68 was never lost, that of 1.6 in 6 samples of 100."""
    always = TABLE_A1[TABLE_A1["efficiency_percent"] == 100]
    lost = TABLE_A1[TABLE_A1["efficiency_percent"] < 100]
    assert always["centroid_pixels_mean"].min() == pytest.approx(LEAST_PIXELS, abs=0.5)
    assert lost["centroid_pixels_mean"].max() < LEAST_PIXELS


def test_the_least_diameter_is_the_smallest_that_the_thesis_never_lost():
    assert least_diameter(469.0) == pytest.approx(4.1, abs=0.15)  # 4.1 cm was never lost, 2.9 cm in 6 samples of 100


def _discs(rng, diameter, n=300, size=20, sub=16):
    """Pictures (n, size, size) of discs at random sub-pixel places, by the share of each pixel covered."""
    centre = size / 2 + rng.uniform(-0.5, 0.5, (n, 2))
    axis = (np.arange(size * sub) + 0.5) / sub - 0.5
    pictures = np.empty((n, size, size))
    for i, (x, y) in enumerate(centre):
        inside = (axis - x) ** 2 + (axis[:, None] - y) ** 2 <= diameter**2 / 4
        pictures[i] = inside.reshape(size, sub, size, sub).mean((1, 3))
    return centre, pictures


@pytest.mark.parametrize("diameter", [5.0, 8.0, 12.0])
def test_a_weighted_centroid_of_drawn_discs_has_the_noise_foretold(diameter):
    rng = np.random.default_rng(0)
    centre, share = _discs(rng, diameter, n=300)
    grey = np.round(40 + 150 * share + rng.normal(0, 6, share.shape)) - 40
    at = np.arange(share.shape[1])
    near = (at[None, None] - centre[:, 0, None, None]) ** 2 + (at[None, :, None] - centre[:, 1, None, None]) ** 2
    grey = np.where(near <= (diameter / 2 + 1) ** 2, grey, 0)  # over the disc and its soft edge
    X = (grey * at).sum((1, 2)) / grey.sum((1, 2))
    told = centroid_noise(diameter, contrast=150, noise=6, systematic_px=0.0)
    assert np.std(X - centre[:, 0]) == pytest.approx(told, rel=0.2)


@pytest.mark.parametrize("diameter", [4.0, 8.0, 12.0])
def test_a_binary_centroid_of_drawn_discs_has_the_error_foretold(diameter):
    centre, share = _discs(np.random.default_rng(1), diameter, n=300)
    taken = share > 0.5
    X = (taken * np.arange(share.shape[1])).sum((1, 2)) / taken.sum((1, 2))
    told = centroid_noise(diameter, contrast=200, noise=0, centroid="binary", systematic_px=0.0)
    assert np.std(X - centre[:, 0]) == pytest.approx(told, rel=0.3)


def test_what_is_systematic_does_not_average_out():
    one, many = (centroid_noise(8.0, contrast=50, noise=5, frames=n) for n in (1, 10_000))
    assert one > 0.03
    assert many == pytest.approx(0.02, rel=0.01)


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="contrast"):
        centroid_noise(8.0, contrast=0, noise=3)
    with pytest.raises(ValueError, match="weighted, binary"):
        centroid_noise(8.0, contrast=9, noise=3, centroid="mean")


def test_the_page_shows_the_published_tables_beside_what_is_predicted():
    page = (Path(HERE) / "../../docs/old-files.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1:-1] for line in page.split("px across")[1].split("\n\n")[0].split("\n")[2:]]
    shown = np.array([[float(row[0]), float(row[2]), float(row[4])] for row in rows])
    np.testing.assert_array_equal(shown[:, 0], TABLE_A1["size_cm"])
    np.testing.assert_allclose(shown[:, 1], TABLE_A1["centroid_pixels_mean"], atol=0.0501)
    across = shown[:, 0] / FIELD_CM[1] * ROWS
    wide = shown[:, 0] / FIELD_CM[0] * COLUMNS
    predicted = pixels_found(np.sqrt(across * wide), fields=1)
    np.testing.assert_allclose(shown[:, 2], predicted, atol=0.4)
