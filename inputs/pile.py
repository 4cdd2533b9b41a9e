"""A resolved pile: wet beads of two size classes in a shaken container. SI units, nothing left to look up."""

from __future__ import annotations

from dataclasses import dataclass, is_dataclass
from math import cos, hypot, inf, pi, sin
from typing import Any, Literal

from walkers.inputs.case import without_no_film
from walkers.inputs.drive import Drive, Vector
from walkers.physics.matter import Contact, Liquid


@dataclass(frozen=True)
class Container:
    """An upright container, open above, its floor the plane z = 0 about the origin.

    Attributes
    ----------
    shape
        ``box`` with a square cross-section, or ``cylinder``.
    width
        Inner side or diameter, m.
    height
        m; the walls of the simulation go on above it, to twice that height, where beads are lost.
    material
        Of the walls.
    """

    shape: Literal["box", "cylinder"]
    width: float
    height: float
    material: str

    @property
    def cross_section(self) -> float:
        """Inner area, m²."""
        return self.width**2 * (1.0 if self.shape == "box" else pi / 4.0)


@dataclass(frozen=True)
class PileBeads:
    """The beads, by class.

    Attributes
    ----------
    small, large
        Radii of either class, m, each occurring equally often (the engine is given no distributions), unless the beads
        are placed: then the different radii, and ``large`` may be empty.
    counts
        Number of small and of large beads.
    density
        kg/m³.
    material
        Name, or None.
    placed
        x, y, z (m, from the middle of the floor) and radius (m) of every bead, where they are placed one by one instead
        of poured.
    """

    small: tuple[float, ...]
    large: tuple[float, ...]
    counts: tuple[int, int]
    density: float
    material: str | None
    placed: tuple[tuple[float, float, float, float], ...] = ()

    @property
    def radii(self) -> list[float]:
        """Radius of every bead, m: the small ones first, or in the order in which they are placed."""
        if self.placed:
            return [bead[3] for bead in self.placed]
        small, large = ([sizes[number % len(sizes)] for number in range(count)] for sizes, count in self.classes)
        return small + large

    @property
    def classes(self) -> tuple[tuple[tuple[float, ...], int], tuple[tuple[float, ...], int]]:
        """Radii and number of the small and of the large beads."""
        return (self.small, self.counts[0]), (self.large, self.counts[1])

    @property
    def border(self) -> float:
        """A radius between the two classes, m; infinite where there is but one."""
        return (max(self.small) + min(self.large)) / 2.0 if self.large else inf


SIDES = 24
"""Of the prism that stands for a cylinder in the engine; its edges lie 0.9 % of the radius beyond its faces."""


def turns_of_sides() -> list[float]:
    """Directions in which the faces of a cylinder's prism lie, rad about the axis."""
    return [2.0 * pi * (number + 0.5) / SIDES for number in range(SIDES)]


def distance_from_axis(container: Container, x: float, y: float) -> float:
    """How far a place has come toward the nearest side, m: at half of the width it is on it."""
    if container.shape == "box":
        return max(abs(x), abs(y))
    return max(x * cos(turn) + y * sin(turn) for turn in turns_of_sides())


LOOSE = 1.03
"""Pitch of the places at the start, in diameters of the largest bead."""


def lattice_pitch(container: Container, largest: float) -> float:
    """Distance of the places of a layer at the start, m, for a largest bead of this radius (m)."""
    return container.width / max(int(container.width / (2.0 * LOOSE * largest)), 1)


def lattice(beads: PileBeads, container: Container) -> tuple[list[tuple[float, float]], float]:
    """Where beads begin: the places of a layer (m, from the axis), and the height of all layers (m)."""
    largest, reach = max(beads.large + beads.small), container.width / 2.0
    across, pitch = int(container.width / (2.0 * LOOSE * largest)), lattice_pitch(container, largest)
    line = [(index + 0.5) * pitch - reach for index in range(across)]
    grid = [(x, y) for x in line for y in line]
    if container.shape == "cylinder":
        grid = [(x, y) for x, y in grid if hypot(x, y) <= reach - LOOSE * largest]
    layers = -(-sum(beads.counts) // max(len(grid), 1))
    return grid, layers * 2.0 * LOOSE * largest


@dataclass(frozen=True)
class PileRun:
    """How long, how fine and in which segments.

    Attributes
    ----------
    time_step
        s.
    steps_per_cycle
        Of the drive.
    cycles
        Driven, after the settling.
    cycles_per_segment
        The run is made in segments of so many cycles, each with a restart file at its end.
    frames_per_cycle, cycles_per_frame
        Beads and bridges are recorded this often a cycle, or once in so many cycles; one of them is 1.
    settled_below
        Root mean square velocity of the beads, m/s, below which the pile counts as settled.
    longest_settling
        s; the drive begins then at the latest.
    ranks
        MPI processes.
    """

    time_step: float
    steps_per_cycle: int
    cycles: int
    cycles_per_segment: int
    frames_per_cycle: int
    cycles_per_frame: int
    settled_below: float
    longest_settling: float
    ranks: int

    @property
    def steps_per_frame(self) -> int:
        """Steps between frames."""
        return self.steps_per_cycle * self.cycles_per_frame // self.frames_per_cycle


@dataclass(frozen=True)
class PileCase:
    """A wet bidisperse pile in a vertically shaken container, resolved.

    ``name`` and ``title`` do not determine the run and stay out of `determinants`.
    """

    name: str
    title: str
    container: Container
    beads: PileBeads
    liquid: Liquid
    contact: Contact
    drive: Drive
    seed: int
    run: PileRun
    gravity: float

    @property
    def gravity_vector(self) -> Vector:
        """Acceleration of gravity, m/s²."""
        return (0.0, 0.0, -self.gravity)

    def determinants(self) -> dict[str, Any]:
        """Everything that the run's outcome depends on, as plain JSON types."""
        told = {
            key: _plain(dict(vars(value))) if is_dataclass(value) else value
            for key, value in vars(self).items()
            if key not in ("name", "title")
        }
        if not self.beads.placed:
            del told["beads"]["placed"]
        told["drive"] = self.drive.as_dict()
        without_no_film(told["liquid"])
        return told

    def as_dict(self) -> dict[str, Any]:
        """The whole case as plain JSON types, SI units."""
        return {"name": self.name, "title": self.title, **self.determinants()}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> PileCase:
        """Rebuild a case from `as_dict` (a run directory's ``case.json``)."""
        beads = {**values["beads"], **{key: tuple(values["beads"][key]) for key in ("small", "large", "counts")}}
        beads["placed"] = tuple(tuple(bead) for bead in beads.get("placed", ()))
        return cls(
            **{key: values[key] for key in ("name", "title", "seed", "gravity")},
            container=Container(**values["container"]),
            beads=PileBeads(**beads),
            liquid=Liquid(**values["liquid"]),
            contact=Contact(**values["contact"]),
            drive=Drive.from_dict(values["drive"]),
            run=PileRun(**values["run"]),
        )


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    return {key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}
