"""A resolved case: all numbers in SI units.

This is what the deck is rendered from, what a run directory stores as ``case.json`` and what its hash is made of.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from math import cos, hypot, inf, isclose, pi, sin
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_jsonable_python

from walkers.inputs.bodies import Body, Mixture, Placed, Standing, Walkers
from walkers.inputs.boundary import Boundary
from walkers.inputs.drive import AXES, Drive, Vector
from walkers.inputs.origins import Origin
from walkers.inputs.rounding import percent
from walkers.physics.laws import LAWS, law_of
from walkers.physics.matter import Contact, Liquid

if TYPE_CHECKING:
    from walkers.physics.bridge import BridgeLaw

FIRST_ATTEMPTS = (12, 24)
"""Cycles after which it is asked whether velocities are constant. After 36 hardly any are that were not after 24."""
ENDED = ("run.silence", "run.log_limit")
"""Keys of cases of earlier versions; they limited the engine."""

_SOURCES = ("document", "find_origins", "recorded_law")


def settling_of(cycles: int) -> int:
    """Default number of settling cycles of walkers: a third of the cycles, at most 20."""
    return min(20, cycles // 3)


CONSTANT = 0.002
"""Share within which the velocities of the halves of a walker's cycles agree where a run ends early: they are constant.

A walker is called steady at a looser criterion, that of `walkers.postprocess.gait.walk`.
"""


@dataclass(frozen=True)
class Run:
    """Duration, time step, sampling and segments; a cycle is a whole multiple of the sampling interval.

    Before the drive loose beads rest until their root mean square velocity is below `settled_below` (m/s), or for
    `longest_settling` (s; 0 of walkers, which stand from the first). Beads are recorded `samples_per_cycle` times a
    cycle, or once in `cycles_per_sample` (one of the two is 1), bridges with one of so many samples. If there are
    several segments, each has a restart file at its end.
    """

    time_step: float
    """s."""
    steps_per_cycle: int
    cycles: int
    settling_cycles: int
    """Of the cycles, those before velocities are measured."""
    until_steady: bool
    """Whether fewer do if velocities are constant after them (`walkers.postprocess.gait.are_constant`)."""
    samples_per_cycle: int
    cycles_per_sample: int
    samples_per_bridge_sample: int
    cycles_per_segment: int
    settled_below: float
    longest_settling: float
    ranks: int
    """MPI processes."""

    @property
    def period(self) -> float:
        """Period of a cycle, s."""
        return self.time_step * self.steps_per_cycle

    @property
    def steps(self) -> int:
        """Steps of the whole drive."""
        return self.steps_per_cycle * self.cycles

    @property
    def steps_per_sample(self) -> int:
        """Steps between samples."""
        return self.steps_per_cycle * self.cycles_per_sample // self.samples_per_cycle

    @property
    def settled_strobes(self) -> int:
        """Number of stroboscopic samples before velocities are measured."""
        return -(-self.settling_cycles // self.cycles_per_sample)

    @property
    def attempts(self) -> tuple[int, ...]:
        """Cycles for which the run is made, and made again from its begin if its walkers are not steady after them."""
        fewer = FIRST_ATTEMPTS if self.until_steady else ()
        return (*(cycles for cycles in fewer if cycles < self.cycles), self.cycles)

    @property
    def continuation(self) -> str:
        """What `walkers run` does after the cycles tried first; empty for a fixed number of cycles."""
        until = f"continues to {self.cycles} if the velocities are not constant within {percent(CONSTANT)}"
        return f"walkers run {until}: then set cycles to {self.cycles}" if len(self.attempts) > 1 else ""

    def steps_until(self, cycles: int) -> int:
        """Steps of the attempts up to the one for so many cycles."""
        return self.steps_per_cycle * sum(one for one in self.attempts if one <= cycles)

    def for_cycles(self, cycles: int) -> Run:
        """The same run with a fixed number of cycles in one segment."""
        if not self.until_steady:
            return self
        settling = settling_of(cycles)
        return replace(self, cycles=cycles, settling_cycles=settling, until_steady=False, cycles_per_segment=cycles)

    @property
    def rests(self) -> bool:
        """Whether the beads rest before the drive."""
        return self.longest_settling > 0.0

    @property
    def in_one(self) -> bool:
        """Whether the run has a single segment."""
        return not self.rests and self.cycles_per_segment >= self.cycles


@dataclass(frozen=True)
class Case:
    """Bodies on a boundary under a drive, resolved.

    Attributes are SI (``density`` of the beads in kg/m³, ``gravity`` in m/s²). ``seed`` is that of all that is drawn at
    the start. ``document`` (the tables that the case was read from), ``find_origins`` (which gives `origins`) and
    ``recorded_law`` (a user's law as a run has recorded it) are part of no comparison, and are lost where
    `dataclasses.replace` changes the case: they would tell of another one.

    Raises
    ------
    ValueError
        If the run is not one for the drive, whose cycles it has other steps for.
    """

    name: str
    title: str
    walkers: tuple[Walkers, ...]
    mixture: Mixture | None
    placed: Placed | None
    boundary: Boundary
    drive: Drive
    gravity: float
    material: str | None
    density: float
    liquid: Liquid
    contact: Contact
    seed: int
    run: Run
    document: Mapping[str, Any] = field(default_factory=dict, init=False, compare=False, repr=False)
    find_origins: Callable[[], tuple[Origin, ...]] = field(default=tuple, init=False, compare=False, repr=False)
    recorded_law: Any = field(default=None, init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Refuse a drive that does not match time step and sampling."""
        period, frequency = self.run.period, self.drive.frequency
        if period and not isclose(period * frequency, 1.0, rel_tol=1e-9):
            raise ValueError(
                f"drive of {frequency:g} Hz, but time step and sampling of one of {1.0 / period:g} Hz: "
                f'use load_case("{self.name}", {{"drive.frequency": "{frequency:g} Hz"}})'
            )

    @property
    def as_read(self) -> bool:
        """Whether the case equals its document, that is, was not changed after reading."""
        return bool(self.document)

    @cached_property
    def origins(self) -> tuple[Origin, ...]:
        """Origins of the values; empty for a case that was not read or was changed afterwards."""
        return self.find_origins()

    def read_from(
        self,
        document: Mapping[str, Any],
        find_origins: Callable[[], tuple[Origin, ...]],
        recorded_law: BridgeLaw | None = None,
    ) -> Case:
        """The same case with the tables from which it was read, notes on origins, and the law of its run."""
        case = replace(self)
        object.__setattr__(case, "recorded_law", recorded_law)
        object.__setattr__(case, "document", document)
        object.__setattr__(case, "find_origins", find_origins)
        return case

    def renamed(self, name: str, title: str | None = None) -> Case:
        """The same case under another name, or another title too."""
        return replace(self, name=name, title=title or self.title).read_from(*self._sources)

    def for_cycles(self, cycles: int) -> Case:
        """The same case with a fixed number of cycles in one segment."""
        return replace(self, run=self.run.for_cycles(cycles)).read_from(*self._sources)

    @property
    def law(self) -> BridgeLaw:
        """The law of its bridges: the one that its run has recorded, else that of the liquid."""
        return self.recorded_law or law_of(self.liquid)

    @property
    def _sources(self) -> tuple[Mapping[str, Any], Callable[[], tuple[Origin, ...]], BridgeLaw | None]:
        return self.document, self.find_origins, self.recorded_law

    @property
    def bodies(self) -> tuple[Body, ...]:
        """All bodies, the walkers first."""
        return (*self.walkers, *(body for body in (self.mixture, self.placed) if body is not None))

    @property
    def all_radii(self) -> list[float]:
        """Radius of every bead, m."""
        return [radius for body in self.bodies for radius in body.all_radii]

    @property
    def count(self) -> int:
        """How many beads there are."""
        return len(self.all_radii)

    @property
    def large(self) -> int:
        """Number of large beads."""
        return sum(radius > self.border for radius in self.all_radii)

    @property
    def duration(self) -> float:
        """Duration of the drive, s; an upper limit if the run ends at constant velocities."""
        return self.run.cycles / self.drive.frequency

    @property
    def radii(self) -> list[float]:
        """The different radii of the beads, m, in the order of the bodies."""
        return list(dict.fromkeys(radius for body in self.bodies for radius in body.radii))

    @property
    def loose(self) -> bool:
        """Whether there are loose beads, which may form clusters."""
        return self.mixture is not None or self.placed is not None

    @property
    def border(self) -> float:
        """A radius between those of small and large beads, m; infinite for a single class."""
        if self.mixture is not None:
            return (max(self.mixture.small) + min(self.mixture.large)) / 2.0
        sizes = sorted(self.radii)
        middle = (sizes[0] + sizes[-1]) / 2.0
        small, large = ([size for size in sizes if (size > middle) is above] for above in (False, True))
        return (small[-1] + large[0]) / 2.0 if large else inf

    def standing(self) -> Iterator[tuple[int, Standing]]:
        """What stands at the start, each with the number of its body; walkers come first and are numbered through.

        Raises `ValueError` if the beads of a walker cannot stand so.
        """
        first = 0
        for number, body in enumerate(self.bodies):
            stood = body.stand(self, first)
            yield from ((number, one) for one in stood)
            first += len(stood)

    def tops_of_others(self, body: Body) -> float:
        """Largest height of the other bodies at the start, m."""
        walkers = [2.0 * max(one.radii) for one in self.walkers if one is not body]
        placed = self.placed.beads if self.placed is not None and self.placed is not body else ()
        return max([*walkers, *(z + radius for _, _, z, radius in placed)], default=0.0)

    @property
    def apart(self) -> bool:
        """Whether the case has only walkers that are independent of each other."""
        return bool(self.walkers) and not self.loose and not self.meets

    @property
    def independent(self) -> bool:
        """Whether its walkers are so wherever they stand, so that others' may stand beside them in a deck."""
        return self.apart and self.run.in_one and self.boundary.bare

    @property
    def meets(self) -> bool:
        """Whether walkers may meet."""
        return any(walkers.meet for walkers in self.walkers)

    @cached_property
    def shifted_rows(self) -> int:
        """Even length of rows of which every second one begins facing left, so that neighbours meet; 0 if none does."""
        if not (self.meets and any(one.facing == "both" and not isclose(one.angle_spread, pi) for one in self.walkers)):
            return 0
        rows = [x for x, _ in self.boundary.grid(sum(one.replicates for one in self.walkers), 1.0)]
        length = rows.count(rows[0])
        return length if length % 2 == 0 and length < len(rows) else 0

    @property
    def drive_axis(self) -> Vector:
        """Direction of the largest harmonic (the first of equal ones) in the plane of the floor; x if it has none."""
        x, y, _ = self.drive.direction
        length = hypot(x, y)
        return (x / length, y / length, 0.0) if length else AXES["x"]

    @property
    def goes_uphill(self) -> bool:
        """Whether the drive axis points uphill on a tilted floor; then right is up, and left is down."""
        x, y, _ = self.drive_axis
        uphill = (cos(self.boundary.uphill), sin(self.boundary.uphill))
        return bool(self.boundary.tilt) and x * uphill[0] + y * uphill[1] > 1.0 - 1e-9

    @property
    def gravity_vector(self) -> Vector:
        """Acceleration of gravity in the frame of the boundary, m/s²."""
        return self.boundary.gravity(self.gravity)

    @property
    def pressing_gravity(self) -> float:
        """Component of gravity normal to the floor, m/s²."""
        return -self.gravity_vector[2]

    @property
    def axial_gravity(self) -> float:
        """Component of gravity against the drive axis, m/s²."""
        return -sum(one * along for one, along in zip(self.gravity_vector, self.drive_axis, strict=True))

    def determinants(self) -> dict[str, Any]:
        """All values that determine the results, as plain JSON types: without names.

        They are hashed with their keys: a renamed field renames all runs, and loses the measured numerical errors.
        """
        no_names = dict.fromkeys(("name", "title", "material", *_SOURCES), True)
        without: dict[str, Any] = {**no_names, "boundary": {"material"}, "liquid": {"name"}}
        if self.liquid.law in LAWS:  # none of which asks for the density; one of a user's own may
            without["liquid"] = {"name", "density"}
        if not self.liquid.conserved:  # cases of before this key keep their names
            without["liquid"] = {*without["liquid"], "conserved"}
        values: dict[str, Any] = _adapter().dump_python(self, mode="json", exclude=without)
        return {**values, "shifted_rows": self.shifted_rows} if self.shifted_rows else values

    def as_dict(self) -> dict[str, Any]:
        """The whole case as plain JSON types, SI units, with the tables it was read from and its values' origins."""
        about: dict[str, Any] = to_jsonable_python({"document": self.document, "origins": self.origins})
        return {**_adapter().dump_python(self, mode="json", exclude=set(_SOURCES)), **about}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Case:
        """Rebuild a case from `as_dict` (a run directory's ``case.json``); raises `ValueError` if it is none."""
        try:
            case = _adapter().validate_python(values, by_alias=False, by_name=True)
            about = values.get("document", {}), values.get("origins", ())
            document, origins = _origins_adapter().validate_python(about)
            if isinstance(run := document.get("run"), dict):
                document["run"] = {key: value for key, value in run.items() if f"run.{key}" not in ENDED}
            return case.read_from(document, partial(tuple, [one for one in origins if one.key not in ENDED]))
        except ValidationError as error:
            first = error.errors()[0]
            raise ValueError(f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from error


@cache
def _adapter() -> TypeAdapter[Case]:
    return TypeAdapter(Case)


@cache
def _origins_adapter() -> TypeAdapter[tuple[dict[str, Any], tuple[Origin, ...]]]:
    return TypeAdapter(tuple[dict[str, Any], tuple[Origin, ...]])
