"""A resolved case: every number in SI units, nothing left to look up.

This is what the deck is rendered from, what a run directory stores as ``case.json`` and what its hash is made of.
"""

from __future__ import annotations

from dataclasses import dataclass, is_dataclass, replace
from math import pi
from typing import Any, Literal

from physics.matter import Contact, Liquid


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
class Drive:
    """The substrate's displacement A sin ωt along ``axis``: frequency (Hz), peak acceleration a0 = Aω² (m/s²)."""

    axis: Literal["x", "y", "z"]
    frequency: float
    peak_acceleration: float
    frame: Literal["lab", "container"]

    @property
    def angular_frequency(self) -> float:
        """ω = 2πf, rad/s."""
        return 2.0 * pi * self.frequency

    @property
    def amplitude(self) -> float:
        """A = a0/ω², m."""
        return self.peak_acceleration / self.angular_frequency**2

    @property
    def peak_velocity(self) -> float:
        """Aω, m/s."""
        return self.peak_acceleration / self.angular_frequency


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
    """A dimer on a shaken wet substrate, resolved.

    A walker's substrate is level; a climber's is a wall, with the drive axis pointing up. Attributes are SI;
    ``name`` and ``title`` do not determine the run and stay out of `determinants`.
    """

    name: str
    title: str
    beads: Beads
    liquid: Liquid
    substrate_material: str
    contact: Contact
    drive: Drive
    start: Start
    run: Run
    gravity: float
    kind: Literal["walker", "climber"] = "walker"

    @property
    def pressing_gravity(self) -> float:
        """The part of gravity that presses the beads to the substrate, m/s²."""
        return self.gravity if self.kind == "walker" else 0.0

    @property
    def axial_gravity(self) -> float:
        """The part of gravity that pulls them down along the drive axis, m/s²."""
        return self.gravity - self.pressing_gravity

    def determinants(self) -> dict[str, Any]:
        """Everything that the run's outcome depends on, as plain JSON types."""
        # Not dataclasses.asdict: it copies every number, and a sweep asks this of thousands of cases.
        values = {
            key: dict(vars(value)) if is_dataclass(value) else value
            for key, value in vars(self).items()
            if key not in ("name", "title")
        }
        values["beads"]["radii"] = list(self.beads.radii)
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
            substrate_material=values["substrate_material"],
            contact=Contact(**values["contact"]),
            drive=Drive(**values["drive"]),
            start=Start(**values["start"]),
            run=Run(**values["run"]),
            gravity=values["gravity"],
            kind=values["kind"],
        )

    def renamed(self, name: str) -> WalkerCase:
        """The same case under another name."""
        return replace(self, name=name)
