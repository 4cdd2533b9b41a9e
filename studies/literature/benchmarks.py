"""The benchmark tests of Chung and Ooi for contact models: the second engine, closed forms and the published points.

Closed forms are Hertz's impact and gross sliding, in which friction is μ times the elastic repulsion during the whole
contact. Points that are not judged (``chung_ooi.toml``) are measurements and finite elements beside a model that leaves
out the micro-slip in the contact, which Mindlin's spring does not have, or contradict each other.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from importlib.resources import files
from math import ceil, pi
from typing import Any, NamedTuple

import numpy as np

from walkers.arrays import FloatArray
from walkers.inputs.tables.materials import Friction, Roughness
from walkers.inputs.tables.shapes.walls import BOTTOM
from walkers.physics.contact import Impact, reduced_modulus
from walkers.second_engine.engine import SecondEngine
from walkers.second_engine.lines import Line
from walkers.second_engine.scenes import DRY, bench_case

READING, STEP, SLIDING = 0.02, 2e-3, 4e-3
"""Tolerances: a point of a printed figure, over its axis; forces and durations at a thousand steps a contact; sliding,
over the axis, by the step at which a contact begins to slip and by the arm of friction, which the overlap shortens."""
_STEPS, _LONGEST = 1000, 1.5
"""Steps of the shortest contact; length of a simulation over the longest elastic contact (damped ones are longer)."""


class Sphere(NamedTuple):
    """Young's modulus (Pa), Poisson's ratio, density (kg/m³) and radius (m) of a sphere."""

    youngs_modulus: float
    poissons_ratio: float
    density: float
    radius: float


class Speeds(NamedTuple):
    """Speeds of N spheres at a plane, arrays of shape (N,), m/s.

    ``normal`` is the speed of the centre toward or away from the plane, ``tangential`` its speed along the plane, and
    ``rolling`` is Rω: the surface at the contact slides at the difference of the last two.
    """

    normal: FloatArray
    tangential: FloatArray
    rolling: FloatArray

    @property
    def sliding(self) -> FloatArray:
        """Sliding velocity of the surfaces at the contact, m/s."""
        return self.tangential - self.rolling


class Benchmark:
    """Impacts of spheres on a rigid plane, or of each on its ``like`` that moves and spins against it.

    The speeds are those of `Speeds`, numbers and arrays that broadcast.
    """

    def __init__(
        self,
        sphere: Sphere,
        *speeds: Any,
        e: float = 1.0,
        friction: float = 0.0,
        like: bool = False,
    ) -> None:
        self.before = Speeds(
            *np.array(np.broadcast_arrays(*map(np.atleast_1d, speeds)), np.float64)
        )
        self.sphere, self.restitution, self.friction, self.like = sphere, e, friction, like
        self.closing = (2.0 if like else 1.0) * self.before.normal
        mass = sphere.density * 4.0 / 3.0 * pi * sphere.radius**3
        halves, modulus = (
            2.0 if like else 1.0,
            reduced_modulus(sphere.youngs_modulus, sphere.poissons_ratio),
        )
        # At a rigid plane, E* = E/(1-ν²), twice the value for two bodies of this modulus.
        self.impact = Impact(mass / halves, sphere.radius / halves, 2.0 * modulus / halves)
        self.step = self.impact.duration(float(self.closing.max())) / _STEPS

    @cached_property
    def frames(self) -> FloatArray:
        """Position, velocity and spin of the spheres at each step, shape (steps, N, 9)."""
        count, radius = len(self.before.normal), self.sphere.radius
        start = np.zeros((count, 9))
        start[:, 0], start[:, 2] = 4.0 * radius * np.arange(count), radius
        normal, tangential, rolling = self.before
        start[:, 3], start[:, 5], start[:, 7] = tangential, -normal, rolling / radius
        if self.like:  # far above the plane
            start[:, 2] += 6.0 * radius
            start = np.concatenate(
                [start, start * [1, 1, 1, -1, 1, -1, 1, -1, 1] - [0, 0, 2 * radius, *[0] * 6]]
            )
        steps = ceil(_LONGEST * self.impact.duration(float(self.closing.min())) / self.step)
        case = (
            bench_case(DRY)
            .with_value_at("beads.density", self.sphere.density)
            .with_value_at("run.time_step", self.step)
        )
        contact = case.contact.with_values(
            friction=Friction(bead_bead=self.friction, bead_wall=self.friction),
            restitution=self.restitution,
            youngs_modulus=(1.0 if self.like else 2.0)
            * self.sphere.youngs_modulus,  # the other side of a rigid plane
            poissons_ratio=self.sphere.poissons_ratio,
            roughness=Roughness(bead_bead=0.01 * radius, bead_wall=0.01 * radius),
        )
        engine = SecondEngine(
            case.with_values(contact=contact), np.full(len(start), radius), start, walls=[BOTTOM]
        )
        every = 1 if count == 1 else steps
        return engine.run(steps, every)[:, :count]

    @property
    def after(self) -> Speeds:
        """Speeds after the impact."""
        frame = self.frames[-1]
        return Speeds(frame[:, 5], frame[:, 3], self.sphere.radius * frame[:, 7])

    def sliding(self) -> Speeds:
        """Speeds after an impact on the plane in which the surfaces slide all the time."""
        impulse = (
            self.friction
            * (1.0 + self.restitution)
            * self.before.normal
            * np.sign(self.before.sliding)
        )
        normal, tangential, rolling = self.before
        return Speeds(self.restitution * normal, tangential - impulse, rolling + 2.5 * impulse)

    def course(self) -> tuple[FloatArray, FloatArray]:
        """Time since the touch (s) and force (N) of a single sphere at each step."""
        mass = self.impact.mass * (2.0 if self.like else 1.0)
        force: FloatArray = mass * np.gradient(self.frames[:, 0, 5], self.step)
        time: FloatArray = self.step * np.arange(1.0, len(self.frames) + 1.0)
        return time, force

    def duration(self) -> float:
        """Time from the touch to the separation of a single sphere, s."""
        depth = self.frames[0, 0, 2] - self.frames[:, 0, 2] - self.frames[0, 0, 5] * self.step
        last = int(np.flatnonzero(depth > 0.0)[-1])
        return self.step * (last + 1 + float(depth[last] / (depth[last] - depth[last + 1])))


_GLASS, _LIMESTONE = Sphere(4.8e10, 0.20, 2800.0, 0.01), Sphere(2.0e10, 0.25, 2500.0, 0.01)
_OXIDE, _IRON = Sphere(3.8e11, 0.23, 4000.0, 2.5e-3), Sphere(1.0e11, 0.25, 7000.0, 2.5e-3)
_STEEL, _ALLOY = Sphere(2.08e11, 0.30, 7850.0, 1e-5), Sphere(7.0e10, 0.33, 2700.0, 0.1)
_DEGREES = np.arange(2.0, 87.5, 0.5)
_OBLIQUE = 3.9 * np.cos(np.radians(_DEGREES)), 3.9 * np.sin(np.radians(_DEGREES)), 0.0
_ALONG = np.arange(0.05, 20.01, 0.05)
_SPIN = np.geomspace(0.17, 25.0, 300)
TESTS: Mapping[str, Benchmark] = {
    "1: glass": Benchmark(_GLASS, 10.0, 0.0, 0.0, like=True),
    "1: limestone": Benchmark(_LIMESTONE, 10.0, 0.0, 0.0, like=True),
    "2: alloy": Benchmark(Sphere(7.0e10, 0.30, 2699.0, 0.1), 0.2, 0.0, 0.0),
    "2: magnesium alloy": Benchmark(Sphere(4.0e10, 0.35, 1800.0, 0.1), 0.2, 0.0, 0.0),
    **{
        f"3: oxide, {e:g}": Benchmark(_OXIDE, 3.9, 0.0, 0.0, e=e) for e in (0.2, 0.4, 0.6, 0.8, 1.0)
    },
    **{
        f"3: cast iron, {e:g}": Benchmark(_IRON, 3.9, 0.0, 0.0, e=e)
        for e in (0.2, 0.4, 0.6, 0.8, 1.0)
    },
    "4: oxide": Benchmark(_OXIDE, *_OBLIQUE, e=0.98, friction=0.092),
    "4: alloy": Benchmark(Sphere(7.0e10, 0.33, 2700.0, 2.5e-3), *_OBLIQUE, e=0.98, friction=0.092),
    "5: steel": Benchmark(_STEEL, 5.0, _ALONG * 0.3 * 5.0, 0.0, friction=0.3),
    # An impulse changes the velocity of the surface 3.5 times as much as the velocity of the centre.
    "6: alloy": Benchmark(_ALLOY, 0.2, 0.0, -3.5 * 0.4 * 1.5 * 0.2 / _SPIN, e=0.5, friction=0.4),
    "7: alloy": Benchmark(_ALLOY, 0.2, 0.0, 20.0 * 0.1, e=0.5, friction=0.4, like=True),
}
"""Sphere, speeds, restitution and friction by the number of the test and the material. Test 8 is test 6 with a second
sphere instead of the plane, so stiff and large that it is one."""
PEAKS = {"1: limestone": 7108.0, "2: magnesium alloy": 7233.0}
"""Published largest forces, N."""


class Panel(NamedTuple):
    """A figure of the paper: test, x (of the spheres), y (from speeds after the impact), and the x of gross sliding."""

    test: str
    x: FloatArray
    y: Callable[[Benchmark, Speeds], FloatArray]
    slides: tuple[float, float]


_OF_TEST_4: dict[str, Callable[[Benchmark, Speeds], FloatArray]] = {
    "restitution": lambda test, after: after.tangential / test.before.tangential,
    "spin": lambda test, after: -after.rolling / test.sphere.radius,
    "rebound": lambda _, after: np.degrees(np.arctan(after.sliding / after.normal)),
}
PANELS: Mapping[str, Panel] = {
    # A rigid sphere begins to slide all the time at tan 32.5° = 7/2 μ(1+e).
    **{
        f"oxide-{name}": Panel("4: oxide", _DEGREES, y, (36.0, 90.0))
        for name, y in _OF_TEST_4.items()
    },
    **{
        f"alloy-{name}": Panel("4: alloy", _DEGREES, _OF_TEST_4[name], (36.0, 90.0))
        for name in ("restitution", "spin")
    },
    "steel-surface": Panel(
        "5: steel", _ALONG, lambda _, after: after.sliding / (0.3 * after.normal), (7.0, 21.0)
    ),
    "steel-spin": Panel(
        "5: steel", _ALONG, lambda _, after: -after.rolling / (0.3 * 5.0), (7.0, 21.0)
    ),
    "spin": Panel(
        "6: alloy", _SPIN, lambda test, after: -after.sliding / test.before.sliding, (0.0, 0.9)
    ),
}
"""By key of ``chung_ooi.toml``."""


def published() -> dict[str, Any]:
    """The panels of ``chung_ooi.toml``, points as arrays of shape (N, 2)."""
    panels = tomllib.loads(
        files("studies.literature").joinpath("chung_ooi.toml").read_text("utf-8")
    )
    for panel in panels.values():
        for series in panel["series"]:
            series["points"] = np.array(series["points"], dtype=np.float64)
    return panels


def curve_of(key: str) -> tuple[FloatArray, FloatArray]:
    """X and y of the second engine, for a panel of ``chung_ooi.toml``."""
    if key not in PANELS:
        time, force = TESTS[f"{published()[key]['title'][5]}: {key}"].course()
        return time * 1e6, force / 1e3
    panel = PANELS[key]
    return panel.x, panel.y(TESTS[panel.test], TESTS[panel.test].after)


def largest_difference(
    title: str, away: FloatArray, tolerance: float, at: FloatArray | None = None
) -> Line:
    """The largest of several differences, and ``at`` which of given places it is."""
    worst = int(np.argmax(np.abs(away)))
    title += "" if at is None else f": largest deviation, at {at[worst]:g}, over the axis"
    return Line(title, 0.0, float(away[worst]), tolerance)


def benchmarks() -> Iterator[Line]:
    """The tests beside closed forms and published numbers."""
    for name, test in TESTS.items():
        yield largest_difference(
            f"{name}, restitution", test.after.normal / test.before.normal - test.restitution, 5e-3
        )
        if len(test.before.normal) == 1 and test.restitution == 1.0:
            closing, peak = float(test.closing[0]), float(test.course()[1].max())
            yield Line(
                f"{name}, largest force (Hertz)", test.impact.peak_force(closing), peak, STEP, "N"
            )
            yield Line(
                f"{name}, duration (Hertz)",
                test.impact.duration(closing),
                test.duration(),
                STEP,
                "s",
            )
            if name in PEAKS:
                yield Line(f"{name}, largest force (published)", PEAKS[name], peak, STEP, "N")
        if test.like:  # the surfaces do not slide on each other
            for which in ("tangential", "rolling"):
                change = (
                    getattr(test.after, which) - getattr(test.before, which)
                ) / test.before.normal
                yield largest_difference(
                    f"{name}, change of the {which} speed over the normal", change, 1e-6
                )
    panels = published()
    for key, panel in PANELS.items():
        test, slides = TESTS[panel.test], (panel.slides[0] < panel.x) & (panel.x < panel.slides[1])
        axis = panels[key]["axis"]
        expected, values = (
            panel.y(test, speeds)[slides] / axis for speeds in (test.sliding(), test.after)
        )
        title = f"{panel.test[0]}: {key}, gross sliding: largest deviation over the axis"
        yield largest_difference(title, values - expected, SLIDING)
    for key, figure in panels.items():
        for series in figure["series"]:
            points, judged = series["points"], series.get("judged", [-np.inf, np.inf])
            if judged:
                within = points[(judged[0] <= points[:, 0]) & (points[:, 0] < judged[1])]
                title = f"{figure['title'].split()[1].rstrip(':')}: {key}, {series['name']}"
                away = np.interp(within[:, 0], *curve_of(key)) - within[:, 1]
                yield largest_difference(title, away / figure["axis"], READING, within[:, 0])
