"""A resolved case: every number in SI units, nothing left to look up.

This is what the deck is rendered from, what a run directory stores as ``case.json`` and what its hash is made of.
"""

from __future__ import annotations

from dataclasses import dataclass, is_dataclass, replace
from math import cos, hypot, sin
from typing import Any, Literal

from walkers.inputs.drive import AXES, Drive, Vector
from walkers.inputs.plane import Plane
from walkers.physics.matter import Contact, Liquid


@dataclass(frozen=True)
class Beads:
    """Radii (m) in the order of the case, density (kg/m³)."""

    radii: tuple[float, float]
    density: float
    material: str | None


def without_no_film(liquid: dict[str, Any]) -> None:
    """Leave out a film that is none, in place: what ran before there were films keeps its name."""
    if not liquid["film_viscosity"]:
        del liquid["film_viscosity"]


@dataclass(frozen=True)
class Start:
    """Where the walkers begin: angles in rad, gap (m, negative: touching; None: equilibrium), spacing (m)."""

    replicates: int
    facing: Literal["both", "right", "left"]
    angle: float
    angle_spread: float
    gap: float | None
    gap_spread: float
    spacing: float
    seed: int


@dataclass(frozen=True)
class Run:
    """Time step (s) and counts: a cycle is a whole multiple of the sampling interval, whatever the frequency."""

    time_step: float
    steps_per_cycle: int
    cycles: int
    settling_cycles: int
    samples_per_cycle: int
    bridge_samples_per_cycle: int

    @property
    def steps(self) -> int:
        """Steps of the whole run."""
        return self.steps_per_cycle * self.cycles


@dataclass(frozen=True)
class WalkerCase:
    """A dimer on a shaken wet plane, resolved.

    Attributes are SI; ``name`` and ``title`` do not determine the run and stay out of `determinants`.
    """

    name: str
    title: str
    beads: Beads
    liquid: Liquid
    boundary: Plane
    contact: Contact
    drive: Drive
    start: Start
    run: Run
    gravity: float

    @property
    def drive_axis(self) -> Vector:
        """Direction from which orientations are measured: the drive's within the plane, or x where it has none."""
        x, y, _ = self.drive.direction
        length = hypot(x, y)
        return (x / length, y / length, 0.0) if length else AXES["x"]

    @property
    def goes_uphill(self) -> bool:
        """Whether the drive axis is the steepest way up a tilted plane: right is up then, and left down."""
        x, y, _ = self.drive_axis
        uphill = (cos(self.boundary.uphill), sin(self.boundary.uphill))
        return bool(self.boundary.tilt) and x * uphill[0] + y * uphill[1] > 1.0 - 1e-9

    @property
    def gravity_vector(self) -> Vector:
        """Acceleration of gravity in the frame of the plane, m/s²."""
        return self.boundary.gravity(self.gravity)

    @property
    def pressing_gravity(self) -> float:
        """The part of gravity that presses the beads to the plane, m/s²."""
        return -self.gravity_vector[2]

    @property
    def axial_gravity(self) -> float:
        """The part of gravity that pulls them back along the drive axis, m/s²."""
        return -sum(one * along for one, along in zip(self.gravity_vector, self.drive_axis, strict=True))

    def determinants(self) -> dict[str, Any]:
        """Everything that the run's outcome depends on, as plain JSON types."""
        # Not dataclasses.asdict: it copies every number, and a sweep asks this of thousands of cases.
        values = {
            key: dict(vars(value)) if is_dataclass(value) else value
            for key, value in vars(self).items()
            if key not in ("name", "title")
        }
        values["beads"]["radii"] = list(self.beads.radii)
        values["drive"] = self.drive.as_dict()
        without_no_film(values["liquid"])
        return values

    def as_dict(self) -> dict[str, Any]:
        """The whole case as plain JSON types, SI units."""
        return {"name": self.name, "title": self.title, **self.determinants()}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> WalkerCase:
        """Rebuild a case from `as_dict` (a run directory's ``case.json``)."""
        beads = {**values["beads"], "radii": tuple(values["beads"]["radii"])}
        return cls(
            name=values["name"],
            title=values["title"],
            beads=Beads(**beads),
            liquid=Liquid(**values["liquid"]),
            boundary=Plane(**values["boundary"]),
            contact=Contact(**values["contact"]),
            drive=Drive.from_dict(values["drive"]),
            start=Start(**values["start"]),
            run=Run(**values["run"]),
            gravity=values["gravity"],
        )

    def renamed(self, name: str) -> WalkerCase:
        """The same case under another name."""
        return replace(self, name=name)
