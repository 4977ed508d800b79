"""Each gate at its edge: silent on one side, one line with reason and cure on the other."""

import numpy as np
import pytest

from vidtrack.calibration.camera import gates
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import look_at, thesis_points, thesis_rig

CAMERA = thesis_rig(1)[0]
P = thesis_points()[1]
B = project(CAMERA, P)


def one_line(text):
    return text is not None and "\n" not in text and text.endswith(".")


@pytest.mark.parametrize(
    ("n", "refine", "model", "needed"),
    [(7, "linear", "tsai", 7), (7, "centre", "tsai", 7), (11, "full", "tsai", 11), (15, "bundle", "affine", 15)],
)
def test_too_few_points_are_told_with_the_count_needed(n, refine, model, needed):
    assert gates.too_few(n, refine, model) is None
    line = gates.too_few(n - 1, refine, model)
    assert one_line(line)
    assert f"{n - 1} usable calibration points" in line
    assert f"needs {needed}" in line


def test_eight_points_may_still_be_calibrated_in_closed_form():
    assert "refine: linear" in gates.too_few(8, "full")
    assert "refine: linear" not in gates.too_few(6, "full")


def test_flatness_is_third_over_first_singular_value():
    # the corners of a box 2 x 1 x 0.1: its singular values go as its edges
    box = np.array([[x, y, z] for x in (0, 2) for y in (0, 1) for z in (0, 0.1)])
    assert gates.flatness(box) == pytest.approx(0.05)
    assert gates.flatness(box + 1e5) == pytest.approx(0.05, rel=1e-6)


@pytest.mark.parametrize(
    ("depth", "refuses", "warns"), [(0, 1, 0), (0.008, 1, 0), (0.02, 0, 1), (0.1, 0, 1), (0.2, 0, 0)]
)
def test_coplanar_is_refused_below_one_size_and_doubted_below_another(depth, refuses, warns):
    box = np.array([[x, y, z] for x in (0, 2) for y in (0, 1) for z in (0, depth)])
    assert (gates.coplanar(box, "full", ()) is not None) == bool(refuses)
    assert (gates.nearly_coplanar(box) is not None) == bool(warns)


def test_a_plane_is_let_through_when_what_it_cannot_tell_is_held():
    flat = P * [1, 1, 0]
    assert one_line(gates.coplanar(flat, "linear", ()))
    assert gates.coplanar(flat, "linear", ("Sx",)) is None
    assert one_line(gates.coplanar(flat, "full", ("Sx",)))
    assert gates.coplanar(flat, "full", ("Sx", "Cx", "Cy")) is None


def said_by(check):
    """The check, its finding as one line."""
    return lambda *given: (lambda found: f"{found.text} {found.cure}")(check(*given))


def test_points_on_a_line_are_refused():
    assert one_line(gates.straight(np.outer(np.arange(12.0), [1, 2, 3])))
    assert gates.straight(P) is None


def test_a_point_whose_decimal_point_is_lost_is_named_and_not_called_a_line():
    mistyped = np.array(P, float)
    mistyped[3, 0] *= 1e5
    line = gates.straight(mistyped)
    assert f"the point at ({mistyped[3, 0]:.10g}, " in line
    assert "a decimal point is wrong" in line
    assert gates.far_off(np.array(P, float) * 1e5) is None
    assert gates.far_off(np.zeros((6, 3))) is None
    assert gates.far_off(mistyped[:3]) is None


@pytest.mark.parametrize("mirror", [[-1, 1, 1], [1, -1, 1], [1, 1, -1]])
def test_any_negated_axis_is_a_mirror(mirror):
    sense = gates.handedness(P * mirror, B, 255.5, 239.5, CAMERA.dx, CAMERA.dy)
    assert sense == -1
    line = gates.mirrored(sense)
    assert one_line(line)
    assert "right-handed" in line
    assert "negate one column" in line


def test_two_exchanged_columns_are_a_mirror_and_a_cyclic_exchange_is_none():
    def sense(order):
        return gates.handedness(P[:, order], B, 255.5, 239.5, CAMERA.dx, CAMERA.dy)

    assert sense([1, 0, 2]) == -1
    assert sense([1, 2, 0]) == 1


def test_a_true_camera_passes_with_noise_and_off_centre():
    noisy = B + np.random.default_rng(0).normal(0, 0.3, B.shape)
    assert gates.handedness(P, noisy, 200.0, 300.0, CAMERA.dx, CAMERA.dy) == 1
    assert gates.mirrored(1) is None


def test_a_picture_that_is_flipped_is_a_mirror():
    flipped = B * [1, -1] + [0, 479]
    assert gates.handedness(P, flipped, 255.5, 239.5, CAMERA.dx, CAMERA.dy) == -1


def test_a_fold_inside_the_picture_is_told_with_its_radius():
    # the farthest corner lies about 5.7 mm from the centre; sqrt(1 / (3 * 0.02)) = 4.1 mm is inside, 13 mm is not
    line = said_by(gates.folded)(CAMERA.with_(kappa1=-0.02))
    assert one_line(line)
    assert "297 px" in line  # 4.08 mm over dy
    assert "kappa1 = -0.02" in line
    assert gates.folded(CAMERA.with_(kappa1=-0.002)) is None
    assert gates.folded(CAMERA) is None


@pytest.mark.parametrize(
    ("kappa1", "level"), [(-0.0106, "note"), (-0.0115, "note"), (-0.014, "doubtful"), (-0.02, "doubtful")]
)
def test_a_fold_in_the_corners_alone_is_a_note(kappa1, level):
    finding = gates.folded(CAMERA.with_(kappa1=kappa1))
    assert (finding.level, finding.code) == (level, "lens-model-folds")


def test_the_term_that_folds_the_lens_is_named():
    line = said_by(gates.folded)(CAMERA.with_(kappa1=1e-4, kappa2=-2e-3))
    assert "kappa2 = -0.002" in line
    assert "calibration.fix: [kappa2]" in line
    line = said_by(gates.folded)(CAMERA.with_(kappa1=-0.03, kappa2=1e-4))
    assert "kappa1 = -0.03" in line
    assert "model" not in line.split("Add points")[1]  # the model has kappa2 already


def test_points_bunched_in_a_corner_are_told_where():
    corner = B / 4 + [300, 20]
    line = said_by(gates.bunched)(corner, (512, 480))
    assert one_line(line)
    assert "upper right corner" in line


def test_points_bunched_in_the_middle_are_told_too_and_the_thesis_s_are_not():
    small = (B - B.mean(0)) / 5 + [255, 239]
    assert "small part" in said_by(gates.bunched)(small, (512, 480))
    assert gates.bunched(B, (512, 480)) is None


def test_the_hull_of_a_square_with_points_inside_is_the_square():
    b = np.concatenate([[[0, 0], [4, 0], [4, 4], [0, 4]], np.random.default_rng(0).uniform(1, 3, (20, 2))])
    assert gates.hull_area(b) == 16
    assert gates.hull_area(b[:2]) == 0


def test_large_standard_errors_are_told_by_name():
    def known(sd_Cx, sd_f):
        return Uncertainty(("f", "Cx"), np.zeros(3), np.diag([sd_f**2, sd_Cx**2]))

    assert gates.unsure(CAMERA, known(5, 0.1)) is None
    line = said_by(gates.unsure)(CAMERA, known(40, 1.0))
    assert one_line(line)
    assert "Cx +- 40 px" in line
    assert "f +- 9 %" in line


def test_a_plane_seen_square_on_is_doubted():
    flat = P * [1, 1, 0]
    above = CAMERA.with_(R=look_at([0, 0, 100], [0, 0, 0], up=(0, 1, 0)))
    assert one_line(said_by(gates.facing)(above, flat))
    assert gates.facing(CAMERA, flat) is None


def test_a_lens_that_leaves_much_more_than_a_richer_one_is_doubted():
    assert one_line(said_by(gates.plain_lens)(3.0, 0.8, "tsai"))
    assert gates.plain_lens(0.10, 0.099, "tsai") is None
    assert gates.plain_lens(0.10, np.nan, "tsai") is None


def test_swapped_tags_are_named_and_most_points_left_out_refused():
    assert one_line(gates.disagreeing(20, 64))
    assert gates.disagreeing(40, 64) is None
    assert "tags 3 and 9 are swapped" in gates.swapped("3", "9").text
