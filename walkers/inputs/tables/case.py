"""A case: what its file says (`CaseFile`), what forces depend on (`Setup`), and all of it (`Case`).

All are in SI units; their fields are the keys of a file. `walkers.inputs.case_building` makes a `Case`
of a file. A deck is rendered from it, a run directory stores it as ``case.json``, and the hash in a
run's name is made of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from html import escape
from math import cos, hypot, inf, isclose, pi, sin
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from walkers.arrays import Vector
from walkers.errors import Problem
from walkers.inputs import units
from walkers.inputs.bridge_laws import by_name
from walkers.inputs.config_table import SAME_RUN, ConfigTable, Derived, key
from walkers.inputs.keys import MISSING, flatten, is_axis, parts_of, value_at
from walkers.inputs.origins import Origin, Source, text_of
from walkers.inputs.tables.bodies import (
    MOST_BEADS,
    Cluster,
    ClusterTable,
    Dimers,
    DimersTable,
    Mixture,
    MixtureTable,
    PlacedBead,
    PlacedBeadTable,
    Walkers,
)
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.drive import AXES, Drive, DriveTable, Excitation
from walkers.inputs.tables.materials import (
    BeadsTable,
    Contact,
    ContactTable,
    Environment,
    Liquid,
    LiquidTable,
)
from walkers.inputs.tables.run import RunSettings, RunTable, settling_of
from walkers.inputs.units import kind_in
from walkers.physics.bridge import BridgeLaw


def _ranges(value: object) -> object:
    """Ranges by dotted keys."""
    if not isinstance(value, dict):
        return value
    return {
        name: ends if is_axis(ends) else {"uniform": ends} for name, ends in flatten(value).items()
    }


Ranges = Annotated[dict[str, Any], BeforeValidator(_ranges)]
"""As a sweep's samplers take them: for each key ``{"uniform": [low, high]}`` or ``{"loguniform": [low, high]}``."""
_BODIES = ("dimers", "clusters", "mixture", "placed")
_FEW_KINDS = Field(max_length=100)
_FEW_BEADS = Field(max_length=MOST_BEADS)
_IN_WORDS = ("run.cycles", "run.samples_per_cycle")
"""Keys with sources in words, which say more than their numbers: ``until constant within 0.2 %, at most 60``."""
_ABOUT = ("document", "sources", "recorded_law", "uncertain")
"""Fields that comparisons leave out: sources of values, and the law as its run has recorded it."""


class CaseFile(ConfigTable):
    """A case file: bodies on a boundary under a drive, with a liquid and contacts."""

    title: Annotated[str, SAME_RUN] = key(
        "Title of figures and reports. It does not change the results.", ""
    )
    beads: BeadsTable = key("")
    dimers: DimersTable | None = key("", None)
    clusters: Annotated[tuple[ClusterTable, ...], _FEW_KINDS] = key("", ())
    mixture: MixtureTable | None = key("", None)
    placed: Annotated[tuple[PlacedBeadTable, ...], _FEW_BEADS] = key("", ())
    boundary: Boundary = key("")
    drive: DriveTable = key("")
    liquid: LiquidTable = key("")
    contact: ContactTable = key("")
    run: RunTable = key("", RunTable())
    environment: Environment = key("", Environment())
    uncertain: Annotated[Ranges, SAME_RUN] = key(
        "Ranges of values that are guesses, by dotted key: `[low, high]`, or `{ loguniform = [low, high] }`. "
        "See [](../../how-to/own-beads.md).",
        {},
    )

    @classmethod
    def problems(cls, given: Mapping[str, Any], place: str) -> Iterator[Problem]:
        """Bodies that are missing, and the length of a run of loose beads."""
        if not any(body in given for body in _BODIES):
            yield Problem(
                "dimers",
                None,
                "missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]",
            )
        run, loose = given.get("run", {}), given.keys() & {"mixture", "placed"}
        if loose and isinstance(run, Mapping) and not run.keys() & {"duration", "cycles"}:
            yield RunTable.missing("duration", "run")
        yield from super().problems(given, place)


class Setup(CaseFile):
    """A case with all values but those of its run, which is as the file says it.

    Forces and the loads of contacts depend on nothing else.
    """

    dimers: Dimers | None
    clusters: Annotated[tuple[Cluster, ...], _FEW_KINDS]
    mixture: Mixture | None
    placed: Annotated[tuple[PlacedBead, ...], _FEW_BEADS]
    drive: Drive
    liquid: Liquid
    contact: Contact

    @property
    def walkers_by_key(self) -> dict[str, Walkers]:
        """All makes of walkers by their keys, dimers first."""
        dimers: dict[str, Walkers] = {} if self.dimers is None else {"dimers": self.dimers}
        return {
            **dimers,
            **{f"clusters[{number}]": cluster for number, cluster in enumerate(self.clusters)},
        }

    @cached_property
    def walkers(self) -> tuple[Walkers, ...]:
        """All makes of walkers, dimers first."""
        return tuple(self.walkers_by_key.values())

    @property
    def excitation(self) -> Excitation:
        """The oscillations of the drive."""
        return self.drive.excitation

    @property
    def law(self) -> BridgeLaw:
        """The law of its bridges."""
        return by_name(self.liquid.law)

    @cached_property
    def bodies(self) -> tuple[Walkers | Mixture, ...]:
        """All bodies of several beads, the walkers first."""
        return (*self.walkers, *((self.mixture,) if self.mixture else ()))

    @cached_property
    def all_radii(self) -> list[float]:
        """Radius of every bead, m."""
        radii = [radius for body in self.bodies for radius in body.all_radii]
        return [*radii, *(bead.radius for bead in self.placed)]

    @property
    def count(self) -> int:
        """How many beads there are."""
        return len(self.all_radii)

    @property
    def large(self) -> int:
        """Number of large beads."""
        return sum(radius > self.border for radius in self.all_radii)

    @property
    def radii(self) -> list[float]:
        """The different radii of the beads, m, in the order of the bodies."""
        radii = [radius for body in self.bodies for radius in body.radii]
        return list(dict.fromkeys([*radii, *sorted(bead.radius for bead in self.placed)]))

    @property
    def loose(self) -> bool:
        """Whether there are loose beads, which may form clusters."""
        return self.mixture is not None or bool(self.placed)

    @cached_property
    def border(self) -> float:
        """A radius above all small beads and below all large ones, m; infinite for a single class."""
        if self.mixture is not None:
            return (max(self.mixture.small_radii) + min(self.mixture.large_radii)) / 2.0
        sizes = sorted(self.radii)
        middle = (sizes[0] + sizes[-1]) / 2.0
        small, large = (
            [size for size in sizes if (size > middle) is above] for above in (False, True)
        )
        return (small[-1] + large[0]) / 2.0 if large else inf

    @property
    def apart(self) -> bool:
        """Whether the case has only walkers that are independent of each other."""
        return bool(self.walkers) and not self.loose and not self.meets

    @property
    def meets(self) -> bool:
        """Whether walkers may meet."""
        return any(walkers.meet for walkers in self.walkers)

    @cached_property
    def shifted_rows(self) -> int:
        """Even length of the rows of walkers if every second row begins facing left, so that neighbours meet; or 0."""
        both = [walkers for walkers in self.walkers if walkers.facing == "both"]
        if not self.meets or all(isclose(walkers.angle_spread, pi) for walkers in both):
            return 0
        rows = [
            x
            for x, _ in self.boundary.geometry.grid(
                sum(walkers.replicates for walkers in self.walkers), 1.0
            )
        ]
        length = rows.count(rows[0])
        return length if length % 2 == 0 and length < len(rows) else 0

    @property
    def drive_axis(self) -> Vector:
        """Direction of the largest harmonic (the first of equal ones) in the plane of the floor; x if it has none."""
        x, y, _ = self.excitation.direction
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
        return self.boundary.gravity(self.environment.gravity)

    @property
    def pressing_gravity(self) -> float:
        """Component of gravity normal to the floor, m/s²."""
        return -self.gravity_vector[2]

    @property
    def axial_gravity(self) -> float:
        """Component of gravity against the drive axis, m/s²."""
        return -sum(
            component * along
            for component, along in zip(self.gravity_vector, self.drive_axis, strict=True)
        )


class Case(Setup):
    """A case with all values.

    ``document`` has the tables that the case was read from, ``sources`` the `Source` of each value that they do not
    give, and ``recorded_law`` is a user's law as a run has recorded it.
    """

    run: RunSettings
    name: Annotated[Derived[str], SAME_RUN] = "case"
    document: Annotated[Derived[dict[str, Any]], SAME_RUN] = Field({})
    sources: Annotated[Derived[dict[str, Source]], SAME_RUN] = Field({})
    recorded_law: Annotated[Derived[Any], SAME_RUN, Field(exclude=True)] = None

    @cached_property
    def _values(self) -> tuple[Any, ...]:
        return tuple(getattr(self, name) for name in type(self).model_fields if name not in _ABOUT)

    def as_dict(self) -> dict[str, Any]:
        """The whole case as plain JSON types, SI units, with the tables it was read from and its values' sources."""
        return self.model_dump(mode="json")

    def for_cycles(self, cycles: int) -> Case:
        """The same case with a fixed number of cycles in one segment."""
        if not self.run.until_steady:
            return self
        fixed = {
            "until_steady": False,
            "settling_cycles": settling_of(cycles),
            "cycles_per_segment": cycles,
        }
        return self.with_values(run=self.run.with_values(cycles=cycles, **fixed))

    @cached_property
    def origins(self) -> tuple[Origin, ...]:
        """Origins of the values, in the order of the tables of a case file."""
        origins: dict[str, Origin] = {}
        for name, value, field in self.leaves():
            in_no_file = ("title", "uncertain", "drive.record.rows", "drive.record.ignored_columns")
            if name in in_no_file or name.startswith(("placed[", "boundary.planes[")):
                continue
            raw, kind = (
                value_at(self.document, parts_of(name)),
                kind_in([*field.metadata, field.annotation]),
            )
            if raw is not MISSING and not units.is_auto(raw):
                # The step of the run is a little shorter, so that it fits into a cycle.
                limit = units.parse_quantity(raw, units.TIME) if name == "run.time_step" else value
                origins[name] = Origin(name, text_of(raw), "given", value=limit)
            elif (source := self.sources.get(name)) and (source.text or value is not None):
                text = source.text or text_of(value, kind)
                about = (source.origin, source.why, source.range, source.logarithmic)
                in_words = source.text and (value is None or name in _IN_WORDS)
                origins[name] = Origin(name, text, *about, value=text if in_words else value)
            elif value not in (None, "", ()):
                origins[name] = Origin(name, text_of(value, kind), "default", value=value)
        for name, given in self.uncertain.items():
            ((distribution, (low, high)),) = given.items()
            # What has no line of its own, such as one of two radii, has one if the case calls it uncertain.
            raw = value_at(self.document, parts_of(name))
            origin = origins.get(name) or Origin(
                name, "-" if raw is MISSING else text_of(raw), "given"
            )
            logarithmic = distribution == "loguniform"
            origins[name] = replace(
                origin, range=(low, high), logarithmic=logarithmic, uncertain=True
            )
        return tuple(origins.values())

    def __repr__(self) -> str:
        given = ", ".join(
            f"{origin.key} = {origin.text}" for origin in self.origins if origin.origin == "given"
        )
        return f"<Case {self.name}: {given}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """All values with their origins, for notebooks."""
        cells = ([origin.key, origin.text, origin.word, origin.source] for origin in self.origins)
        rows = "".join(
            f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in cells
        )
        return f"<table><caption>{escape(self.title or self.name)}</caption>{rows}</table>"

    @property
    def law(self) -> BridgeLaw:
        """The law of its bridges: as its run has recorded it, else the law of the liquid."""
        law: BridgeLaw = self.recorded_law or super().law
        return law

    @property
    def duration(self) -> float:
        """Duration of the drive, s; an upper limit if the run ends at constant velocities."""
        return self.run.cycles / self.excitation.frequency

    @property
    def independent(self) -> bool:
        """Whether its walkers are so wherever they stand, so that others' may stand beside them in a deck."""
        return self.apart and self.run.has_one_segment and self.boundary.bare
