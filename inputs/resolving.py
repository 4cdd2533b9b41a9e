"""From a validated file to a resolved case: the library's numbers filled in, the checks between keys made."""

from __future__ import annotations

from dataclasses import replace
from math import atan2, ceil, dist, pi
from typing import Literal

from walkers.inputs import library
from walkers.inputs.arrangements import ARRANGEMENTS, gap_between
from walkers.inputs.bodies import Mixture, Placed, Walkers
from walkers.inputs.boundary import Boundary, Box, Channel, Cylinder, Groove, Plane, Shape
from walkers.inputs.case import Case, Run
from walkers.inputs.drive import AXES, Drive, Harmonic, common_frequency, unit_vector, waveform
from walkers.inputs.library import suggestion
from walkers.inputs.loads import contact_loads, reach
from walkers.inputs.schema import (
    MOST_BEADS,
    BoundaryTable,
    CaseFile,
    ClusterTable,
    ContactTable,
    DimersTable,
    DriveTable,
    HarmonicTable,
    LiquidTable,
    MixtureTable,
    RunTable,
    WalkersTable,
)
from walkers.physics.dimer import Dimer
from walkers.physics.matter import Contact, Liquid
from walkers.physics.time_step import TimeStepLimits, fit_into_cycle, time_step_limits

MOST_STEPS = 2**31 - 1
_MINIMUM_SEPARATION_RATIO = 0.01
_PACKING = 0.55
"""Packing fraction of a settled wet pile, for the count that fills a height."""
_OVERLAP = 0.01
"""Radii by which beads that are given places may overlap with each other and the walls."""
_SEGMENT_SECONDS = 0.5
_LONGEST_SETTLING = 0.5
_FRAMES_PER_SECOND = 60.0
_LIQUID = {"volume_fraction": 0.01, "viscosity_ratio": 1.0, "film_drag_ratio": 0.0, "contact_angle": 0.0}
"""Where neither the case nor the library says more."""
_WAYS: dict[str, Literal["both", "right", "left"]] = {
    **{"both": "both", "right": "right", "left": "left"},
    **{"up": "right", "down": "left"},
}
"""What ``facing`` says; up and down are a climber's words."""


class UnusableKeyError(Exception):
    """A problem found between keys; `walkers.inputs.reading` adds the file and the value."""

    def __init__(self, key: str, expected: str) -> None:
        self.key = key
        self.expected = expected
        super().__init__(expected)


def resolve(file: CaseFile, name: str) -> Case:
    """Resolve a validated file.

    Raises
    ------
    UnusableKeyError
        If something is missing that the library does not know, or keys contradict each other.
    """
    boundary, beads = _boundary(file.boundary), file.beads
    walkers = _walkers(file)
    mixture = _mixture(file.mixture, boundary) if file.mixture else None
    placed = Placed(tuple((*bead.at, bead.radius) for bead in file.placed)) if file.placed else None
    if not (walkers or mixture or placed):
        raise UnusableKeyError("dimers", "missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]")
    loose = mixture is not None or placed is not None
    pair = library.surface_pair(beads.material, boundary.material) or {}
    if loose and file.liquid.film_drag_ratio:
        raise UnusableKeyError("liquid.film_drag_ratio", "expected 0: most beads of a pile touch no wall's film")
    liquid = resolve_liquid(file.liquid, {**pair, "film_drag_ratio": 0.0} if loose else pair)
    contact = resolve_contact(file.contact, beads.material, "boundary.material", boundary.material)
    density = density_of(beads.material, beads.density, file.contact)
    first = walkers[0].radii if walkers else ()
    dimer = Dimer((first[0], first[1]), density, liquid.surface_tension) if len(first) == 2 else None
    drive = resolve_drive(file.drive, boundary.drive_axis, dimer)
    case = Case(
        name=name,
        title=file.title,
        walkers=walkers,
        mixture=mixture,
        placed=placed,
        boundary=boundary,
        drive=drive,
        gravity=file.environment.gravity,
        material=beads.material,
        density=density,
        liquid=liquid,
        contact=contact,
        seed=file.run.seed,
        run=Run(0.0, 1, 1, 0, 1, 1, 1, 1, 0.0, 0.0, 1),  # its step follows from the rest
    )
    case = replace(case, run=_run(file.run, case))
    along, across, _ = case.drive_axis
    uphill = atan2(across, along) + file.boundary.uphill if boundary.tilt else 0.0
    case = replace(case, boundary=replace(boundary, uphill=uphill))
    case = replace(case, walkers=tuple(_spaced(case, number, file) for number in range(len(walkers))))
    _check_bodies(case, file)
    return case


def _boundary(table: BoundaryTable) -> Shape:
    material, tilt = table.material, table.tilt
    for key, of in (
        ("opening", ("groove",)),
        ("width", ("channel", "box", "cylinder")),
        ("height", ("box", "cylinder")),
    ):
        given = getattr(table, key)
        if (given is None) == (table.shape in of):
            example = "120 deg" if key == "opening" else "5.3 mm"
            expected = (
                f'missing; expected such as "{example}"' if given is None else f"expected none of a {table.shape}"
            )
            raise UnusableKeyError(f"boundary.{key}", expected)
    width, height, opening = (value or 0.0 for value in (table.width, table.height, table.opening))
    shapes: dict[str, Shape] = {
        "plane": Plane(material=material, tilt=tilt),
        "channel": Channel(material=material, tilt=tilt, width=width),
        "groove": Groove(material=material, tilt=tilt, opening=opening),
        "box": Box(material=material, tilt=tilt, width=width, height=height),
        "cylinder": Cylinder(material=material, tilt=tilt, width=width, height=height),
    }
    return shapes[table.shape]


def _walkers(file: CaseFile) -> tuple[Walkers, ...]:
    made = [_made(file, "dimers", file.dimers, _radii(file.dimers))] if file.dimers else []
    for number, table in enumerate(file.clusters):
        key = f"clusters[{number}]"
        made.append(_arranged(table, key, _made(file, key, table, tuple(table.radii))))
    return tuple(made)


def _made(file: CaseFile, key: str, table: WalkersTable, radii: tuple[float, ...]) -> Walkers:
    if table.facing in ("up", "down") and (not file.boundary.tilt or file.boundary.uphill):
        told = "on a plane that is tilted along the drive alone walkers face up or down"
        raise UnusableKeyError(f"{key}.facing", f'expected "both", "right" or "left": {told}')
    return Walkers(
        radii=radii,
        replicates=table.replicates,
        facing=_WAYS[table.facing],
        angle=table.angle,
        angle_spread=table.angle_spread,
        gap=table.gap,
        gap_spread=table.gap_spread,
        spacing=table.spacing or 0.0,
        meet=table.meet,
    )


def _arranged(table: ClusterTable, key: str, walkers: Walkers) -> Walkers:
    """A cluster in its arrangement, or at its places."""
    if (table.arrangement is None) == (table.at is None):
        told = f"expected either an arrangement ({', '.join(ARRANGEMENTS)}) or places (at)"
        raise UnusableKeyError(f"{key}.arrangement", told)
    if table.at is None:
        name = table.arrangement or ""
        if name not in ARRANGEMENTS:
            told = f"expected one of {', '.join(ARRANGEMENTS)}{suggestion(name, ARRANGEMENTS)}"
            raise UnusableKeyError(f"{key}.arrangement", told)
        known = ARRANGEMENTS[name]
        if not known.fewest <= len(walkers.radii) <= known.most:
            bound = f"at least {known.fewest}" if known.fewest < known.most else str(known.most)
            raise UnusableKeyError(f"{key}.radii", f"expected {bound} beads in a {name}")
        walkers = replace(walkers, arrangement=name)
        try:
            walkers.front  # noqa: B018, where they stand is computed here
        except ValueError as error:
            raise UnusableKeyError(f"{key}.radii", str(error)) from error
        return walkers
    if len(table.at) != len(walkers.radii):
        raise UnusableKeyError(f"{key}.at", f"expected a place for each of the {len(walkers.radii)} beads")
    for other in range(len(table.at)):
        for one in range(other):
            least = -_OVERLAP * min(walkers.radii[one], walkers.radii[other])
            if gap_between(table.at, walkers.radii, one, other) < least:
                raise UnusableKeyError(f"{key}.at[{other}]", f"overlaps with {key}.at[{one}]")
    walkers = replace(walkers, arrangement="given", places=tuple(table.at))
    if not any(walkers.front):
        raise UnusableKeyError(f"{key}.at", "expected some beads ahead of others: this has no heading")
    return walkers


def _mixture(table: MixtureTable, boundary: Boundary) -> Mixture:
    small, large = _sizes("small", table.small, table.sizes), _sizes("large", table.large, table.sizes)
    if max(small) >= min(large):
        raise UnusableKeyError("mixture.large", "expected radii above those of the small beads")
    if (table.count is None) == (table.fill_height is None):
        raise UnusableKeyError("mixture.count", "expected either a count or a fill_height")
    if not boundary.closed:
        raise UnusableKeyError("boundary.shape", 'expected "box" or "cylinder": a mixture is poured into it')
    volumes = [sum(4.0 / 3.0 * pi * radius**3 for radius in sizes) / len(sizes) for sizes in (small, large)]
    share = table.small_share
    if table.mixed_by != "number":  # one density: by mass is by volume
        by_number = [share / volumes[0], (1.0 - share) / volumes[1]]
        share = by_number[0] / sum(by_number)
    count = table.count
    if count is None:
        mean = share * volumes[0] + (1.0 - share) * volumes[1]
        count = round(_PACKING * boundary.cross_section * (table.fill_height or 0.0) / mean)
        if not 1 <= count <= MOST_BEADS:
            raise UnusableKeyError("mixture.fill_height", f"that takes {count} beads; expected 1 to {MOST_BEADS}")
    few = round(count * share)
    return Mixture(small, large, (few, count - few))


def _sizes(key: str, bounds: tuple[float, float], number: int) -> tuple[float, ...]:
    """The middles of equal shares of a range of radii, m."""
    low, high = bounds
    if low > high:
        raise UnusableKeyError(f"mixture.{key}", "expected the smaller radius first")
    return tuple(dict.fromkeys(float(f"{low + (high - low) * (k + 0.5) / number:.12g}") for k in range(number)))


def _check_bodies(case: Case, file: CaseFile) -> None:
    """Room for all bodies within the boundary, and no overlaps."""
    boundary, ranks = case.boundary, case.run.ranks
    if ranks > 1 and not boundary.closed:
        raise UnusableKeyError("run.ranks", "expected 1: walkers on a plane are slower on several")
    if case.placed is not None and case.mixture is None and "seed" in file.run.model_fields_set and not case.walkers:
        raise UnusableKeyError("run.seed", "expected none where the beads are placed: every start would be the same")
    if case.mixture is not None:
        _check_pour(case.mixture, boundary, case.tops_of_others(case.mixture))
    if case.placed is not None:
        _check_places(case.placed, boundary)
    if case.walkers and (len(boundary.walls) > 1 or case.placed is not None):
        _check_walkers(case, file)


def _check_walkers(case: Case, file: CaseFile) -> None:
    """Walkers between the walls and beside the beads that are placed."""
    keys = [key for number, one in enumerate(case.walkers) for key in [_key_of(file, number)] * one.replicates]
    grid = case.boundary.grid(len(keys), max(walkers.spacing for walkers in case.walkers))
    standing = [one for walkers in case.walkers for one in walkers.stand(case, 0)]
    others = case.placed.beads if case.placed is not None else ()
    for key, (x, y), walker in zip(keys, grid, standing, strict=True):
        for bead in walker.beads:
            if case.boundary.side_clearance(x + bead.x, y + bead.y) < (1.0 - _OVERLAP) * bead.radius:
                raise UnusableKeyError(f"{key}.replicates", "so many walkers do not fit between the walls")
            for number, (*there, size) in enumerate(others):
                if dist((x + bead.x, y + bead.y, bead.z), there) < (1.0 - _OVERLAP) * (bead.radius + size):
                    raise UnusableKeyError(f"placed[{number}].at", f"overlaps with one of {key}")


def _check_pour(mixture: Mixture, boundary: Boundary, floor: float) -> None:
    largest = max(mixture.large)
    if boundary.side_clearance(0.0, 0.0) < 2.0 * largest:
        raise UnusableKeyError("boundary.width", "expected at least two of the large beads side by side")
    if boundary.layer(largest).tight and boundary.side_clearance(0.0, 0.0) < 4.0 * largest:
        raise UnusableKeyError("boundary.width", "expected at least four of the large beads across a cylinder")
    level = floor + mixture.level(boundary)
    if level > 2.0 * boundary.top:  # walls and simulation go on to there
        needed = f"{level / 2.0 * 1e3:.3g} mm"
        raise UnusableKeyError("boundary.height", f"too low for {mixture.count} beads; expected {needed} or more")


def _check_places(placed: Placed, boundary: Boundary) -> None:
    """Beads within the boundary that do not overlap by more than a hundredth of a radius."""
    for number, (x, y, z, radius) in enumerate(placed.beads):
        slack = _OVERLAP * radius
        if boundary.side_clearance(x, y) < radius - slack or z < radius - slack or z + radius > boundary.top:
            raise UnusableKeyError(f"placed[{number}].at", "expected a bead within the boundary")
        for other in range(number):
            *there, size = placed.beads[other]
            if dist((x, y, z), there) < radius + size - _OVERLAP * min(radius, size):
                raise UnusableKeyError(f"placed[{number}].at", f"overlaps with placed[{other}]")


def known_name(key: str, name: str, names: tuple[str, ...], *, described: bool = False) -> str:
    """A name of the library; another one only if the case itself says all about it and it is no misspelling."""
    if name in names:
        return name
    hint = suggestion(name, names)
    if hint or not described:
        raise UnusableKeyError(key, f"not in the library; expected one of {', '.join(names)}{hint}")
    return name


def _describes_contacts(table: ContactTable) -> bool:
    return None not in (table.friction.bead_bead, table.friction.bead_wall, table.rolling_friction)


def density_of(material: str | None, density: float | None, contact: ContactTable) -> float:
    """Density of the beads, kg/m³: as given, or their material's.

    Raises
    ------
    UnusableKeyError
        If neither says it, or the material is not in the library and the case does not say all about it.
    """
    if material is not None:
        described = density is not None and _describes_contacts(contact)
        known_name("beads.material", material, library.materials(), described=described)
    if density is None and material is not None:
        density = library.material(material)["density"]
    if density is None:
        raise UnusableKeyError("beads.material", "missing; expected a material of the library, or a density")
    return density


def _radii(table: DimersTable) -> tuple[float, float]:
    if table.radii is not None:
        other = "mean_radius" if table.mean_radius is not None else "sin_delta"
        if table.mean_radius is not None or table.sin_delta is not None:
            raise UnusableKeyError(
                f"dimers.{other}", "expected either the radii or mean_radius and sin_delta, not both"
            )
        return table.radii
    if table.mean_radius is None and table.sin_delta is None:
        raise UnusableKeyError("dimers.radii", 'missing; expected such as ["0.3 mm", "0.2 mm"]')
    if table.mean_radius is None or table.sin_delta is None:
        lacking, example = ("mean_radius", '"0.25 mm"') if table.mean_radius is None else ("sin_delta", "0.2")
        raise UnusableKeyError(f"dimers.{lacking}", f"missing; expected such as {example}")
    first, second = (float(f"{table.mean_radius * share:.15g}") for share in (1 + table.sin_delta, 1 - table.sin_delta))
    return first, second


def resolve_liquid(table: LiquidTable, pair: dict[str, float] | None = None) -> Liquid:
    """A liquid, the library's numbers filled in, those of the two surfaces among them.

    Raises
    ------
    UnusableKeyError
        If a number is missing or said twice.
    """
    known: dict[str, float] = {}
    if table.name is not None:
        known = library.liquid(known_name("liquid.name", table.name, library.liquids()))
    if table.kinematic_viscosity is not None and table.dynamic_viscosity is not None:
        raise UnusableKeyError(
            "liquid.dynamic_viscosity", "expected either kinematic_viscosity or dynamic_viscosity, not both"
        )
    tension = table.surface_tension or known.get("surface_tension")
    density = table.density or known.get("density")
    kinematic = table.kinematic_viscosity if table.kinematic_viscosity is not None else known.get("kinematic_viscosity")
    viscosity = table.dynamic_viscosity
    if viscosity is None and kinematic is not None:
        if density is None:
            raise UnusableKeyError("liquid.density", "missing; a kinematic_viscosity needs the liquid's density")
        viscosity = float(f"{kinematic * density:.15g}")
    if tension is None or viscosity is None:
        lacking = "surface_tension" if tension is None else "dynamic_viscosity"
        raise UnusableKeyError(f"liquid.{lacking}", "missing; expected a liquid of the library by name, or this number")
    chosen = {
        key: value if (value := _first(getattr(table, key), pair, key)) is not None else usual
        for key, usual in _LIQUID.items()
    }
    film, bridges = (float(f"{viscosity * chosen[f'{of}_ratio']:.15g}") for of in ("film_drag", "viscosity"))
    return Liquid(tension, bridges, density, chosen["volume_fraction"], chosen["contact_angle"], table.name, film)


def resolve_contact(table: ContactTable, bead: str | None, wall_key: str, wall: str) -> Contact:
    """How beads of a material touch each other and a wall, the library's frictions filled in.

    Parameters
    ----------
    table
        What the case says.
    bead, wall
        Materials.
    wall_key
        The key that names the wall's.

    Raises
    ------
    UnusableKeyError
        If a material or a friction is not known.
    """
    known_name(wall_key, wall, library.materials(), described=_describes_contacts(table))
    on_bead, on_wall = library.surface_pair(bead, bead), library.surface_pair(bead, wall)
    known = {
        "friction.bead_bead": _first(table.friction.bead_bead, on_bead, "friction"),
        "friction.bead_wall": _first(table.friction.bead_wall, on_wall, "friction"),
        "rolling_friction": _first(table.rolling_friction, on_wall, "rolling_friction"),
    }
    lacking = [key for key, value in known.items() if value is None]
    if lacking:
        pairs = "; ".join(" on ".join(pair) for pair in library.surface_pairs())
        others = f", and so are {', '.join(lacking[1:])}" if lacking[1:] else ""
        raise UnusableKeyError(
            f"contact.{lacking[0]}",
            f"missing{others}; the library has them for {pairs} only, not for {bead or 'these beads'} on {wall}",
        )
    separation = _first(table.minimum_separation_ratio, on_wall, "minimum_separation_ratio")
    return Contact(
        youngs_modulus=table.youngs_modulus,
        poissons_ratio=table.poissons_ratio,
        restitution=table.restitution,
        friction_bead_bead=known["friction.bead_bead"] or 0.0,
        friction_bead_wall=known["friction.bead_wall"] or 0.0,
        rolling_friction=known["rolling_friction"] or 0.0,
        minimum_separation_ratio=_MINIMUM_SEPARATION_RATIO if separation is None else separation,
    )


def _first(given: float | None, pair: dict[str, float] | None, key: str) -> float | None:
    if given is not None:
        return given
    return pair.get(key) if pair is not None else None


def resolve_drive(table: DriveTable, axis: str, dimer: Dimer | None) -> Drive:
    """A drive of one harmonic or of several.

    Parameters
    ----------
    table
        What the case says.
    axis
        Along which it is shaken if the case does not say.
    dimer
        Whose Γ0 a drive may be given by; None where there is none.

    Raises
    ------
    UnusableKeyError
        If something is missing, said twice or contradictory.
    """
    besides = sorted(table.model_fields_set - {"harmonics", "frame"})
    if table.harmonics and besides:
        raise UnusableKeyError(
            f"drive.{besides[0]}", f"expected none beside drive.harmonics: write drive.harmonics[0].{besides[0]}"
        )
    if table.harmonics:
        harmonics = tuple(
            _harmonic(one, f"drive.harmonics[{number}]", axis, dimer) for number, one in enumerate(table.harmonics)
        )
    else:
        harmonics = waveform(table.waveform, _harmonic(table, "drive", axis, dimer))
    try:
        common_frequency([one.frequency for one in harmonics])
    except ValueError as error:
        raise UnusableKeyError("drive.harmonics", f"expected frequencies with a common period: {error}") from error
    drive = Drive(harmonics, table.frame or "container")
    if table.frame is None and axis == "x" and drive.is_plain:
        return replace(drive, frame="lab")
    if table.frame == "lab" and not drive.is_plain:
        told = "several harmonics, or one with a phase, are driven in the container's frame"
        raise UnusableKeyError("drive.frame", f'expected "container": {told}')
    return drive


def _harmonic(table: DriveTable | HarmonicTable, key: str, axis: str, dimer: Dimer | None) -> Harmonic:
    if table.frequency is None:
        raise UnusableKeyError(f"{key}.frequency", 'missing; expected such as "80 Hz"')
    if dimer is None and table.gamma0 is not None:
        raise UnusableKeyError(f"{key}.gamma0", "expected peak_acceleration: only a dimer has a Γ0")
    if (table.peak_acceleration is None) == (table.gamma0 is None):
        if table.gamma0 is None:
            raise UnusableKeyError(f"{key}.peak_acceleration", 'missing; expected it (such as "4 g") or gamma0')
        raise UnusableKeyError(f"{key}.gamma0", "expected either peak_acceleration or gamma0, not both")
    acceleration = table.peak_acceleration
    if acceleration is None:
        acceleration = dimer.peak_acceleration(table.gamma0 or 0.0) if dimer else 0.0
    given = axis if table.axis is None else table.axis
    try:
        direction = AXES[given] if isinstance(given, str) else unit_vector(given)
    except ValueError as error:
        raise UnusableKeyError(f"{key}.axis", str(error)) from error
    return Harmonic(direction, table.frequency, acceleration, table.phase)


def limits_of(case: Case) -> TimeStepLimits:
    """Limits of the time step for the bodies of a case."""
    bridged = [entry for body in case.bodies for entry in body.bridged]
    return time_step_limits(bridged, case.density, case.contact, case.liquid, case.drive.peak_velocity)


def _run(table: RunTable, case: Case) -> Run:
    frequency = case.drive.frequency
    largest = largest_time_step(table.time_step, limits_of(case), allow_unstable=table.allow_unstable)
    samples, cycles_per_sample = _sampling(table, case)
    time_step, steps = fit_into_cycle(largest, frequency, samples)
    cycles = _cycles(table, case, cycles_per_sample)
    settling = table.settling_cycles
    if settling is None:
        settling = min(20, cycles // 3) if case.walkers else 0
    if cycles - settling < 2:
        raise UnusableKeyError("run.settling_cycles", f"expected at most cycles - 2 = {cycles - 2}")
    rest = table.longest_settling
    if rest is None:
        rest = _LONGEST_SETTLING if case.loose else 0.0
    resting = ceil((rest + 1.0) * frequency) if rest else 0
    if steps * (cycles + resting) > MOST_STEPS:
        if table.duration is not None:
            raise UnusableKeyError("run.duration", "too long: the engine counts steps up to 2^31")
        most = MOST_STEPS // steps - resting
        raise UnusableKeyError("run.cycles", f"expected at most {most}: the engine counts steps up to 2^31")
    # Segments end with a sample, so that each begins where the last one ended.
    segment = table.segment if table.segment is not None else _SEGMENT_SECONDS if case.loose else None
    per_segment = (
        cycles if segment is None else max(1, round(segment * frequency / cycles_per_sample)) * cycles_per_sample
    )
    return Run(
        time_step=time_step,
        steps_per_cycle=steps,
        cycles=cycles,
        settling_cycles=settling,
        samples_per_cycle=samples,
        cycles_per_sample=cycles_per_sample,
        samples_per_bridge_sample=_bridge_sampling(table, case, samples),
        cycles_per_segment=min(per_segment, cycles),
        settled_below=table.settled_below,
        longest_settling=rest,
        ranks=table.ranks,
    )


def _sampling(table: RunTable, case: Case) -> tuple[int, int]:
    """Samples a cycle and cycles a sample, one of which is 1."""
    if table.samples_per_cycle is not None and table.frames_per_second is not None:
        raise UnusableKeyError("run.frames_per_second", "expected either samples_per_cycle or frames_per_second")
    if table.samples_per_cycle is not None or (table.frames_per_second is None and not case.loose):
        return table.samples_per_cycle or 20, 1
    wanted = case.drive.frequency / (table.frames_per_second or _FRAMES_PER_SECOND)
    return (round(1.0 / wanted), 1) if wanted < 1.0 else (1, round(wanted))


def _bridge_sampling(table: RunTable, case: Case, samples: int) -> int:
    bridges = table.bridge_samples_per_cycle
    if case.loose and bridges is not None:
        raise UnusableKeyError(
            "run.bridge_samples_per_cycle", "expected none: bridges of loose beads are in every frame"
        )
    if bridges is None:
        return 1 if case.loose else samples
    if samples % bridges:
        told = f"expected a divisor of samples_per_cycle = {samples}"
        raise UnusableKeyError("run.bridge_samples_per_cycle", told)
    return samples // bridges


def _cycles(table: RunTable, case: Case, cycles_per_sample: int) -> int:
    if table.cycles is not None and table.duration is not None:
        raise UnusableKeyError("run.duration", "expected either cycles or a duration")
    if table.duration is not None:
        return ceil(table.duration * case.drive.frequency / cycles_per_sample * (1.0 - 1e-12)) * cycles_per_sample
    if table.cycles is None and case.loose:
        raise UnusableKeyError("run.duration", 'missing; expected such as "4 s"')
    return ceil((table.cycles or 60) / cycles_per_sample) * cycles_per_sample


def largest_time_step(given: float | None, limits: TimeStepLimits, *, allow_unstable: bool) -> float:
    """The step that a case gives, or the one that ``"auto"`` takes, s.

    Raises
    ------
    UnusableKeyError
        If a given one is beyond a limit and the case does not insist.
    """
    if given is None:
        return limits.recommended()
    exceeded = limits.exceeded_by(given)
    if exceeded and not allow_unstable:
        allowed = min(limits.as_dict().values())
        raise UnusableKeyError(
            "run.time_step",
            f"beyond the {' and the '.join(exceeded)} limit; expected less than {allowed * 1e6:.3g} us, "
            '"auto", or allow_unstable = true',
        )
    return given


def _key_of(file: CaseFile, number: int) -> str:
    """Key of the table of a case's walkers."""
    dimers = file.dimers is not None
    return "dimers" if dimers and number == 0 else f"clusters[{number - dimers}]"


def _spaced(case: Case, number: int, file: CaseFile) -> Walkers:
    """Settle the spacing of walkers and refuse starts in which beads overlap."""
    walkers, key = case.walkers[number], _key_of(file, number)
    smallest, gap = min(walkers.radii), walkers.gap
    if gap is not None and gap > 0.0:
        raise UnusableKeyError(f"{key}.gap", "expected zero or less: a bridge forms on contact, beads apart have none")
    overlaps = contact_loads(case, walkers).overlaps if gap is None else (-gap,)
    if max(overlaps) * (1.0 + walkers.gap_spread) > 0.02 * smallest:
        blamed = f"{key}.gap" if gap is not None else "contact.youngs_modulus"
        raise UnusableKeyError(blamed, "the beads overlap by more than 2 % of the smallest radius")
    many = sum(one.replicates for one in case.walkers) > 1
    # Beads of different walkers may touch, but not overlap, if they are meant to meet.
    least = (1.0 if walkers.meet else 1.5) * walkers.length
    if walkers.spacing and many and walkers.spacing < least:
        raise UnusableKeyError(
            f"{key}.spacing",
            f'neighbouring walkers would touch or overlap; expected at least {1e3 * least:.3g} mm, or "auto"',
        )
    if walkers.spacing:
        return walkers
    return replace(walkers, spacing=2.0 * walkers.length if walkers.meet else 2.0 * reach(case))
