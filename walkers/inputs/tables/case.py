"""A case: what its file says (`CaseFile`), what forces depend on (`Setup`), and all of it (`Case`).

The fields of all three are the keys of a case file, in SI units. `walkers.inputs.case_building`
makes a `Case` of a file. A deck is rendered from the case, a run directory stores it as
``case.json``, and the hash in the name of a run is made of it. How values that a file leaves out
follow from others is the subject of `walkers.inputs.resolving`.
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
from walkers.inputs.units import QuantityKind, kind_in
from walkers.physics.bridge import BridgeLaw


def _ranges_by_key(value: object) -> object:
    """The table ``[uncertain]`` as `Ranges`; a value that is not a table is returned as it is."""
    if not isinstance(value, dict):
        return value
    ranges = {}
    for name, ends in flatten(value).items():
        ranges[name] = ends if is_axis(ends) else {"uniform": ends}
    return ranges


Ranges = Annotated[dict[str, Any], BeforeValidator(_ranges_by_key)]
"""Ranges by dotted key: ``{"uniform": [low, high]}`` or ``{"loguniform": [low, high]}``.

The samplers of a sweep take them in this form.
"""
_PARALLEL = 1.0 - 1e-9
"""Cosine of the angle between two directions above which they are the same: within 0.003°."""
_BODIES = ("dimers", "clusters", "mixture", "placed")
"""Keys of the tables of bodies, of which a case has at least one."""
_AT_MOST_100 = Field(max_length=100)
_AT_MOST_ALL_BEADS = Field(max_length=MOST_BEADS)
_IN_WORDS = ("run.cycles", "run.samples_per_cycle")
"""Keys whose values are given in words if their source has words, because these say more than the
number: ``until constant within 0.2 %, at most 60``."""
_PROVENANCE = ("document", "sources", "recorded_law", "uncertain")
"""Fields that comparisons of cases leave out: they do not change what is computed."""
_WITHOUT_ORIGIN = ("title", "uncertain", "drive.record.rows", "drive.record.ignored_columns")
"""Keys that the list of origins leaves out."""
_LISTS_WITHOUT_ORIGIN = ("placed[", "boundary.planes[")
"""Starts of the keys in lists that the list of origins leaves out."""


class CaseFile(ConfigTable):
    """A case file: bodies on a boundary under a drive, with a liquid and contacts."""

    title: Annotated[str, SAME_RUN] = key(
        "Title of figures and reports. It does not change the results.", ""
    )
    beads: BeadsTable = key("")
    dimers: DimersTable | None = key("", None)
    clusters: Annotated[tuple[ClusterTable, ...], _AT_MOST_100] = key("", ())
    mixture: MixtureTable | None = key("", None)
    placed: Annotated[tuple[PlacedBeadTable, ...], _AT_MOST_ALL_BEADS] = key("", ())
    boundary: Boundary = key("")
    drive: DriveTable = key("")
    liquid: LiquidTable = key("")
    contact: ContactTable = key("")
    run: RunTable = key("", RunTable())
    environment: Environment = key("", Environment())
    uncertain: Annotated[Ranges, SAME_RUN] = key(
        "Ranges of values that are guesses, by dotted key: `[low, high]`, or "
        "`{ loguniform = [low, high] }`. See [](../../how-to/own-beads.md).",
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
        run = given.get("run", {})
        has_loose_beads = "mixture" in given or "placed" in given
        if has_loose_beads and isinstance(run, Mapping):
            has_length = "duration" in run or "cycles" in run
            if not has_length:
                yield RunTable.missing("duration", "run")
        yield from super().problems(given, place)


class Setup(CaseFile):
    """A case with all values except those of its run, which are as the file gives them.

    Forces and the loads of contacts depend on nothing else.
    """

    dimers: Dimers | None
    clusters: Annotated[tuple[Cluster, ...], _AT_MOST_100]
    mixture: Mixture | None
    placed: Annotated[tuple[PlacedBead, ...], _AT_MOST_ALL_BEADS]
    drive: Drive
    liquid: Liquid
    contact: Contact

    @property
    def walkers_by_key(self) -> dict[str, Walkers]:
        """All kinds of walkers by their keys in the case, dimers first."""
        kinds: dict[str, Walkers] = {}
        if self.dimers is not None:
            kinds["dimers"] = self.dimers
        for number, cluster in enumerate(self.clusters):
            kinds[f"clusters[{number}]"] = cluster
        return kinds

    @cached_property
    def walkers(self) -> tuple[Walkers, ...]:
        """All kinds of walkers, dimers first."""
        return tuple(self.walkers_by_key.values())

    @property
    def excitation(self) -> Excitation:
        """The shaking of the boundary."""
        return self.drive.excitation

    @property
    def law(self) -> BridgeLaw:
        """The law of the bridges."""
        return by_name(self.liquid.law)

    @cached_property
    def bodies(self) -> tuple[Walkers | Mixture, ...]:
        """All kinds of walkers, then the mixture if there is one; not the placed beads."""
        if self.mixture is None:
            return self.walkers
        return (*self.walkers, self.mixture)

    @cached_property
    def all_radii(self) -> list[float]:
        """Radius of every bead in the order of the bodies, m; placed beads are last."""
        radii: list[float] = []
        for body in self.bodies:
            radii.extend(body.all_radii)
        radii.extend(bead.radius for bead in self.placed)
        return radii

    @property
    def count(self) -> int:
        """Number of beads."""
        return len(self.all_radii)

    @property
    def large(self) -> int:
        """Number of large beads."""
        return sum(radius > self.border for radius in self.all_radii)

    @property
    def radii(self) -> list[float]:
        """The different radii of the beads in the order of the bodies, m; placed beads are last."""
        radii: list[float] = []
        for body in self.bodies:
            radii.extend(body.radii)
        radii.extend(sorted(bead.radius for bead in self.placed))
        return list(dict.fromkeys(radii))

    @property
    def loose(self) -> bool:
        """Whether there are loose beads, of no walker: a mixture, or placed ones."""
        return self.mixture is not None or bool(self.placed)

    @cached_property
    def border(self) -> float:
        """A radius above all small beads and below all large ones, m; infinite if all are small.

        Without a mixture, beads are large if their radius is above the middle of the range of
        radii.
        """
        if self.mixture is not None:
            return (max(self.mixture.small_radii) + min(self.mixture.large_radii)) / 2.0
        sizes = sorted(self.radii)
        middle = (sizes[0] + sizes[-1]) / 2.0
        small = [size for size in sizes if size <= middle]
        large = [size for size in sizes if size > middle]
        if not large:
            return inf
        return (small[-1] + large[0]) / 2.0

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
        """Number of walkers in a row if every second row has to start facing left; otherwise 0.

        Walkers that alternately face right and left stand in rows. If the number in a row is even,
        all walkers of a column would face the same way and never meet; so the directions of every
        second row are exchanged. This is needed only if walkers may meet, and do not face at
        random.
        """
        alternating = [walkers for walkers in self.walkers if walkers.facing == "both"]
        all_at_random = all(isclose(walkers.angle_spread, pi) for walkers in alternating)
        if not self.meets or all_at_random:
            return 0
        number = sum(walkers.replicates for walkers in self.walkers)
        any_spacing = 1.0  # m; the number of walkers in a row does not depend on it
        x_of_walkers = [x for x, _ in self.boundary.geometry.grid(number, any_spacing)]
        row_length = x_of_walkers.count(x_of_walkers[0])
        has_several_rows = row_length < number
        if has_several_rows and row_length % 2 == 0:
            return row_length
        return 0

    @property
    def drive_axis(self) -> Vector:
        """Direction of the drive in the plane of the substrate, a unit vector.

        It is that of the largest harmonic; x if this shakes normal to the substrate.
        """
        x, y, _ = self.excitation.direction
        length = hypot(x, y)
        if length == 0.0:
            return AXES["x"]
        return (x / length, y / length, 0.0)

    @property
    def goes_uphill(self) -> bool:
        """Whether the drive axis points uphill on a tilted substrate: right is up, left is down."""
        if self.boundary.tilt == 0.0:
            return False
        x, y, _ = self.drive_axis
        uphill_x = cos(self.boundary.uphill)
        uphill_y = sin(self.boundary.uphill)
        return x * uphill_x + y * uphill_y > _PARALLEL

    @property
    def gravity_vector(self) -> Vector:
        """Acceleration of gravity in the frame of the boundary, m/s²."""
        return self.boundary.gravity(self.environment.gravity)

    @property
    def pressing_gravity(self) -> float:
        """Component of gravity normal to the substrate, toward it, m/s²."""
        return -self.gravity_vector[2]

    @property
    def axial_gravity(self) -> float:
        """Component of gravity against the drive axis, m/s²."""
        pairs = zip(self.gravity_vector, self.drive_axis, strict=True)
        return -sum(gravity * direction for gravity, direction in pairs)


class Case(Setup):
    """A case with all values.

    Attributes
    ----------
    name : str
        Name of the case, usually of its file without the suffix.
    document : dict
        The tables that the case was read from.
    sources : dict
        The `Source` of each value that the tables do not give, by dotted key.
    recorded_law : BridgeLaw or None
        The law of a user as a run has recorded it.

    Notes
    -----
    The other fields are the tables of a case file.
    """

    run: RunSettings
    name: Annotated[Derived[str], SAME_RUN] = "case"
    document: Annotated[Derived[dict[str, Any]], SAME_RUN] = Field({})
    sources: Annotated[Derived[dict[str, Source]], SAME_RUN] = Field({})
    recorded_law: Annotated[Derived[Any], SAME_RUN, Field(exclude=True)] = None

    @cached_property
    def _values(self) -> tuple[Any, ...]:
        """What comparisons of cases compare."""
        names = [name for name in type(self).model_fields if name not in _PROVENANCE]
        return tuple(getattr(self, name) for name in names)

    def as_dict(self) -> dict[str, Any]:
        """The whole case in plain JSON types and SI units.

        It includes the tables from which the case was read, and the sources of its values.
        """
        return self.model_dump(mode="json")

    def for_cycles(self, cycles: int) -> Case:
        """The case with a fixed number of cycles, instead of cycles until velocities are constant.

        A run until constant velocities is tried with growing numbers of cycles, each time from the
        start and in one part; this is the case of one such attempt. A case whose number of cycles
        is fixed already is returned as it is.
        """
        if not self.run.until_steady:
            return self
        run = self.run.with_values(
            cycles=cycles,
            until_steady=False,
            settling_cycles=settling_of(cycles),
            cycles_per_segment=cycles,
        )
        return self.with_values(run=run)

    @cached_property
    def origins(self) -> tuple[Origin, ...]:
        """Origins of the values, in the order of the tables of a case file."""
        origins: dict[str, Origin] = {}
        for name, value, field in self.leaves():
            if name in _WITHOUT_ORIGIN or name.startswith(_LISTS_WITHOUT_ORIGIN):
                continue
            kind = kind_in([*field.metadata, field.annotation])
            origin = self._origin_of(name, value, kind)
            if origin is not None:
                origins[name] = origin
        for name, distribution in self.uncertain.items():
            # A value without an origin, such as one of two radii, has one if it is uncertain.
            origin = origins.get(name) or self._given_origin(name)
            origins[name] = _with_range(origin, distribution)
        return tuple(origins.values())

    def _origin_of(self, name: str, value: Any, kind: QuantityKind | None) -> Origin | None:
        """Origin of a value by its dotted key: the file, else its noted source, else the default.

        None if the case has no value there.
        """
        given = value_at(self.document, parts_of(name))
        if given is not MISSING and not units.is_auto(given):
            if name == "run.time_step":
                # The file gives an upper limit: the step of the run fits into a cycle.
                value = units.parse_quantity(given, units.TIME)
            return Origin(name, text_of(given), "given", value=value)
        source = self.sources.get(name)
        if source is not None and (source.text or value is not None):
            return _origin_from_source(name, source, value, kind)
        if value not in (None, "", ()):
            return Origin(name, text_of(value, kind), "default", value=value)
        return None

    def _given_origin(self, name: str) -> Origin:
        """Origin of a dotted key with the text of the case file, ``-`` if the file has none."""
        given = value_at(self.document, parts_of(name))
        text = "-" if given is MISSING else text_of(given)
        return Origin(name, text, "given")

    def __repr__(self) -> str:
        given = [origin for origin in self.origins if origin.origin == "given"]
        text = ", ".join(f"{origin.key} = {origin.text}" for origin in given)
        return f"<Case {self.name}: {text}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """All values with their origins, for notebooks."""
        rows = []
        for origin in self.origins:
            texts = (origin.key, origin.text, origin.word, origin.source)
            cells = "".join(f"<td>{escape(text)}</td>" for text in texts)
            rows.append(f"<tr>{cells}</tr>")
        caption = escape(self.title or self.name)
        return f"<table><caption>{caption}</caption>{''.join(rows)}</table>"

    @property
    def law(self) -> BridgeLaw:
        """The law of the bridges: the one that the run has recorded, or that of the liquid."""
        law: BridgeLaw = self.recorded_law or super().law
        return law

    @property
    def duration(self) -> float:
        """Duration of the drive, s; an upper limit if the run ends at constant velocities."""
        return self.run.cycles / self.excitation.frequency

    @property
    def independent(self) -> bool:
        """Whether the walkers of other cases may stand beside those of this one in a deck.

        They may if no walker meets another and the boundary is the same everywhere.
        """
        return self.apart and self.run.has_one_segment and self.boundary.is_open_floor


def _origin_from_source(name: str, source: Source, value: Any, kind: QuantityKind | None) -> Origin:
    """Origin of a value that the case file does not give; some are described in words."""
    text = source.text or text_of(value, kind)
    if source.text and (value is None or name in _IN_WORDS):
        value = text
    return Origin(
        key=name,
        text=text,
        origin=source.origin,
        source=source.why,
        range=source.range,
        logarithmic=source.logarithmic,
        value=value,
    )


def _with_range(origin: Origin, distribution: Mapping[str, Any]) -> Origin:
    """The origin of a value that the case calls uncertain, with its range (as in `Ranges`)."""
    ((name, (low, high)),) = distribution.items()
    return replace(origin, range=(low, high), logarithmic=name == "loguniform", uncertain=True)
