"""Values that a case file leaves out: from the library, defaults, and derived from other values.

`supplied` fills in a document before it is validated. `STEPS` fill in the validated case, each a part of it, in the
order of the physics. Checks of the bodies come last.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import combinations
from math import acos, atan2, degrees, dist, inf
from typing import TYPE_CHECKING, Any

from walkers.errors import Problem, expected_of, shown, unusable
from walkers.inputs.config_table import alternatives, changed
from walkers.inputs.keys import MISSING, parts_of, value_at
from walkers.inputs.meshes.mesh_surface import vessel_of
from walkers.inputs.meshes.vessel import SHARP
from walkers.inputs.origins import Source
from walkers.inputs.records.record import Record
from walkers.inputs.resolving.library import Library, LibraryNumber, unmeasured
from walkers.inputs.resolving.loads import LARGEST_DELAY, bridge_at_rest, contact_loads, delay_of, dimer_of, reach
from walkers.inputs.resolving.standing import OVERLAP, check_bodies, overlaps
from walkers.inputs.tables.bodies import ARRANGEMENTS, MOST_BEADS, Cluster, Walkers, touching
from walkers.inputs.tables.drive import check_drive, common_frequency, unit_vector
from walkers.inputs.tables.run import limits_of, with_run
from walkers.inputs.tables.shapes.vessel import Plane
from walkers.inputs.tables.shapes.walls import BOTTOM
from walkers.inputs.units import ACCELERATION, LENGTH, TEMPERATURE, parse_quantity, quantity_text
from walkers.physics.capillary import DEFAULT_LAW, bridge_volume
from walkers.physics.mixtures import MIXTURES

if TYPE_CHECKING:
    from walkers.inputs.tables.case import Case

_PACKING = 0.55  # packing fraction of a settled wet pile, for the count that fills a height
_SOFTEST = 5e7
"""Lowest Young's modulus of ``"auto"``, Pa."""
_HARDEST = 4.0**5 * _SOFTEST
"""Highest one, 51.2 GPa: four times as much is beyond what a case may have."""
_ROUGHEST = 0.01
"""Largest roughness over the radius of a bead: the wedge of liquid between smooth spheres is then no model."""
_MEET = 0.01  # largest difference of the ends of a record that repeats, over its peak acceleration
_WIDEST = 1000.0  # largest width of a vessel in diameters of the largest bead
_FACING = {"up": "right", "down": "left"}  # the words for climbers
NAMES = ("beads.material", "boundary.material", "liquid.name")
"""Keys whose values are names of the library."""
_FRICTION = ("contact.friction.bead_bead", "contact.friction.bead_wall", "contact.rolling_friction")
_OF_SURFACES = (
    *("liquid.meniscus_radius", "liquid.volume_fraction", "liquid.contact_angle"),
    *("contact.rolling_friction", "contact.restitution"),
)
_ROUGHNESS = ("contact.roughness.bead_bead", "contact.roughness.bead_wall")
_VISCOSITIES = ("liquid.kinematic_viscosity", "liquid.dynamic_viscosity")
OF_LIQUIDS = ("liquid.surface_tension", "liquid.density", *_VISCOSITIES)
_LIQUIDS = ((OF_LIQUIDS[0], _VISCOSITIES[1]), OF_LIQUIDS[:3])
"""Keys that describe a liquid completely: surface tension, and dynamic viscosity or density and kinematic viscosity."""
SUPPLIED = ("beads.density", *OF_LIQUIDS, *_FRICTION[:2], *_ROUGHNESS, *_OF_SURFACES)
"""Keys that a case may leave out because the library has values or defaults."""


# --- from the library -------------------------------------------------------------------------------------------------


def supplied(
    model: type[Case], document: Mapping[str, Any], library: Library
) -> tuple[dict[str, Any], dict[str, Source], list[Problem]]:
    """The tables of a case with missing values from the library, their sources, and names that it does not know."""
    given = {key for key in SUPPLIED if value_at(document, parts_of(key)) is not MISSING}
    named = (value_at(document, parts_of(key)) for key in NAMES)
    bead, wall, liquid = (name if isinstance(name, str) else None for name in named)
    problems = _unknown(library, given, (bead, wall, liquid))
    mixture, sources, problem = _mixture(document, liquid)
    problems += problem
    values = _values(library, bead, wall, None if problem else liquid, mixture)
    # Calibrations used one law of the bridges: with another law their numbers are guesses.
    calibrated = liquid if value_at(document, ("liquid", "law")) in (MISSING, DEFAULT_LAW) else None
    tables = {name: value for name, value in document.items() if name not in ("library", "meshes")}
    tables.setdefault("contact", {})
    written: dict[str, Any] = {}
    for key in SUPPLIED:
        replaced = {key, *alternatives(model, key)} & {*given, *written}
        if key in values and not replaced and isinstance(tables.get(key.split(".")[0]), Mapping):
            written[key], sources[key] = values[key].written, _source_of(key, values[key], calibrated)
    return changed(model, tables, written), sources, problems


def _unknown(library: Library, given: set[str], names: Sequence[str | None]) -> list[Problem]:
    """Names that are not in the library and that the case does not describe completely itself."""
    described, problems = given.issuperset(_FRICTION), []
    complete = (described and "beads.density" in given, described, any(given.issuperset(keys) for keys in _LIQUIDS))
    for key, name, says_all in zip(NAMES, names, complete, strict=True):
        kind = "liquids" if key == "liquid.name" else "materials"
        if name is not None and not says_all and name not in library.names(kind):
            expected = f"nor in a library.toml beside the case; {expected_of(name, library.names(kind))}"
            problems.append(Problem(key, shown(name), f"not in the library, {expected}"))
    return problems


def _mixture(
    document: Mapping[str, Any], liquid: str | None
) -> tuple[tuple[float, float] | None, dict[str, Source], list[Problem]]:
    """Mass fraction and temperature (K) of a liquid whose numbers depend on them, with sources, or problems."""
    keys = ("liquid.mass_fraction", "liquid.temperature")
    share, temperature = (value_at(document, parts_of(key)) for key in keys)
    if liquid not in MIXTURES:
        extra = [key for key, value in zip(keys, (share, temperature), strict=True) if value is not MISSING]
        message = f'expected none: it is for name = "{next(iter(MIXTURES))}"'
        return None, {}, [Problem(key, None, message) for key in extra]
    if type(share) not in (int, float) or not 0 <= share <= 1:
        missing = "missing; " if share is MISSING else ""
        message = f"{missing}expected the mass of the glycerol over that of the mixture, such as 0.87"
        return None, {}, [Problem(keys[0], None, message)]
    text = "20 degC" if temperature is MISSING else str(temperature)
    sources = {keys[1]: Source("default", text=text)} if temperature is MISSING else {}
    try:
        return (float(share), parse_quantity(text, TEMPERATURE)), sources, []
    except ValueError as error:
        return None, {}, [Problem(keys[1], None, str(error))]


@lru_cache(maxsize=1024)
def _values(
    library: Library, bead: str | None, wall: str | None, liquid: str | None, mixture: tuple[float, float] | None
) -> dict[str, LibraryNumber]:
    """Defaults, and numbers of the library for materials and a liquid, by the keys of a case."""
    on_bead, on_wall = library.surface_pair(bead, bead), library.surface_pair(bead, wall)
    of_liquid = library.numbers("liquids", liquid or "", mixture)
    values = {
        "beads.density": library.numbers("materials", bead or "").get("density"),
        "contact.friction.bead_bead": on_bead.get("friction"),
        "contact.friction.bead_wall": on_wall.get("friction"),
        **{key: library.roughness(bead, material) for key, material in zip(_ROUGHNESS, (bead, wall), strict=True)},
        **{key: on_wall.get(key.split(".")[1]) for key in _OF_SURFACES},
        **{f"liquid.{key}": number for key, number in of_liquid.items()},
    }
    # Of the two that give the liquid, the library's own is taken; without one it is a volume.
    usual = {key: number for key, number in unmeasured().items() if key != "liquid.meniscus_radius"}
    return usual | {key: number for key, number in values.items() if number}


def _source_of(key: str, entry: LibraryNumber, liquid: str | None) -> Source:
    """The source of a number of the library; a number that was calibrated with other liquids is a guess."""
    usual, text = unmeasured().get(key), str(entry.written)
    logarithmic = usual is not None and usual.logarithmic
    if usual is None or (entry.source and not entry.calibrated_with):
        return Source(entry.origin, entry.source, text, entry.range, logarithmic)
    if liquid in entry.calibrated_with:
        return Source("calibrated" if entry.range else "assumed", entry.source, text, entry.range, logarithmic)
    return Source("default", entry.source, text, usual.range, logarithmic)


# --- from other values ------------------------------------------------------------------------------------------------


def resolve(case: Case) -> Case:
    """The case with all that its file leaves out; raises `InputError` if its keys contradict each other."""
    for step in STEPS:
        case = step(case)
    return case


def _radii(case: Case) -> Case:
    dimers = case.dimers
    if dimers is not None and dimers.mean_radius is not None:
        shares = (1.0 + dimers.sin_delta, 1.0 - dimers.sin_delta)
        radii = tuple(float(f"{dimers.mean_radius * share:.15g}") for share in shares)
        case = case.filled("dimers.radii", radii, "from mean_radius and sin_delta")
    given = {f"{key}.radii": getattr(walkers, "diameters", None) for key, walkers in case.walkers_by_key.items()}
    given |= {f"mixture.{name}": getattr(case.mixture, f"{name}_diameters", None) for name in ("small", "large")}
    for key, diameters in given.items():
        if diameters is not None:
            case = case.filled(key, tuple(diameter / 2.0 for diameter in diameters), "from the diameters")
    if any(bead.radius is None for bead in case.placed):
        beads = (bead if bead.diameter is None else bead.but(radius=bead.diameter / 2.0) for bead in case.placed)
        case = case.but(placed=tuple(beads))
    return case


def _vessel(case: Case) -> Case:
    """A vessel of the user's own: its planes, or points and triangles if planes cannot describe it; and its extent."""
    boundary = case.boundary
    if boundary.mesh is None and not boundary.planes:
        return case
    why = "of the mesh"
    if boundary.mesh is not None:
        try:
            vessel = vessel_of(case.document["meshes"][boundary.mesh], boundary.scale)
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise unusable("meshes", f"expected points and triangles of {boundary.mesh}") from error
        surface: dict[str, Any] = {"planes": tuple(Plane(point=x, normal=normal) for x, normal in vessel.planes())}
        if not surface["planes"]:
            arrays = {"points": vessel.points, "triangles": vessel.triangles}
            surface = {name: tuple(map(tuple, array.tolist())) for name, array in arrays.items()}
        case = case.but(boundary=boundary.but(**surface)).filled("boundary.height", vessel.height, why)
    else:
        planes, why = _planes(boundary.planes), "of the planes"
        case = case.put("boundary.planes", planes)
        vessel = case.boundary.but(shape="vessel").vessel
        if abs(lowest := float(vessel.points[:, 2].min())) > 1e-9:
            raise unusable("boundary.planes", f"have their lowest point at z = {1e3 * lowest:.4g} mm; expected 0 mm")
        if (top := vessel.height) < (1.0 - 1e-9) * boundary.height:
            raise unusable("boundary.height", f"the planes close the vessel; expected at most {1e3 * top:.4g} mm")
    width, size = float(f"{2.0 * abs(vessel.points[:, :2]).max():.12g}"), 2.0 * max(case.radii)
    if not 1.0 < width / size < _WIDEST:
        wide, across = (f"{length:.4g} m" if length >= 1.0 else f"{1e3 * length:.4g} mm" for length in (width, size))
        message = f"the vessel is {wide} wide and the beads {across}; expected 1 to {_WIDEST:g} beads across"
        raise unusable("boundary.scale" if boundary.mesh else "boundary.planes", message)
    return case.filled("boundary.width", width, why).filled("boundary.shape", "vessel", why)


def _planes(planes: Sequence[Plane]) -> tuple[Plane, ...]:
    """The planes with normals of length one, a level one through the origin first."""
    units = []
    for number, plane in enumerate(planes):
        try:
            units.append(plane.but(normal=unit_vector(plane.normal)))
        except ValueError as error:
            raise unusable(f"boundary.planes[{number}].normal", "expected a direction such as [0, 0, 1]") from error
    for (number, first), (index, second) in combinations(enumerate(units), 2):
        turn = acos(max(-1.0, min(1.0, sum(a * b for a, b in zip(first.normal, second.normal, strict=True)))))
        if turn < SHARP:
            message = f"turns by {degrees(turn):.3g} deg from planes[{number}]; expected 45 deg or more, or a mesh"
            raise unusable(f"boundary.planes[{index}].normal", message)
    return tuple(sorted(units, key=lambda plane: plane.normal != BOTTOM.normal or plane.point[2] != 0.0))


def _viscosity(case: Case) -> Case:
    liquid = case.liquid
    if liquid.kinematic_viscosity is not None:
        if liquid.density is None:
            raise unusable("liquid.density", "missing; expected the liquid's density beside its kinematic_viscosity")
        viscosity = float(f"{liquid.kinematic_viscosity * liquid.density:.15g}")
        case = case.filled("liquid.dynamic_viscosity", viscosity, "from kinematic_viscosity and density")
    return case


def _count(case: Case) -> Case:
    mixture = case.mixture
    if mixture is None:
        return case
    if max(mixture.small_radii) >= min(mixture.large_radii):
        raise unusable("mixture.large", "expected radii above those of the small beads")
    if not case.boundary.closed:
        raise unusable("boundary.shape", 'expected a container, such as "box": a mixture is poured into it')
    if mixture.count is None:
        count = round(_PACKING * case.boundary.volume(mixture.fill_height) / mixture.share_and_volume[1])
        if not 1 <= count <= MOST_BEADS:
            raise unusable("mixture.fill_height", f"that takes {count} beads; expected 1 to {MOST_BEADS}")
        case = case.filled("mixture.count", count, "from the fill_height")
    return case


def _walkers(case: Case) -> Case:
    """The directions of the walkers; impossible arrangements are refused."""
    for key, walkers in case.walkers_by_key.items():
        if walkers.facing in _FACING:
            if not case.boundary.tilt or case.boundary.uphill:
                message = "on a plane that is tilted along the drive alone walkers face up or down"
                raise unusable(f"{key}.facing", f'expected "both", "right" or "left": {message}')
            case = case.put(f"{key}.facing", _FACING[walkers.facing])
        if isinstance(walkers, Cluster):
            _check_places(walkers, f"{key}.at") if walkers.at else _check_arrangement(walkers, key)
    return case


def _check_arrangement(cluster: Cluster, key: str) -> None:
    name, arrangement = cluster.arrangement, ARRANGEMENTS.get(cluster.arrangement)
    if arrangement is None:
        raise unusable(f"{key}.arrangement", expected_of(name, ARRANGEMENTS))
    key = f"{key}.radii"
    if not arrangement.fewest <= len(cluster.radii) <= arrangement.most:
        least = f"at least {arrangement.fewest}"
        bound = least if arrangement.fewest < arrangement.most else str(arrangement.most)
        raise unusable(key, f"expected {bound} beads in a {name}")
    try:
        overlapping = touching(cluster.design, cluster.radii, -OVERLAP)
    except ValueError as error:
        raise unusable(key, str(error)) from error
    if overlapping:
        first, second = (bead + 1 for bead in overlapping[0])
        raise unusable(key, f"beads {first} and {second} would overlap in a {name}; expected similar radii")


def _check_places(cluster: Cluster, key: str) -> None:
    """Beads that are given places touch, do not overlap, and have a heading."""
    everyone, places = set(range(len(cluster.radii))), cluster.at
    if len(places) != len(everyone):
        raise unusable(key, f"expected a place for each of the {len(everyone)} beads")
    if overlapping := touching(places, cluster.radii, -OVERLAP):
        first, second = overlapping[0]
        distances = dist(places[first], places[second]), cluster.rigid(first, second)
        raise unusable(f"{key}[{second}]", overlaps(f"{key}[{first}]", *distances))
    if not any(cluster.front):
        raise unusable(key, "expected some beads ahead of others: this walker has no heading")
    joined = {0}
    for _ in everyone:
        joined |= {bead for pair in cluster.pairs if joined & {*pair} for bead in pair}
    if alone := everyone - joined:
        raise unusable(f"{key}[{min(alone)}]", "expected beads that touch: this bead is not connected to the first")


def _drive(case: Case) -> Case:
    boundary = case.boundary
    if case.drive.record and (record := case.excitation.record):  # before Γ0 gives a peak, there is no excitation
        return _record(case, record)
    if case.drive.repeats:
        raise unusable("drive.repeats", "expected none without drive.record")
    several = {f"drive.harmonics[{number}]": harmonic for number, harmonic in enumerate(case.drive.harmonics)}
    for key, harmonic in (several or {"drive": case.drive}).items():
        if harmonic.axis is None:
            axis = "z" if boundary.closed else "x"
            case = case.filled(f"{key}.axis", axis, f"of a {boundary.shape}", "default")
        if harmonic.gamma0 is not None:
            if not case.walkers or len(case.walkers[0].radii) != 2:
                raise unusable(f"{key}.gamma0", "expected peak_acceleration: only a dimer has a Γ0")
            peak, why = dimer_of(case).peak_acceleration(harmonic.gamma0), "from gamma0, the dimer and the liquid"
            case = case.filled(f"{key}.peak_acceleration", peak, why)
    try:
        common_frequency([harmonic.frequency for harmonic in case.excitation.harmonics])
    except ValueError as error:
        raise unusable("drive.harmonics", f"expected frequencies with a common period: {error}") from error
    if case.drive.frame == "lab" and not case.excitation.is_plain:
        message = "several harmonics, or one with a phase, are driven in the container's frame"
        raise unusable("drive.frame", f'expected "container": {message}')
    check_drive(case.excitation)
    return case


def _record(case: Case, record: Record) -> Case:
    """A case with the frequency and the peak acceleration of its record."""
    first, last = (record.rows[end][1:] for end in (0, -1))
    if record.repeats and dist(first, last) > _MEET * record.largest(2):
        raise unusable("drive.repeats", "expected a record that ends with the first row of the next period")
    check_drive(case.excitation)
    why = "all lines are multiples" if record.repeats else "the strongest line"
    frequency = f"{case.excitation.frequency:.6g} Hz"
    peak = quantity_text(case.excitation.peak_acceleration, ACCELERATION)
    case = case.noted("drive.frequency", f"of the spectrum of the record: {why}", text=frequency)
    return case.noted("drive.peak_acceleration", "of the record, without its offset", text=peak)


def _surfaces(case: Case) -> Case:
    """Roughness is small compared with the beads, and menisci fit between them and at walls."""
    liquid, most = case.liquid.of_bridges, _ROUGHEST * min(case.radii)
    for key in _ROUGHNESS:
        if case.value_of(key) > most * (1.0 + 1e-9):
            raise unusable(key, f"expected {1e6 * most:.3g} um or less, a hundredth of a bead's radius")
        case = _ranging_to(case, key, most)
    try:
        for radius in case.radii if liquid.meniscus_radius else ():
            for opposite in (*case.radii, inf):
                bridge_volume(radius, opposite, liquid)
    except ValueError as error:
        raise unusable("liquid.meniscus_radius", f"expected menisci that fit between the surfaces: {error}") from error
    return case


def _ranging_to(case: Case, key: str, most: float) -> Case:
    """The case with a range of a length, m, that ends where the value would be refused."""
    source = case.sources.get(key)
    if source is None or source.range is None or parse_quantity(source.range[1], LENGTH) <= most:
        return case
    low, unit = source.range[0].split()
    narrowed = source._replace(range=(f"{low} {unit}", f"{most / parse_quantity(f'1 {unit}', LENGTH):.6g} {unit}"))
    return case.but(sources={**case.sources, key: narrowed})


def _law(case: Case) -> Case:
    """Laws but the default one may refuse the beads or the liquid of a case."""
    if case.liquid.law != DEFAULT_LAW:
        try:
            for radius in case.radii:
                bridge_at_rest(case, radius, inf)
        except ValueError as error:
            raise unusable("liquid.law", str(error)) from error
    return case


def _modulus(case: Case) -> Case:
    """Young's modulus of ``"auto"``: the lowest at which bridges delay contacts little (`LARGEST_DELAY`).

    In a mixture a higher modulus must not shorten the time step: hard beads would cost several times as much.
    """
    if case.contact.youngs_modulus is not None:
        return case
    softened = case.put("contact.youngs_modulus", _SOFTEST)
    while delay_of(softened) > LARGEST_DELAY and softened.contact.youngs_modulus < _HARDEST:
        harder = softened.put("contact.youngs_modulus", 4.0 * softened.contact.youngs_modulus)
        if case.mixture is not None and _longest_step(harder) < _longest_step(softened):
            break
        softened = harder
    why = f"auto: bridges delay contacts by {delay_of(softened):.1g} rad"
    return case.filled("contact.youngs_modulus", softened.contact.youngs_modulus, why)


def _longest_step(case: Case) -> float:
    """The time step that is recommended for a case, s."""
    return limits_of(case).recommended(loose=case.loose)[0]


def _uphill(case: Case) -> Case:
    """The direction of the steepest way up, from the x axis toward y."""
    boundary = case.boundary
    if not boundary.tilt:
        return case.put("boundary.uphill", 0.0)
    along, across, _ = case.drive_axis
    if boundary.uphill == 0.0:
        case = case.noted("boundary.uphill", "the direction of the drive", "default", "0 deg")
    return case.put("boundary.uphill", atan2(across, along) + boundary.uphill)


def _spacing(case: Case) -> Case:
    """The spacing of walkers; starts in which beads overlap are refused."""
    for key, walkers in case.walkers_by_key.items():
        _check_held(case, walkers)
        overlap = max(load.overlap for load in contact_loads(case, walkers))
        if overlap * (1.0 + walkers.gap_spread) > 0.02 * min(walkers.radii):
            message = "expected a larger one: at rest the beads overlap by more than 2 % of the smallest radius"
            raise unusable("contact.youngs_modulus", message)
        # Beads of different walkers may touch, but not overlap, if they are meant to meet.
        least = (1.0 if walkers.meet else 1.5) * walkers.length
        if walkers.spacing is None:
            why = "so that walkers do not touch at the start" if walkers.meet else "so that walkers do not meet"
            spacing = 2.0 * (walkers.length if walkers.meet else reach(case))
            case = case.filled(f"{key}.spacing", spacing, why)
        elif walkers.spacing < least and sum(make.replicates for make in case.walkers) > 1:
            message = f'neighbouring walkers would touch or overlap; expected at least {1e3 * least:.3g} mm, or "auto"'
            raise unusable(f"{key}.spacing", message)
    return case


def _check_held(case: Case, walkers: Walkers) -> None:
    """Refuse walkers that would not stay in contact at rest, because bridges push by more than weights press."""
    names = [f"bead {bead} and the boundary" for bead in range(1, len(walkers.radii) + 1)]
    names += [f"beads {first + 1} and {second + 1}" for first, second in walkers.pairs]
    for name, load in zip(names, contact_loads(case, walkers), strict=True):
        if load.pull < 0.0 == load.overlap:  # no overlap: the load is tensile
            angle = case.liquid.contact_angle
            key, remedy = ("contact_angle", "a smaller angle or less liquid") if angle else ("law", "a law that pulls")
            pushed = f"at rest, the bridge pushes {name} apart ({-1e6 * load.pull:.3g} uN)"
            raise unusable(f"liquid.{key}", f"expected {remedy}: {pushed}")


STEPS: Sequence[Callable[[Case], Case]] = (
    *(_radii, _vessel, _viscosity, _count, _walkers, _drive, _surfaces, _law, _modulus, with_run),
    *(_uphill, _spacing, check_bodies),
)
