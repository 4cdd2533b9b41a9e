"""Benchmark tests of Chung and Ooi for contact models: impacts of spheres.

The second engine computes the impacts. They are compared with closed forms and with the published
points of ``chung_ooi.toml``. The closed forms are Hertz's impact, and gross sliding, in which the
surfaces slide during the whole contact and friction is μ times the elastic repulsion.

``chung_ooi.toml`` marks the points that are not judged. They contradict each other, or they are
measurements and finite elements that contain the micro-slip in the contact, which Mindlin's spring
leaves out.

References
----------
Y. C. Chung, J. Y. Ooi, Granular Matter 13 (2011) 643-656.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from math import ceil, pi
from typing import Any, NamedTuple

import numpy as np

from walkers.arrays import FloatArray
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.materials import Friction, Roughness
from walkers.inputs.tables.shapes.walls import BOTTOM
from walkers.physics.contact import Impact, reduced_modulus
from walkers.second_engine.engine import SecondEngine
from walkers.second_engine.lines import Line
from walkers.second_engine.scenes import DRY, bench_case

READING = 0.02
"""Tolerance of a point that was read off a printed figure, over the length of its axis."""

STEP = 2e-3
"""Relative tolerance of forces and durations, with a thousand steps in a contact."""

SLIDING = 4e-3
"""Tolerance of gross sliding, over the length of the axis.

It covers the step at which a contact begins to slip, and the overlap, which shortens the lever arm
of friction.
"""

_RESTITUTION = 5e-3
"""Tolerance of the coefficient of restitution."""

_X = 0
"""Column of the place along x in frames of the second engine."""

_Z = 2
"""Column of the height."""

_VX = 3
"""Column of the velocity along x."""

_VZ = 5
"""Column of the upward velocity."""

_SPIN_Y = 7
"""Column of the angular velocity about y, which is positive for spheres that roll along x."""

_STEPS_PER_CONTACT = 1000
"""Time steps in the shortest contact of a benchmark."""

_SIMULATED_CONTACTS = 1.5
"""Length of a simulation over the longest elastic contact; damped contacts last longer."""

_SPACING = 4.0
"""Distance between the spheres that are simulated at the same time, in radii."""

_HEIGHT_OF_PAIRS = 6.0
"""Additional height of spheres that hit each other, so that they miss the plane, in radii."""


@dataclass(frozen=True)
class Sphere:
    """Material and size of a sphere."""

    youngs_modulus: float
    """Pa."""
    poissons_ratio: float
    density: float
    """kg/m³."""
    radius: float
    """m."""

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return self.density * 4.0 / 3.0 * pi * self.radius**3


class Speeds(NamedTuple):
    """Speeds of N spheres at a plane, arrays of shape (N,), m/s."""

    normal: FloatArray
    """Speed of the centre: toward the plane before an impact, away from it afterwards."""
    tangential: FloatArray
    """Speed of the centre along the plane."""
    rolling: FloatArray
    """Rω, the radius times the angular velocity."""

    @property
    def sliding(self) -> FloatArray:
        """Speed at which the surfaces slide on each other at the contact, m/s."""
        return self.tangential - self.rolling


class Benchmark:
    """Impacts of spheres of one kind, which the second engine computes in one simulation.

    Parameters
    ----------
    sphere
        Material and size of the spheres.
    normal, tangential, rolling
        Speeds before the impact as in `Speeds`: numbers, or arrays of shape (N,) for N impacts.
    restitution
        Coefficient of restitution e.
    friction
        Coefficient of friction μ.
    pair
        Whether each sphere hits an equal sphere that moves and spins against it, instead of a rigid
        plane.
    """

    def __init__(  # noqa: PLR0913
        self,
        sphere: Sphere,
        *,
        normal: float | FloatArray,
        tangential: float | FloatArray = 0.0,
        rolling: float | FloatArray = 0.0,
        restitution: float = 1.0,
        friction: float = 0.0,
        pair: bool = False,
    ) -> None:
        self.sphere = sphere
        self.restitution = restitution
        self.friction = friction
        self.pair = pair
        speeds = np.broadcast_arrays(np.atleast_1d(normal), tangential, rolling)
        self.before = Speeds(*np.array(speeds, np.float64))
        self.closing = 2.0 * self.before.normal if pair else self.before.normal
        modulus = reduced_modulus(sphere.youngs_modulus, sphere.poissons_ratio)
        if pair:
            self.impact = Impact(sphere.mass / 2.0, sphere.radius / 2.0, modulus)
        else:
            # At a rigid plane, E* = E/(1-ν²): twice the value for two bodies of this modulus.
            self.impact = Impact(sphere.mass, sphere.radius, 2.0 * modulus)
        self.step = self.impact.duration(float(self.closing.max())) / _STEPS_PER_CONTACT

    @cached_property
    def frames(self) -> FloatArray:
        """Position, velocity and spin of the spheres, SI units, shape (frames, N, 9).

        A single sphere has a frame at each time step, several spheres have only the last one.
        """
        count = len(self.before.normal)
        longest = self.impact.duration(float(self.closing.min()))
        steps = ceil(_SIMULATED_CONTACTS * longest / self.step)
        start = self._start()
        radii = np.full(len(start), self.sphere.radius)
        engine = SecondEngine(self._case(), radii, start, walls=[BOTTOM])
        steps_per_frame = 1 if count == 1 else steps
        return engine.run(steps, steps_per_frame)[:, :count]

    def _start(self) -> FloatArray:
        """Position, velocity and spin of the N spheres at the first touch, SI units, shape (N, 9).

        In pairs, the N spheres that they hit follow: shape (2 N, 9).
        """
        count = len(self.before.normal)
        radius = self.sphere.radius
        start = np.zeros((count, 9))
        start[:, _X] = _SPACING * radius * np.arange(count)
        start[:, _Z] = radius
        start[:, _VX] = self.before.tangential
        start[:, _VZ] = -self.before.normal
        start[:, _SPIN_Y] = self.before.rolling / radius
        if not self.pair:
            return start
        start[:, _Z] += _HEIGHT_OF_PAIRS * radius
        hit = start.copy()
        hit[:, _Z] -= 2.0 * radius
        hit[:, [_VX, _VZ, _SPIN_Y]] *= -1.0
        return np.concatenate([start, hit])

    def _case(self) -> Case:
        """A case without bridges that has the contacts of the spheres."""
        # A wall is as soft as a bead; with twice the modulus, the contact is that of a rigid plane.
        stiffening = 1.0 if self.pair else 2.0
        case = (
            bench_case(DRY)
            .with_value_at("beads.density", self.sphere.density)
            .with_value_at("run.time_step", self.step)
        )
        roughness = 0.01 * self.sphere.radius  # required, but only liquid feels it
        contact = case.contact.with_values(
            friction=Friction(bead_bead=self.friction, bead_wall=self.friction),
            restitution=self.restitution,
            youngs_modulus=stiffening * self.sphere.youngs_modulus,
            poissons_ratio=self.sphere.poissons_ratio,
            roughness=Roughness(bead_bead=roughness, bead_wall=roughness),
        )
        return case.with_values(contact=contact)

    @property
    def after(self) -> Speeds:
        """Speeds after the impact by the second engine."""
        frame = self.frames[-1]
        return Speeds(frame[:, _VZ], frame[:, _VX], self.sphere.radius * frame[:, _SPIN_Y])

    def after_gross_sliding(self) -> Speeds:
        """Speeds after an impact on the plane in which the surfaces slide all the time."""
        normal, tangential, rolling = self.before
        direction = np.sign(self.before.sliding)
        # Over the mass. It changes Rω by mR²/I = 5/2 times as much for a solid sphere.
        impulse = self.friction * (1.0 + self.restitution) * normal * direction
        return Speeds(self.restitution * normal, tangential - impulse, rolling + 2.5 * impulse)

    def force_against_time(self) -> tuple[FloatArray, FloatArray]:
        """Time since the first touch (s) and force (N) of a single sphere, shape (frames,) each."""
        mass = 2.0 * self.impact.mass if self.pair else self.impact.mass
        force: FloatArray = mass * np.gradient(self.frames[:, 0, _VZ], self.step)
        time: FloatArray = self.step * np.arange(1.0, len(self.frames) + 1.0)
        return time, force

    def duration(self) -> float:
        """Time from the first touch to the separation of a single sphere, s."""
        height = self.frames[:, 0, _Z]
        depth = height[0] - height - self.frames[0, 0, _VZ] * self.step
        last = int(np.flatnonzero(depth > 0.0)[-1])
        share_of_step = float(depth[last] / (depth[last] - depth[last + 1]))
        return self.step * (last + 1 + share_of_step)


# --- tests and figures of the paper ---------------------------------------------------------------

_GLASS = Sphere(4.8e10, 0.20, 2800.0, 0.01)
_LIMESTONE = Sphere(2.0e10, 0.25, 2500.0, 0.01)
_LIGHT_ALLOY = Sphere(7.0e10, 0.30, 2699.0, 0.1)
_MAGNESIUM_ALLOY = Sphere(4.0e10, 0.35, 1800.0, 0.1)
_OXIDE = Sphere(3.8e11, 0.23, 4000.0, 2.5e-3)
_IRON = Sphere(1.0e11, 0.25, 7000.0, 2.5e-3)
_SMALL_ALLOY = Sphere(7.0e10, 0.33, 2700.0, 2.5e-3)
_STEEL = Sphere(2.08e11, 0.30, 7850.0, 1e-5)
_ALLOY = Sphere(7.0e10, 0.33, 2700.0, 0.1)

_DEGREES = np.arange(2.0, 87.5, 0.5)
"""Angles of impact of test 4, from the normal of the plane, degrees."""

_TANGENTIAL = np.arange(0.05, 20.01, 0.05)
"""Tangential speeds of test 5, over friction times normal speed."""

_SPIN = np.geomspace(0.17, 25.0, 300)
"""Test 6: the change of the sliding speed in gross sliding over the initial sliding speed."""


def _impacts_by_restitution(name: str, sphere: Sphere) -> dict[str, Benchmark]:
    """Test 3: normal impacts with five coefficients of restitution."""
    tests = {}
    for restitution in (0.2, 0.4, 0.6, 0.8, 1.0):
        test = Benchmark(sphere, normal=3.9, restitution=restitution)
        tests[f"3: {name}, {restitution:g}"] = test
    return tests


def _oblique_impacts(sphere: Sphere) -> Benchmark:
    """Test 4: impacts at 3.9 m/s from all directions."""
    angles = np.radians(_DEGREES)
    return Benchmark(
        sphere,
        normal=3.9 * np.cos(angles),
        tangential=3.9 * np.sin(angles),
        restitution=0.98,
        friction=0.092,
    )


TESTS: Mapping[str, Benchmark] = {
    "1: glass": Benchmark(_GLASS, normal=10.0, pair=True),
    "1: limestone": Benchmark(_LIMESTONE, normal=10.0, pair=True),
    "2: alloy": Benchmark(_LIGHT_ALLOY, normal=0.2),
    "2: magnesium alloy": Benchmark(_MAGNESIUM_ALLOY, normal=0.2),
    **_impacts_by_restitution("oxide", _OXIDE),
    **_impacts_by_restitution("cast iron", _IRON),
    "4: oxide": _oblique_impacts(_OXIDE),
    "4: alloy": _oblique_impacts(_SMALL_ALLOY),
    "5: steel": Benchmark(_STEEL, normal=5.0, tangential=_TANGENTIAL * 0.3 * 5.0, friction=0.3),
    # An impulse changes the speed of the surface 3.5 times as much as the speed of the centre.
    "6: alloy": Benchmark(
        _ALLOY,
        normal=0.2,
        rolling=-3.5 * 0.4 * 1.5 * 0.2 / _SPIN,
        restitution=0.5,
        friction=0.4,
    ),
    "7: alloy": Benchmark(
        _ALLOY, normal=0.2, rolling=20.0 * 0.1, restitution=0.5, friction=0.4, pair=True
    ),
}
"""Impacts by the number of the test and the material.

Test 8 is test 6 with a second sphere instead of the plane, so stiff and large that it is a plane.
"""

PEAKS = {"1: limestone": 7108.0, "2: magnesium alloy": 7233.0}
"""Published largest forces, N."""


@dataclass(frozen=True)
class Panel:
    """A figure of the paper that shows N impacts."""

    test: str
    """Name of the impacts in `TESTS`."""
    x: FloatArray
    """Abscissae, shape (N,)."""
    y: Callable[[Benchmark, Speeds], FloatArray]
    """Gives the ordinates, shape (N,), from the impacts and the speeds after them."""
    slides: tuple[float, float]
    """Open interval of x in which the surfaces slide during the whole contact."""


def _tangential_restitution(test: Benchmark, after: Speeds) -> FloatArray:
    return after.tangential / test.before.tangential


def _spin_after(test: Benchmark, after: Speeds) -> FloatArray:
    """Angular velocity, rad/s."""
    return -after.rolling / test.sphere.radius


def _rebound_angle(_test: Benchmark, after: Speeds) -> FloatArray:
    """Direction of the velocity of the surface at the contact, degrees from the normal."""
    angles: FloatArray = np.degrees(np.arctan(after.sliding / after.normal))
    return angles


def _steel_sliding(_test: Benchmark, after: Speeds) -> FloatArray:
    return after.sliding / (0.3 * after.normal)


def _steel_spin(_test: Benchmark, after: Speeds) -> FloatArray:
    return -after.rolling / (0.3 * 5.0)


def _sliding_restitution(test: Benchmark, after: Speeds) -> FloatArray:
    return -after.sliding / test.before.sliding


_SLIDING_DEGREES = (36.0, 90.0)
"""A rigid sphere slides during the whole contact from tan 32.5° = 7/2 μ(1+e) on."""

PANELS: Mapping[str, Panel] = {
    "oxide-restitution": Panel("4: oxide", _DEGREES, _tangential_restitution, _SLIDING_DEGREES),
    "oxide-spin": Panel("4: oxide", _DEGREES, _spin_after, _SLIDING_DEGREES),
    "oxide-rebound": Panel("4: oxide", _DEGREES, _rebound_angle, _SLIDING_DEGREES),
    "alloy-restitution": Panel("4: alloy", _DEGREES, _tangential_restitution, _SLIDING_DEGREES),
    "alloy-spin": Panel("4: alloy", _DEGREES, _spin_after, _SLIDING_DEGREES),
    "steel-surface": Panel("5: steel", _TANGENTIAL, _steel_sliding, (7.0, 21.0)),
    "steel-spin": Panel("5: steel", _TANGENTIAL, _steel_spin, (7.0, 21.0)),
    "spin": Panel("6: alloy", _SPIN, _sliding_restitution, (0.0, 0.9)),
}
"""Figures by key of ``chung_ooi.toml``."""


def published() -> dict[str, Any]:
    """The figures of ``chung_ooi.toml``, with the points of each series as an array (N, 2)."""
    text = files("studies.literature").joinpath("chung_ooi.toml").read_text("utf-8")
    figures = tomllib.loads(text)
    for figure in figures.values():
        for series in figure["series"]:
            series["points"] = np.array(series["points"], dtype=np.float64)
    return figures


def curve_of(key: str) -> tuple[FloatArray, FloatArray]:
    """Compute the curve of the second engine for a figure.

    Parameters
    ----------
    key
        Key of the figure in ``chung_ooi.toml``.

    Returns
    -------
    x, y
        Abscissae and ordinates in the units of the figure, shape (N,) each.
    """
    if key in PANELS:
        panel = PANELS[key]
        test = TESTS[panel.test]
        return panel.x, panel.y(test, test.after)
    # The other figures show the force on a single sphere; their titles begin with "test 1:" or so.
    number = published()[key]["title"][5]
    time, force = TESTS[f"{number}: {key}"].force_against_time()
    return time * 1e6, force / 1e3


# --- comparisons ----------------------------------------------------------------------------------


def largest_difference(
    title: str, differences: FloatArray, tolerance: float, x: FloatArray | None = None
) -> Line:
    """Compare the largest of several differences with zero.

    Parameters
    ----------
    title
        What is compared.
    differences
        Differences of either sign, shape (N,), in the unit of ``tolerance``.
    tolerance
        Largest absolute difference that passes.
    x
        Abscissae of the differences, shape (N,). If given, the title names that of the largest one.

    Returns
    -------
    Line
        The difference with the largest absolute value, with its sign.
    """
    worst = int(np.argmax(np.abs(differences)))
    if x is not None:
        title += f": largest deviation, at {x[worst]:g}, over the axis"
    return Line(title, 0.0, float(differences[worst]), tolerance)


def benchmarks() -> Iterator[Line]:
    """Compare the tests with closed forms and with the published points."""
    for name, test in TESTS.items():
        yield from _compare_with_closed_forms(name, test)
    figures = published()
    for key, panel in PANELS.items():
        yield _compare_gross_sliding(key, panel, figures[key]["axis"])
    for key, figure in figures.items():
        yield from _compare_with_points(key, figure)


def _compare_with_closed_forms(name: str, test: Benchmark) -> Iterator[Line]:
    """Restitution, Hertz's force and duration of elastic impacts, and no sliding in pairs."""
    difference = test.after.normal / test.before.normal - test.restitution
    yield largest_difference(f"{name}, restitution", difference, _RESTITUTION)
    if len(test.before.normal) == 1 and test.restitution == 1.0:
        yield from _compare_with_hertz(name, test)
    if test.pair:
        title = f"{name}, change of the tangential speed over the normal"
        change = (test.after.tangential - test.before.tangential) / test.before.normal
        yield largest_difference(title, change, 1e-6)
        title = f"{name}, change of the rolling speed over the normal"
        change = (test.after.rolling - test.before.rolling) / test.before.normal
        yield largest_difference(title, change, 1e-6)


def _compare_with_hertz(name: str, test: Benchmark) -> Iterator[Line]:
    """Largest force and duration of an elastic impact, and the published force if there is one."""
    hertz = test.impact
    closing = float(test.closing[0])
    _, force = test.force_against_time()
    peak = float(force.max())
    yield Line(f"{name}, largest force (Hertz)", hertz.peak_force(closing), peak, STEP, "N")
    yield Line(f"{name}, duration (Hertz)", hertz.duration(closing), test.duration(), STEP, "s")
    if name in PEAKS:
        yield Line(f"{name}, largest force (published)", PEAKS[name], peak, STEP, "N")


def _compare_gross_sliding(key: str, panel: Panel, axis: float) -> Line:
    """Ordinates of a figure where the surfaces slide all the time, over the length of its axis."""
    test = TESTS[panel.test]
    lowest, highest = panel.slides
    slides = (lowest < panel.x) & (panel.x < highest)
    expected = panel.y(test, test.after_gross_sliding())[slides] / axis
    computed = panel.y(test, test.after)[slides] / axis
    title = f"{panel.test[0]}: {key}, gross sliding: largest deviation over the axis"
    return largest_difference(title, computed - expected, SLIDING)


def _compare_with_points(key: str, figure: Mapping[str, Any]) -> Iterator[Line]:
    """The published points of a figure that are judged, over the length of its axis."""
    number = figure["title"].split()[1].rstrip(":")
    for series in figure["series"]:
        judged = series.get("judged", [-np.inf, np.inf])
        if not judged:
            continue
        x, y = series["points"].T
        inside = (judged[0] <= x) & (x < judged[1])
        difference = np.interp(x[inside], *curve_of(key)) - y[inside]
        title = f"{number}: {key}, {series['name']}"
        yield largest_difference(title, difference / figure["axis"], READING, x[inside])
