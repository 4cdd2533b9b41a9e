"""Liquids whose properties follow from their composition and temperature."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from math import pi, sqrt

from walkers.physics.portable import exponential, power, sine

_TENSIONS = (
    (0.0, 73.05),
    (0.05, 72.9),
    (0.1, 72.9),
    (0.2, 72.4),
    (0.3, 72.0),
    (0.5, 70.0),
    (0.85, 66.0),
    (1.0, 63.0),
)
"""Mass fraction of glycerol and surface tension at 18 °C, mN/m: that of water by IAPWS, the others of the handbook."""
_TENSION_SLOPE_OF_GLYCEROL = -0.0598  # mN/(m K)


def water_glycerol(mass_fraction: float, temperature: float) -> dict[str, float]:
    """Density (kg/m³), dynamic viscosity (Pa s) and surface tension (N/m) of a mixture of water and glycerol.

    ``mass_fraction`` is the mass of the glycerol over that of the mixture; ``temperature`` in K, between the freezing
    and the boiling point of water.

    Notes
    -----
    Viscosity: N.-S. Cheng, Ind. Eng. Chem. Res. 47 (2008) 3285, doi 10.1021/ie071349z, from 0 to 100 °C; within 3 % of
    the table of Segur and Oberstar at 20 °C. Density: A. Volk, C. J. Kähler, Exp. Fluids 59 (2018) 75,
    doi 10.1007/s00348-018-2527-y, fitted from 15 to 30 °C; within 0.05 % of the table of Bosart and Snoddy at 20 °C.
    Surface tension: the CRC Handbook's table at 18 °C, linear in between, with the slopes in temperature of water
    (IAPWS R1-76) and of glycerol (-0.0598 mN/(m K)) by their shares of the mass.
    """
    celsius = temperature - 273.15
    return {
        "density": _density(mass_fraction, celsius),
        "dynamic_viscosity": 1e-3 * _viscosity(mass_fraction, celsius),
        "surface_tension": 1e-3 * _tension(mass_fraction, celsius),
    }


MIXTURES: Mapping[str, Callable[[float, float], dict[str, float]]] = {
    "water-glycerol": water_glycerol
}
"""Functions of mass fraction and temperature (K), by the names of the liquids."""


def _viscosity(share: float, celsius: float) -> float:
    """Cheng's Eqs. 6, 21 and 22 with his exponent α, mPa s."""
    water = 1.790 * float(exponential((-1230.0 - celsius) * celsius / (36100.0 + 360.0 * celsius)))
    glycerol = 12100.0 * float(
        exponential((-1233.0 + celsius) * celsius / (9900.0 + 70.0 * celsius))
    )
    a = 0.705 - 0.0017 * celsius
    b = (4.9 + 0.036 * celsius) * (a * a * sqrt(a))
    alpha = 1.0 - share + a * b * share * (1.0 - share) / (a * share + b * (1.0 - share))
    return float(power(water, alpha) * power(glycerol, 1.0 - alpha))


def _density(share: float, celsius: float) -> float:
    """Density with the volume contraction of Volk and Kähler, kg/m³."""
    glycerol, water = (
        1273.3 - 0.6121 * celsius,
        1000.0 * (1.0 - float(power(abs((celsius - 3.98) / 615.0), 1.71))),
    )
    contraction = 1.78e-6 * celsius**2 - 1.82e-4 * celsius + 1.41e-2
    added = 1.0 / (share / glycerol + (1.0 - share) / water)
    return float(
        added
        * (1.0 + contraction * float(power(max(0.0, float(sine(power(share, 1.31) * pi))), 0.81)))
    )


def _tension_of_water(celsius: float) -> float:
    """IAPWS R1-76(2014), mN/m."""
    tau = 1.0 - (celsius + 273.15) / 647.096
    return float(235.8 * float(power(tau, 1.256)) * (1.0 - 0.625 * tau))


def _tension(share: float, celsius: float) -> float:
    """The table at 18 °C, shifted to a temperature, mN/m."""
    (low, at_low), (high, at_high) = next(
        pair for pair in pairwise(_TENSIONS) if share <= pair[1][0]
    )
    at_18 = at_low + (at_high - at_low) * (share - low) / (high - low)
    of_water = _tension_of_water(celsius) - _tension_of_water(18.0)
    return at_18 + (1.0 - share) * of_water + share * _TENSION_SLOPE_OF_GLYCEROL * (celsius - 18.0)
