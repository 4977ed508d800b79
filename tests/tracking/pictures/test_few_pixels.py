import numpy as np
import pytest

from vidtrack.tracking.pictures.few_pixels import WIDE, by_block, every, step_of


def test_of_wide_pictures_one_pixel_in_four_is_looked_at_else_one_in_two():
    assert step_of(np.zeros((4, WIDE), np.uint8)) == 2
    assert step_of(np.zeros((4, WIDE + 1), np.uint8)) == 4


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("step", [2, 4])
@pytest.mark.parametrize("shape", [(64, 96), (61, 97)])
def test_the_pixels_are_those_at_the_corners_of_steps_as_many_as_make_blocks(dtype, step, shape):
    luma = np.random.default_rng(1).integers(0, 256, shape).astype(dtype)
    expected = luma[::step, ::step]
    rows, columns = (4 * (n // 4) for n in expected.shape)
    few = every(luma, step)
    assert few.dtype == dtype
    assert np.array_equal(few, expected[:rows, :columns])
    assert np.array_equal(every(np.asfortranarray(luma), step), few)


def test_a_block_differs_by_the_mean_over_its_pixels():
    rng = np.random.default_rng(2)
    a, b = rng.integers(0, 256, (2, 24, 32)).astype(np.uint8)
    mean = np.abs(a.astype(float) - b).reshape(6, 4, 8, 4).mean((1, 3))
    assert by_block(a, b).shape == (6, 8)
    assert np.allclose(by_block(a, b), mean, atol=0.51)
    assert by_block(np.zeros((4, 4), np.uint8), np.full((4, 4), 255, np.uint8)).tolist() == [[255]]
