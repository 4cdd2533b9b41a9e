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
"""Mass fraction of glycerol and surface tension at 18 °C, mN/m.

That of water is from IAPWS, the others are from the CRC Handbook.
"""
_TENSION_SLOPE_OF_GLYCEROL = -0.0598
"""Change of the surface tension of glycerol with the temperature, mN/(m K)."""


def water_glycerol(mass_fraction: float, temperature: float) -> dict[str, float]:
    """Properties of a mixture of water and glycerol.

    Parameters
    ----------
    mass_fraction
        Mass of the glycerol over that of the mixture.
    temperature
        In K, between the freezing and the boiling point of water.

    Returns
    -------
    dict
        ``density`` (kg/m³), ``dynamic_viscosity`` (Pa s) and ``surface_tension`` (N/m).

    Notes
    -----
    Viscosity: N.-S. Cheng, Ind. Eng. Chem. Res. 47 (2008) 3285, doi 10.1021/ie071349z, from 0
    to 100 °C; within 3 % of the table of Segur and Oberstar at 20 °C. Density: A. Volk, C. J.
    Kähler, Exp. Fluids 59 (2018) 75, doi 10.1007/s00348-018-2527-y, fitted from 15 to 30 °C; within
    0.05 % of the table of Bosart and Snoddy at 20 °C. Surface tension: the CRC Handbook's table at
    18 °C, linear in between, with the slopes in temperature of water (IAPWS R1-76) and of glycerol
    (-0.0598 mN/(m K)) by their shares of the mass.
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
    glycerol = 1273.3 - 0.6121 * celsius
    water = 1000.0 * (1.0 - float(power(abs((celsius - 3.98) / 615.0), 1.71)))
    contraction = 1.78e-6 * celsius**2 - 1.82e-4 * celsius + 1.41e-2
    without_contraction = 1.0 / (share / glycerol + (1.0 - share) / water)
    wave = max(0.0, float(sine(power(share, 1.31) * pi)))
    return float(without_contraction * (1.0 + contraction * float(power(wave, 0.81))))


def _tension_of_water(celsius: float) -> float:
    """IAPWS R1-76(2014), mN/m."""
    tau = 1.0 - (celsius + 273.15) / 647.096
    return float(235.8 * float(power(tau, 1.256)) * (1.0 - 0.625 * tau))


def _interval_of_the_table(share: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Neighbouring rows of `_TENSIONS` between which a mass fraction lies."""
    for row, following in pairwise(_TENSIONS):
        if share <= following[0]:
            return row, following
    raise ValueError(f"mass fraction {share}: expected 0 to 1")


def _tension(share: float, celsius: float) -> float:
    """The table at 18 °C, shifted to a temperature, mN/m."""
    (low, tension_at_low), (high, tension_at_high) = _interval_of_the_table(share)
    rise = (tension_at_high - tension_at_low) * (share - low) / (high - low)
    at_18_degrees = tension_at_low + rise
    change_of_water = _tension_of_water(celsius) - _tension_of_water(18.0)
    of_glycerol = share * _TENSION_SLOPE_OF_GLYCEROL * (celsius - 18.0)
    return at_18_degrees + (1.0 - share) * change_of_water + of_glycerol
