"""What the paper publishes of the walker as numbers: in its text and captions (the points of its figures are not)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

GRAVITY = 9.8
"""The paper's g, m/s²."""
FIT = {2.0: 0.30e-3, 3.0: 0.68e-3, 4.0: 1.23e-3, 5.0: 1.98e-3, 6.0: 2.96e-3}
"""Fig. 2: the paper's fitted curve below the plateau, m/s, at peak accelerations in g."""
FIG3_FIT = {
    (0.25, 0.2): 1.11e-3,
    (0.4, 0.3): 1.47e-3,
    (0.3, 0.2): 2.20e-3,
    (0.35, 0.2): 3.42e-3,
    (0.4, 0.2): 4.88e-3,
}
"""Fig. 3: the same curve at Γ0 = 0.5, m/s, by the radii in mm."""
PLATEAU = 6.0
"""Peak acceleration in g at which the plateau of Fig. 2 begins; Γ0 ≈ 0.6."""
FIG4_PEAKS = (2.0, 10.0)
"""Fig. 4a and b: peak acceleration, g."""
FIG4_VELOCITY = (2.3e-3, 8.0e-3)
"""Fig. 4a and b: mean velocity, m/s."""
FIG4B_ROTATION, FIG4B_SLIDING = 13.3e-3, -5.3e-3
"""Fig. 4b: mean rotation and sliding velocity of the large bead, m/s."""
LARGEST_V, STABLE_V = 0.4, 0.45
"""|V| of all that the paper investigated is below 0.4; small angles stay small up to 0.45."""


class Point(NamedTuple):
    """A walker of the paper's: the sweep that has it, its radii (mm), its frequency (Hz) and peak acceleration (g).

    Where no acceleration is given Γ0 is 0.5.
    """

    sweep: str
    radii: tuple[float, float]
    frequency: float
    peak: float | None = None

    @property
    def name(self) -> str:
        """What the walker differs from others of its figure in."""
        large, small = self.radii
        if self.sweep == "fig4":
            return "4a" if self.peak == FIG4_PEAKS[0] else "4b"
        return f"{large:g}/{small:g} mm" if self.peak is None else f"{self.frequency:g} Hz, {self.peak:g} g"


def _fig2(*peaks: float, frequencies: Sequence[float] = (60.0, 70.0, 80.0, 90.0)) -> tuple[Point, ...]:
    return tuple(Point("fig2", (0.3, 0.2), frequency, peak) for peak in peaks for frequency in frequencies)


FIG4 = {letter: (Point("fig4", (0.6, 0.3), 80.0, peak),) for letter, peak in zip("ab", FIG4_PEAKS, strict=True)}


@dataclass(frozen=True)
class Published:
    """A published number, and of what it is one.

    Attributes
    ----------
    key
        Names it.
    what
        In words.
    value
        As published, in ``unit``; None where the paper states it in words only. Such a one has bounds, and does not
        count among those that agree or disagree.
    unit
        Shown with it.
    bounds
        Between which a value is what the paper says, if it says so: the rounding of its digits is none.
    depends_on
        A sentence: what a disagreement of the engine depends on, as the sensitivity study and
        docs/explanation/physics.md find.
    measured
        Whether it tests the engine: Γ0 and Mathieu's V follow from beads and drive alone.
    of, over
        The number is a mean over walkers, or its ratio to one over others, pair by pair.
    quantity
        Of these: ``velocity``, ``rotation_1`` or ``sliding_1`` of those that walk; ``gamma0``; ``velocity_of_all``,
        whichever way they turn. Empty where `walkers.paper.comparison` has a function for the number.
    """

    key: str
    what: str
    value: float | None
    unit: str = "mm/s"
    bounds: tuple[float, float] | None = None
    depends_on: str = ""
    measured: bool = True
    of: tuple[Point, ...] = ()
    over: tuple[Point, ...] = ()
    quantity: str = ""


def _in_mm(speed: float) -> float:
    """A published speed, m/s, in mm/s with the digits that it was published with."""
    return round(speed * 1e3, 6)


def _speed(key: str, what: str, speed: float, depends_on: str, of: tuple[Point, ...], quantity: str) -> Published:
    return Published(key, what, _in_mm(speed), depends_on=depends_on, of=of, quantity=quantity)


def _gamma(key: str, what: str, value: float, half: tuple[float, float], of: tuple[Point, ...]) -> Published:
    return Published(key, what, value, "", half, measured=False, of=of, quantity="gamma0")


def _ratio(key: str, what: str, depends_on: str, of: tuple[Point, ...], over: tuple[Point, ...]) -> Published:
    return Published(key, what, 1.0, "", depends_on=depends_on, of=of, over=over, quantity="velocity")


_SPEED = (
    "Speeds depend on friction and on the tangential drag of the bridges, which are calibrated to all of these numbers "
    "at once."
)
_ASYMMETRY = (
    "With Coulomb friction and the bridges' drag speeds grow less with the asymmetry, in every set of the calibration "
    "that gives Fig. 2. The published curve is quasi-static: the paper's own law integrated in time gives 3.9 mm/s for "
    "4.88."
)
_FIG4A = (
    "It depends on the frictions of the slide and between the beads: with less of the latter the walker is slower, and "
    "with less of the former the large bead slides."
)
_FIG4B = (
    "Its beads part in every cycle and come together again. With less viscous bridges the large bead rotates and "
    "slides less: 8.2 and -1.1 mm/s with the liquid's own viscosity, at the same velocity of the walker."
)
_THRESHOLD = "The threshold depends on friction alone: it is 0.7 to 0.85 times the coefficient."
_TURNED = (
    "Dimers turn into or across the axis within two seconds or three; whether they do depends on friction, rolling "
    "friction and viscosity."
)

_RATIO_OF_FREQUENCIES = (
    "Where friction alone limits sliding, speeds go as 1/f; in theory a tangential drag ten times the "
    "bridges' nominal one removes eight tenths of that."
)
_LEVELS_OFF = (
    "It levels off from 7 g on, in the engine and in theory, where the large bead begins to slide. "
    "More drag or more liquid brings the ratio to 6 g within the bounds, too."
)


def _frequency_ratio(peak: float, told: str = "") -> Published:
    fast, slow = (_fig2(peak, frequencies=(frequency,)) for frequency in (90.0, 60.0))
    what = f"Fig. 2, v(90 Hz)/v(60 Hz) at {peak:g} g{told}"
    return _ratio("fig2_frequency", what, _RATIO_OF_FREQUENCIES, fast, slow)


# Bounds of Γ0 are the rounding of the published digits (0.735, of which 0.74 is made, is on its edge), those of angles
# are ours.
NUMBERS = (
    *(
        _speed(f"fig2_{g:g}g", f"Fig. 2, fit at {g:g} g, 60 to 90 Hz", v, _SPEED, _fig2(g), "velocity")
        for g, v in FIT.items()
    ),
    *(
        _gamma(f"fig2_gamma_{g:g}g", f"Fig. 2, Γ0 at {g:g} g", value, (value - 5e-4, value + 5e-4), _fig2(g))
        for g, value in ((2.0, 0.191), (3.0, 0.286), (4.0, 0.381), (5.0, 0.476), (6.0, 0.572))
    ),
    _frequency_ratio(PLATEAU, ": no significant dependence"),
    _ratio(
        "fig2_plateau",
        "Fig. 2, v(10 g)/v(6 g): a plateau from Γ0 ≈ 0.6 on",
        _LEVELS_OFF,
        _fig2(10.0),
        _fig2(PLATEAU),
    ),
    Published(
        "fig2_threshold",
        "Fig. 2, inset: Γc, in words: a threshold, below the least drive of the fit",
        None,
        "",
        (0.0, 0.191),
        depends_on=_THRESHOLD,
    ),
    Published(
        "fig2_threshold_frequency",
        "Fig. 2, inset: Γc(90 Hz)/Γc(60 Hz): independent within its uncertainties",
        1.0,
        "",
        depends_on=_THRESHOLD,
    ),
    *(
        _speed(
            f"fig3_{radii[0]:g}_{radii[1]:g}",
            f"Fig. 3, fit for R = {radii[0]:g}/{radii[1]:g} mm",
            v,
            _ASYMMETRY,
            (Point("fig3", radii, 80.0),),
            "velocity",
        )
        for radii, v in FIG3_FIT.items()
    ),
    _speed(
        "fig3_symmetric",
        "Fig. 3, a symmetric dimer does not walk",
        0.0,
        _TURNED,
        (Point("fig3", (0.25, 0.25), 80.0),),
        "velocity_of_all",
    ),
    _gamma("fig4a_gamma", "Fig. 4a, Γ0", 0.74, (0.7345, 0.745), FIG4["a"]),
    _speed("fig4a_velocity", "Fig. 4a, velocity", FIG4_VELOCITY[0], _FIG4A, FIG4["a"], "velocity"),
    _speed("fig4a_sliding", "Fig. 4a, large bead's mean sliding: hardly any", 0.0, _FIG4A, FIG4["a"], "sliding_1"),
    _gamma("fig4b_gamma", "Fig. 4b, Γ0", 3.5, (3.45, 3.55), FIG4["b"]),
    _speed("fig4b_velocity", "Fig. 4b, velocity", FIG4_VELOCITY[1], _FIG4B, FIG4["b"], "velocity"),
    *(
        _speed(f"fig4b_{name}", f"Fig. 4b, large bead's mean {name} velocity", value, _FIG4B, FIG4["b"], f"{name}_1")
        for name, value in (("rotation", FIG4B_ROTATION), ("sliding", FIG4B_SLIDING))
    ),
    Published(
        "alignment_asymmetric",
        "Asymmetric dimers align with the shaking axis: largest angle to it at the end",
        0.0,
        "°",
        (-10.0, 10.0),
        _TURNED,
    ),
    Published(
        "alignment_symmetric",
        "Symmetric dimers align across it: smallest angle to the axis at the end",
        90.0,
        "°",
        (80.0, 90.0),
        _TURNED,
    ),
    Published("mathieu", "Largest V of the paper's drives, at most", LARGEST_V, "", (0.0, LARGEST_V), measured=False),
    Published("mathieu_stable", "V up to which small angles stay small", STABLE_V, "", (0.445, 0.455), measured=False),
)
"""Every number that the paper publishes of walkers."""
BY_KEY = {number.key: number for number in NUMBERS}


def fitted() -> dict[str, Published]:
    """The numbers that the theory is fitted to (`walkers.paper.model_terms`) by their names there.

    Of walkers on the axis whose contacts stay closed: all that is published of Figs. 2, 3 and 4a, the frequency at 4 g
    and rest at 0.5 g besides.
    """
    rest = _speed("fig2_rest", "Fig. 2, at rest at 0.5 g", 0.0, _THRESHOLD, _fig2(0.5), "velocity")
    return {
        **{f"Fig. 2, {g:g} g": BY_KEY[f"fig2_{g:g}g"] for g in FIT},
        "Fig. 2, plateau": BY_KEY["fig2_plateau"],
        **{f"Fig. 2, frequency at {peak:g} g": _frequency_ratio(peak) for peak in (4.0, PLATEAU)},
        "Fig. 2, rest at 0.5 g": rest,
        **{f"Fig. 3, {r1:g}/{r2:g} mm": BY_KEY[f"fig3_{r1:g}_{r2:g}"] for r1, r2 in FIG3_FIT},
        "Fig. 4a, velocity": BY_KEY["fig4a_velocity"],
        "Fig. 4a, sliding": BY_KEY["fig4a_sliding"],
    }
