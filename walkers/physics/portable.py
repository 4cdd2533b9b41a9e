"""Elementary functions and linear systems whose results have the same bits on every processor.

NumPy, its BLAS and the C library choose among several versions of sin, exp, pow or a matrix product
when a program starts, according to the vector instructions of the processor. The versions agree to
15 digits, not to the last one. A bridge table that differs in its last digit gives another pile:
piles are chaotic, and a run must not depend on where it was made.

The functions here consist of additions, multiplications, divisions, square roots and exact steps
(rounding to integers, powers of two) of double-precision numbers. IEEE 754 defines the result of
each of them, and NumPy applies them element by element in all its versions. Coefficients are those
of FDLIBM; results are within two units in the last place.

Not for general use: the functions are several times slower than NumPy's, and arguments are those of
bridges (angles up to 1e5, finite numbers).

References
----------
Sun Microsystems, FDLIBM 5.3 (1993): ``k_sin.c``, ``k_cos.c``, ``e_log.c``, ``e_exp.c``.
W. J. Cody, W. Waite, Software Manual for the Elementary Functions (1980): reduction of arguments.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray

_QUARTERS_PER_RADIAN = 6.36619772367581382433e-01
"""2/π."""
_QUARTER_HIGH = 1.57079632673412561417e00
"""The first 33 bits of π/2, so that its products with small integers are exact."""
_QUARTER_LOW = 6.07710050650619224932e-11
"""π/2 minus `_QUARTER_HIGH`."""
_SINE = (
    1.58969099521155010221e-10,
    -2.50507602534068634195e-08,
    2.75573137070700676789e-06,
    -1.98412698298579493134e-04,
    8.33333333332248946124e-03,
    -1.66666666666666324348e-01,
)
"""Coefficients of (sin x - x)/x³ in x²."""
_COSINE = (
    -1.13596475577881948265e-11,
    2.08757232129817482790e-09,
    -2.75573143513906633035e-07,
    2.48015872894767294178e-05,
    -1.38888888888741095749e-03,
    4.16666666666666019037e-02,
)
"""Coefficients of (cos x - 1 + x²/2)/x⁴ in x²."""
_LOG_2_HIGH = 6.93147180369123816490e-01
"""The first 32 bits of ln 2, so that its products with small integers are exact."""
_LOG_2_LOW = 1.90821492927058770002e-10
"""ln 2 minus `_LOG_2_HIGH`."""
_LOGARITHM = (
    1.479819860511658591e-01,
    1.531383769920937332e-01,
    1.818357216161805012e-01,
    2.222219843214978396e-01,
    2.857142874366239149e-01,
    3.999999999940941908e-01,
    6.666666666666735130e-01,
)
"""Coefficients of the series of ln((1 + r)/(1 - r)) in r²."""
_EXPONENTIAL = (
    4.13813679705723846039e-08,
    -1.65339022054652515390e-06,
    6.61375632143793436117e-05,
    -2.77777777770155933842e-03,
    1.66666666666666019037e-01,
)
"""Coefficients of the rational approximation of exp x in x²."""
_SQRT_HALF = 0.7071067811865476
"""√(1/2)."""


def polynomial(coefficients: Sequence[float], x: FloatArray) -> FloatArray:
    """A polynomial at x by Horner's rule; its coefficients begin with that of the highest power."""
    value = np.full_like(x, coefficients[0])
    for coefficient in coefficients[1:]:
        value = value * x + coefficient
    return value


def sine_and_cosine(angles: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Sine and cosine of angles (rad), both of their shape."""
    given = np.asarray(angles, np.float64)
    quarters = np.rint(given * _QUARTERS_PER_RADIAN)
    rest = (given - quarters * _QUARTER_HIGH) - quarters * _QUARTER_LOW
    square = rest * rest
    sine = rest + rest * square * polynomial(_SINE, square)
    cosine = (1.0 - 0.5 * square) + square * square * polynomial(_COSINE, square)
    quadrant = quarters - 4.0 * np.floor(0.25 * quarters)
    swapped = (quadrant == 1.0) | (quadrant == 3.0)
    sine_sign = np.where(quadrant >= 2.0, -1.0, 1.0)
    cosine_sign = np.where((quadrant == 1.0) | (quadrant == 2.0), -1.0, 1.0)
    sine_of_quadrant = np.where(swapped, cosine, sine)
    cosine_of_quadrant = np.where(swapped, sine, cosine)
    return sine_sign * sine_of_quadrant, cosine_sign * cosine_of_quadrant


def sine(angles: npt.ArrayLike) -> FloatArray:
    """Sine of angles (rad)."""
    return sine_and_cosine(angles)[0]


def cosine(angles: npt.ArrayLike) -> FloatArray:
    """Cosine of angles (rad)."""
    return sine_and_cosine(angles)[1]


def logarithm(x: npt.ArrayLike) -> FloatArray:
    """Natural logarithm of positive numbers."""
    mantissa, exponent = np.frexp(np.asarray(x, np.float64))
    below = mantissa < _SQRT_HALF
    fraction = np.where(below, 2.0 * mantissa, mantissa) - 1.0
    twos = exponent - np.where(below, 1.0, 0.0)
    ratio = fraction / (2.0 + fraction)
    square = ratio * ratio
    series = square * polynomial(_LOGARITHM, square)
    half_square = 0.5 * fraction * fraction
    small = ratio * (half_square + series) + twos * _LOG_2_LOW
    return np.asarray(twos * _LOG_2_HIGH - ((half_square - small) - fraction))


def logarithm_of_one_plus(x: npt.ArrayLike) -> FloatArray:
    """ln(1 + x) of numbers x ≥ 0, accurate for small ones too."""
    given = np.asarray(x, np.float64)
    rounded = 1.0 + given
    lost = np.where(given < 1.0, given - (rounded - 1.0), 1.0 - (rounded - given))
    return np.asarray(logarithm(rounded) + lost / rounded)


def exponential(x: npt.ArrayLike) -> FloatArray:
    """Exponential of numbers x, for |x| below 700."""
    given = np.asarray(x, np.float64)
    twos = np.rint(given / (_LOG_2_HIGH + _LOG_2_LOW))
    high = given - twos * _LOG_2_HIGH
    low = twos * _LOG_2_LOW
    rest = high - low
    square = rest * rest
    c = rest - square * polynomial(_EXPONENTIAL, square)
    mantissa = 1.0 - ((low - (rest * c) / (2.0 - c)) - high)
    return np.asarray(np.ldexp(mantissa, twos.astype(np.int32)))


def power(x: npt.ArrayLike, exponent: float) -> FloatArray:
    """Numbers x ≥ 0 to a positive power, or positive ones to any.

    The relative error is 1e-16 (1 + 2 |exponent ln x|).
    """
    given = np.asarray(x, np.float64)
    zero = given == 0.0
    return np.where(zero, 0.0, exponential(exponent * logarithm(np.where(zero, 1.0, given))))


def cube_root(x: float) -> float:
    """Cube root of a positive number."""
    root = float(power(x, 1.0 / 3.0))
    return root - (root * root * root - x) / (3.0 * root * root)


def solve_linear(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Solve n systems of m linear equations by Gauss–Jordan elimination with partial pivoting.

    Parameters
    ----------
    matrices : ndarray, shape (n, m, m)
    right : ndarray, shape (n, m)

    Returns
    -------
    ndarray, shape (n, m)
        Solutions; not finite, or very large, where a matrix is singular.
    """
    rows = np.concatenate([matrices, right[..., None]], axis=-1)
    systems = np.arange(len(rows))
    size = right.shape[1]
    with np.errstate(all="ignore"):
        for column in range(size):
            pivot = column + np.abs(rows[:, column:, column]).argmax(axis=1)
            pivot_rows = rows[systems, pivot]
            rows[systems, pivot] = rows[:, column]
            rows[:, column] = pivot_rows / pivot_rows[:, column : column + 1]
            factors = rows[:, :, column].copy()
            factors[:, column] = 0.0
            rows -= factors[:, :, None] * rows[:, None, column]
    return rows[:, :, size]


def gauss_legendre(count: int) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights of Gauss and Legendre's quadrature on (-1, 1), both of shape (count,)."""
    numbers = np.arange(count)[::-1]
    nodes = cosine(np.pi * (numbers + 0.75) / (count + 0.5))
    for _ in range(8):  # Newton's method converges quadratically; the last steps change nothing
        before = np.ones(count)
        value = nodes
        for degree in range(2, count + 1):
            following = ((2.0 * degree - 1.0) * nodes * value - (degree - 1.0) * before) / degree
            before, value = value, following
        slope = count * (nodes * value - before) / (nodes * nodes - 1.0)
        nodes = nodes - value / slope
    return nodes, 2.0 / ((1.0 - nodes * nodes) * slope * slope)


def chebyshev_coefficients(values: FloatArray) -> FloatArray:
    """Coefficients of the polynomial through values at `chebyshev_nodes`.

    They are those of `numpy.polynomial.Chebyshev`.
    """
    count = len(values)
    degrees = np.arange(count)[:, None]
    places = (np.arange(count) + 0.5)[None, :]
    # Angles are reduced in integers first: cos(π k (j + 1/2) / n) has a period of 4 n in 2 k j + k.
    turns = np.mod(degrees * 2.0 * places, 4.0 * count) / (2.0 * count)
    sums = (cosine(np.pi * turns) * values).sum(axis=1)
    coefficients = 2.0 * sums / count
    coefficients[0] = 0.5 * coefficients[0]
    return np.asarray(coefficients)


def chebyshev_nodes(count: int) -> FloatArray:
    """Chebyshev's points in (-1, 1), from the largest to the smallest, shape (count,)."""
    return cosine(np.pi * (np.arange(count) + 0.5) / count)
