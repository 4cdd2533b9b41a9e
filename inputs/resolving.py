"""From a validated file to a resolved case: the library's numbers filled in, the checks between keys made."""

from __future__ import annotations

from dataclasses import replace
from math import atan2
from typing import Literal

from walkers.inputs import library
from walkers.inputs.case import Beads, Run, Start, WalkerCase
from walkers.inputs.dimer import contact_loads, horizontal_distance, reach
from walkers.inputs.drive import AXES, Drive, Harmonic, common_frequency, unit_vector
from walkers.inputs.library import suggestion
from walkers.inputs.plane import Plane
from walkers.inputs.schema import BeadsTable, ContactTable, DriveTable, HarmonicTable, LiquidTable, WalkerFile
from walkers.physics.dimer import Dimer
from walkers.physics.matter import Contact, Liquid
from walkers.physics.time_step import TimeStepLimits, fit_into_cycle, time_step_limits

MOST_STEPS = 2**31 - 1
_MINIMUM_SEPARATION_RATIO = 0.01
_LIQUID = {"volume_fraction": 0.01, "viscosity_ratio": 1.0, "film_drag_ratio": 0.0, "contact_angle": 0.0}
"""Where neither the case nor the library says more."""
_WAYS: dict[str, Literal["both", "right", "left"]] = {
    **{"both": "both", "right": "right", "left": "left"},
    **{"up": "right", "down": "left"},
}
"""What ``start.facing`` says; up and down are a climber's words."""


class UnusableKeyError(Exception):
    """A problem found between keys; `walkers.inputs.reading` adds the file and the value."""

    def __init__(self, key: str, expected: str) -> None:
        self.key = key
        self.expected = expected
        super().__init__(expected)


def resolve(file: WalkerFile, name: str) -> WalkerCase:
    """Resolve a validated file.

    Raises
    ------
    UnusableKeyError
        If something is missing that the library does not know, or keys contradict each other.
    """
    beads = _beads(file)
    pair = library.surface_pair(beads.material, file.boundary.material)
    liquid = resolve_liquid(file.liquid, pair)
    contact = resolve_contact(file.contact, beads.material, "boundary.material", file.boundary.material)
    dimer = Dimer(beads.radii, beads.density, liquid.surface_tension)
    drive = resolve_drive(file.drive, "x", dimer)
    run = _run(file, dimer, contact, liquid, drive)
    _check_facing(file)
    table = file.start
    start = Start(
        replicates=table.replicates,
        facing=_WAYS[table.facing],
        angle=table.angle,
        angle_spread=table.angle_spread,
        gap=table.gap,
        gap_spread=table.gap_spread,
        spacing=0.0,
        seed=table.seed,
    )
    gravity = file.environment.gravity
    level = WalkerCase(
        name, file.title, beads, liquid, Plane(file.boundary.material), contact, drive, start, run, gravity
    )
    along, across, _ = level.drive_axis
    tilt, uphill = file.boundary.tilt, atan2(across, along) + file.boundary.uphill
    plane = Plane(file.boundary.material, tilt, uphill if tilt else 0.0)
    return _placed(replace(level, boundary=plane), table.spacing)


def _check_facing(file: WalkerFile) -> None:
    if file.start.facing in ("up", "down") and (not file.boundary.tilt or file.boundary.uphill):
        told = "on a plane that is tilted along the drive alone walkers face up or down"
        raise UnusableKeyError("start.facing", f'expected "both", "right" or "left": {told}')


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


def _beads(file: WalkerFile) -> Beads:
    table = file.beads
    density = density_of(table.material, table.density, file.contact)
    return Beads(radii=_radii(table), density=density, material=table.material)


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


def _radii(table: BeadsTable) -> tuple[float, float]:
    if table.radii is not None:
        other = "mean_radius" if table.mean_radius is not None else "sin_delta"
        if table.mean_radius is not None or table.sin_delta is not None:
            raise UnusableKeyError(f"beads.{other}", "expected either the radii or mean_radius and sin_delta, not both")
        return table.radii
    if table.mean_radius is None and table.sin_delta is None:
        raise UnusableKeyError("beads.radii", 'missing; expected such as ["0.3 mm", "0.2 mm"]')
    if table.mean_radius is None or table.sin_delta is None:
        lacking, example = ("mean_radius", '"0.25 mm"') if table.mean_radius is None else ("sin_delta", "0.2")
        raise UnusableKeyError(f"beads.{lacking}", f"missing; expected such as {example}")
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
        harmonics = (_harmonic(table, "drive", axis, dimer),)
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


def _run(file: WalkerFile, dimer: Dimer, contact: Contact, liquid: Liquid, drive: Drive) -> Run:
    table = file.run
    if table.cycles - table.settling_cycles < 2:
        raise UnusableKeyError("run.settling_cycles", f"expected at most cycles - 2 = {table.cycles - 2}")
    if table.samples_per_cycle % table.bridge_samples_per_cycle:
        raise UnusableKeyError(
            "run.bridge_samples_per_cycle", f"expected a divisor of samples_per_cycle = {table.samples_per_cycle}"
        )
    limits = time_step_limits(dimer, contact, liquid, drive.peak_velocity)
    largest = largest_time_step(table.time_step, limits, allow_unstable=table.allow_unstable)
    time_step, steps = fit_into_cycle(largest, drive.frequency, table.samples_per_cycle)
    if steps * table.cycles > MOST_STEPS:
        most = MOST_STEPS // steps
        raise UnusableKeyError("run.cycles", f"expected at most {most}: the engine counts steps up to 2^31")
    return Run(
        time_step, steps, table.cycles, table.settling_cycles, table.samples_per_cycle, table.bridge_samples_per_cycle
    )


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


def _placed(case: WalkerCase, spacing: float | None) -> WalkerCase:
    """Settle the spacing of the walkers and refuse starts in which beads overlap."""
    smallest, gap = min(case.beads.radii), case.start.gap
    if gap is not None and gap > 0.0:
        raise UnusableKeyError("start.gap", "expected zero or less: a bridge forms on contact, beads apart have none")
    overlaps = contact_loads(case).overlaps if gap is None else (-gap, -gap, -gap)
    if max(overlaps) * (1.0 + case.start.gap_spread) > 0.02 * smallest:
        key = "start.gap" if gap is not None else "contact.youngs_modulus"
        raise UnusableKeyError(key, "the beads overlap by more than 2 % of the smallest radius")
    length = horizontal_distance(case.beads.radii, overlaps) + sum(case.beads.radii)
    if spacing is not None and case.start.replicates > 1 and spacing < 1.5 * length:
        raise UnusableKeyError(
            "start.spacing",
            f'neighbouring walkers would touch or overlap; expected at least {1.5e3 * length:.3g} mm, or "auto"',
        )
    return replace(case, start=replace(case.start, spacing=spacing if spacing is not None else 2.0 * reach(case)))
