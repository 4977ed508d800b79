"""Types of arrays that all rooms share."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Measured or computed values; NaN is missing."""

Ints = NDArray[np.intp]
"""Indices and counts."""

Bools = NDArray[np.bool_]
"""Masks."""

Picture = NDArray[Any]
"""A picture as stored, (rows, columns), of any integer or floating type."""
