"""Windows cut from a picture, and the connected bright patches in them, all windows at once.

A window is a rectangle about one target. All windows lie side by side in one array (height, n, width), which is
also one wide picture: thresholding, connected components and dilation run over all of them in one call.
Windows hold grey levels 0-255 whatever the depth of the video; x and y are px in the picture that was cut.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array, Bools, Ints, Picture


@dataclass(frozen=True)
class Cutting:
    """How windows are laid side by side, and which of their pixels are saturated.

    full_scale  grey levels: a pixel this bright may be brighter than the camera can record
    separator   empty columns between windows: the soft edge grows by three pixels and must not reach the next window
    """

    full_scale: float = 254.5
    separator: int = 3


CUTTING = Cutting()


class Windows(NamedTuple):
    """Rectangles cut from one or several pictures.

    raw    (height, n, width) stored values, brighter = target
    left   (n,), top (n,) px, the picture's column and row of the window's first pixel
    scale  grey levels a stored value: 1 for 8 bit, 255/1023 for 10 bit
    """

    raw: Picture
    left: Ints
    top: Ints
    scale: float


class Components(NamedTuple):
    """Connected bright patches: one row a component, from label 1.

    mask, labels   (height, n, width + CUTTING.separator), 1 where a pixel is above the threshold, and its component
    window         index of the component's window
    x, y           px in the picture, the mean of its pixels; left, top, width, height px, the box that holds them
    pixels         their number
    """

    mask: NDArray[np.uint8]
    labels: NDArray[Any]
    window: Ints
    x: Array
    y: Array
    left: Ints
    top: Ints
    width: Ints
    height: Ints
    pixels: Ints


def cut(image: Picture, left: Ints, top: Ints, width: int, height: int) -> Picture:
    """Rectangles of one picture, (height, n, width), copied in one gather.

    left, top (n,) whole px with 0 <= left <= columns - width and so for top; the caller keeps to that.
    """
    rows, columns = image.shape
    strips = np.lib.stride_tricks.as_strided(
        image,
        shape=(rows, columns - width + 1, width),
        strides=(image.strides[0], image.strides[1], image.strides[1]),
        writeable=False,
    )
    cutting: Picture = strips[top + np.arange(height)[:, None], left]
    return cutting


def components(windows: Windows, threshold: ArrayLike) -> Components:
    """Connected patches (8 neighbours) of pixels above the threshold in every window.

    threshold  grey levels 0-255, one for all or (n,)
    """
    return components_of(above(windows, threshold), windows)


def above(windows: Windows, threshold: ArrayLike) -> Bools:
    """Which pixels are above the threshold, (height, n, width); grey levels 0-255, one for all or (n,)."""
    level = np.asarray(threshold, float) / windows.scale
    if windows.raw.dtype.kind == "u":  # integers compare fastest with their own kind
        level = np.clip(np.floor(level), 0, np.iinfo(windows.raw.dtype).max)
    level = level.astype(windows.raw.dtype)
    marked: Bools = windows.raw > (level[:, None] if level.ndim else level)
    return marked


def components_of(above: NDArray[Any], windows: Windows) -> Components:
    """Connected patches of pixels that are marked, (height, n, width), in every window."""
    height, n, width = above.shape
    step = width + CUTTING.separator
    mask = np.zeros((height, n, step), np.uint8)
    mask[..., :width] = above
    kind = cv2.CV_16U if mask.size < 4 * 65_000 else cv2.CV_32S  # a component takes four pixels at least
    _, labels, stats, middle = cv2.connectedComponentsWithStats(
        mask.reshape(height, n * step), connectivity=8, ltype=kind
    )
    left, top, wide, high, count = stats[1:].T.astype(np.intp)
    middle = middle[1:]
    window = left // step
    shift = windows.left[window] - window * step
    rows = windows.top[window]
    return Components(
        mask,
        labels.reshape(mask.shape),
        window,
        middle[:, 0] + shift,
        middle[:, 1] + rows,
        left + shift,
        top + rows,
        wide,
        high,
        count,
    )


def own_pixels(found: Components, chosen: Ints) -> NDArray[np.uint8]:
    """1 on the chosen component of each window."""
    wanted = np.where(chosen >= 0, chosen + 1, -1).astype(found.labels.dtype)
    own: NDArray[np.uint8] = (found.labels == wanted[:, None]).view(np.uint8)
    return own
