"""Types of NumPy arrays and of vectors, by which all rooms annotate what they pass on."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
Vector = tuple[float, float, float]
"""A point or a direction in space, Cartesian components."""
