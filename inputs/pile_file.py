"""Case files of piles: what they may say, and how they are resolved."""

from __future__ import annotations

from math import ceil, dist, pi
from typing import Annotated, Literal

from pydantic import Field

from walkers.inputs import library
from walkers.inputs.drive import Drive
from walkers.inputs.pile import Container, PileBeads, PileCase, PileRun, distance_from_axis, lattice
from walkers.inputs.resolving import (
    MOST_STEPS,
    UnusableKeyError,
    density_of,
    largest_time_step,
    resolve_contact,
    resolve_drive,
    resolve_liquid,
)
from walkers.inputs.schema import AUTO, ContactTable, DriveTable, EnvironmentTable, LiquidTable, Number, Table, Whole
from walkers.inputs.units import Density, Duration, Length, Radius, SignedLength, Speed, Time
from walkers.physics.dimer import Dimer
from walkers.physics.matter import Contact, Liquid
from walkers.physics.time_step import TimeStepLimits, fit_into_cycle, time_step_limits

MOST_BEADS = 20_000
_PACKING = 0.55
"""Packing fraction of a settled wet pile, for the count that fills a height."""
_OVERLAP = 0.01
"""Radii by which placed beads may overlap with each other and the walls."""


class ContainerTable(Table):
    """``[boundary]`` of a pile: a container's inner measures, open above."""

    shape: Literal["box", "cylinder"]
    width: Length
    height: Length
    material: str


class PlacedBeadTable(Table):
    """One of ``[[beads.placed]]``: a bead and where it begins, from the middle of the floor."""

    radius: Radius
    at: tuple[SignedLength, SignedLength, SignedLength]


class PileBeadsTable(Table):
    """``[beads]``: two classes, each a range of radii filled with ``sizes`` constant radii; or single beads."""

    small: tuple[Radius, Radius] | None = None
    large: tuple[Radius, Radius] | None = None
    placed: Annotated[list[PlacedBeadTable], Field(max_length=MOST_BEADS)] | None = None
    small_share: Annotated[Number, Field(ge=0, le=1)] = 0.5
    mixed_by: Literal["mass", "volume", "number"] = "mass"
    sizes: Annotated[Whole, Field(ge=1, le=20)] = 4
    count: Annotated[Whole, Field(ge=1, le=MOST_BEADS)] | None = None
    fill_height: Length | None = None
    material: str | None = None
    density: Density | None = None


class PileRunTable(Table):
    """``[run]``."""

    time_step: Annotated[Time | None, AUTO] = None
    allow_unstable: bool = False
    duration: Duration
    segment: Duration = 0.5
    frames_per_second: Annotated[Number, Field(gt=0, le=1e6)] = 60.0
    settled_below: Speed = 5e-3
    longest_settling: Duration = 0.5
    ranks: Annotated[Whole, Field(ge=1, le=64)] = 1


class PileStartTable(Table):
    """``[start]``: the seed of the beads' places."""

    seed: Annotated[Whole, Field(ge=0, le=2**63 - 1)] = 1


class PileFile(Table):
    """A case file of a pile."""

    title: str = ""
    boundary: ContainerTable
    beads: PileBeadsTable
    liquid: LiquidTable
    contact: ContactTable = ContactTable()
    drive: DriveTable
    start: PileStartTable = PileStartTable()
    run: PileRunTable
    environment: EnvironmentTable = EnvironmentTable()


def resolve_pile(file: PileFile, name: str) -> PileCase:
    """Resolve a validated file.

    Raises
    ------
    UnusableKeyError
        If something is missing that the library does not know, or keys contradict each other.
    """
    beads = _beads(file)
    wall = file.boundary.material
    if file.liquid.film_drag_ratio:
        raise UnusableKeyError("liquid.film_drag_ratio", "expected 0: most beads of a pile touch no wall's film")
    pair = library.surface_pair(beads.material, wall) or {}
    liquid = resolve_liquid(file.liquid, {**pair, "film_drag_ratio": 0.0})
    contact = resolve_contact(file.contact, beads.material, "boundary.material", wall)
    drive = resolve_drive(file.drive, "z", None)
    container = Container(file.boundary.shape, file.boundary.width, file.boundary.height, wall)
    (_check_places if beads.placed else _check_room)(beads, container)
    run = _run(file.run, beads, contact, liquid, drive)
    return PileCase(
        name, file.title, container, beads, liquid, contact, drive, file.start.seed, run, file.environment.gravity
    )


def _sizes(key: str, bounds: tuple[float, float], number: int) -> tuple[float, ...]:
    """The middles of equal shares of a range of radii, m."""
    low, high = bounds
    if low > high:
        raise UnusableKeyError(f"beads.{key}", "expected the smaller radius first")
    return tuple(dict.fromkeys(float(f"{low + (high - low) * (k + 0.5) / number:.12g}") for k in range(number)))


def _placed(file: PileFile) -> PileBeads:
    """Beads that are placed one by one; those above the middle of the radii are the large ones."""
    table = file.beads
    for key in sorted(table.model_fields_set - {"placed", "material", "density"}):
        raise UnusableKeyError(f"beads.{key}", "expected none where the beads are placed one by one (beads.placed)")
    if file.start.model_fields_set:
        raise UnusableKeyError("start.seed", "expected none where the beads are placed: every start would be the same")
    if not table.placed:
        raise UnusableKeyError("beads.placed", "expected at least one bead")
    placed = tuple((*bead.at, bead.radius) for bead in table.placed)
    radii = sorted({bead[3] for bead in placed})
    middle = (radii[0] + radii[-1]) / 2.0
    small = tuple(radius for radius in radii if radius <= middle)
    large = tuple(radius for radius in radii if radius > middle)
    many = sum(bead[3] > middle for bead in placed)
    density = density_of(table.material, table.density, file.contact)
    return PileBeads(small, large, (len(placed) - many, many), density, table.material, placed)


def _check_places(beads: PileBeads, container: Container) -> None:
    """Beads within the container that do not overlap by more than a hundredth of a radius."""
    half = container.width / 2.0
    for number, (x, y, z, radius) in enumerate(beads.placed):
        slack = _OVERLAP * radius
        if (
            distance_from_axis(container, x, y) + radius > half + slack
            or z < radius - slack
            or z + radius > container.height
        ):
            raise UnusableKeyError(f"beads.placed[{number}].at", "expected a bead within the container")
        for other in range(number):
            *there, size = beads.placed[other]
            if dist((x, y, z), there) < radius + size - _OVERLAP * min(radius, size):
                raise UnusableKeyError(f"beads.placed[{number}].at", f"overlaps with beads.placed[{other}]")


def _beads(file: PileFile) -> PileBeads:
    table = file.beads
    if table.placed is not None:
        return _placed(file)
    if table.small is None or table.large is None:
        key = "small" if table.small is None else "large"
        raise UnusableKeyError(f"beads.{key}", "expected a range of radii (or beads.placed)")
    small, large = _sizes("small", table.small, table.sizes), _sizes("large", table.large, table.sizes)
    if max(small) >= min(large):
        raise UnusableKeyError("beads.large", "expected radii above those of the small beads")
    density = density_of(table.material, table.density, file.contact)
    if (table.count is None) == (table.fill_height is None):
        raise UnusableKeyError("beads.count", "expected either a count or a fill_height")
    volumes = [sum(4.0 / 3.0 * pi * radius**3 for radius in sizes) / len(sizes) for sizes in (small, large)]
    share = table.small_share
    if table.mixed_by != "number":  # one density: by mass is by volume
        by_number = [share / volumes[0], (1.0 - share) / volumes[1]]
        share = by_number[0] / sum(by_number)
    count = table.count
    if count is None:
        shape, width = file.boundary.shape, file.boundary.width
        area = Container(shape, width, file.boundary.height, "").cross_section
        mean = share * volumes[0] + (1.0 - share) * volumes[1]
        count = round(_PACKING * area * (table.fill_height or 0.0) / mean)
        if not 1 <= count <= MOST_BEADS:
            raise UnusableKeyError("beads.fill_height", f"that takes {count} beads; expected 1 to {MOST_BEADS}")
    few = round(count * share)
    return PileBeads(small, large, (few, count - few), density, table.material)


def _check_room(beads: PileBeads, container: Container) -> None:
    if container.width < 4.0 * max(beads.large):
        raise UnusableKeyError("boundary.width", "expected at least two of the large beads side by side")
    if container.shape == "cylinder" and container.width < 8.0 * max(beads.large):
        raise UnusableKeyError("boundary.width", "expected at least four of the large beads across a cylinder")
    level = lattice(beads, container)[1]
    if level > 2.0 * container.height:  # walls and simulation go on to there
        needed = f"{level / 2.0 * 1e3:.3g} mm"
        raise UnusableKeyError("boundary.height", f"too low for {sum(beads.counts)} beads; expected {needed} or more")


def limits_of(beads: PileBeads, contact: Contact, liquid: Liquid, drive: Drive) -> TimeStepLimits:
    """Limits of the time step: those of a large and a small bead on a wall.

    Beads of a pile have more neighbours, and its viscous limit is lower; ``auto``'s share of the limit allows for it: a
    glycerol pile at 0.4 of it is agitated as at a quarter of that step, within 0.1 %, and at 0.8 it heats up.
    """
    dimer = Dimer((max(beads.large or beads.small), min(beads.small)), beads.density, liquid.surface_tension)
    return time_step_limits(dimer, contact, liquid, drive.peak_velocity)


def _run(table: PileRunTable, beads: PileBeads, contact: Contact, liquid: Liquid, drive: Drive) -> PileRun:
    limits = limits_of(beads, contact, liquid, drive)
    largest = largest_time_step(table.time_step, limits, allow_unstable=table.allow_unstable)
    wanted = drive.frequency / table.frames_per_second
    per_cycle, cycles_per_frame = (round(1.0 / wanted), 1) if wanted < 1.0 else (1, round(wanted))
    time_step, steps = fit_into_cycle(largest, drive.frequency, per_cycle)
    # Segments end with a frame, so that each begins where the last one ended.
    frames_per_segment = max(1, round(table.segment * drive.frequency / cycles_per_frame))
    per_segment = frames_per_segment * cycles_per_frame
    cycles = ceil(table.duration * drive.frequency / cycles_per_frame * (1.0 - 1e-12)) * cycles_per_frame
    if steps * (cycles + ceil((table.longest_settling + 1.0) * drive.frequency)) > MOST_STEPS:
        raise UnusableKeyError("run.duration", "too long: the engine counts steps up to 2^31")
    return PileRun(
        time_step,
        steps,
        cycles,
        min(per_segment, cycles),
        per_cycle,
        cycles_per_frame,
        table.settled_below,
        table.longest_settling,
        table.ranks,
    )
