"""Resolve a case file: missing values come from the library, from defaults, or from other values.

First what beads, liquid and contacts are made of, then the bodies and the checks that they fit into the boundary and
beside each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, lru_cache, partial
from itertools import islice
from math import atan2, dist, inf, isinf, isnan, pi
from typing import Any, Literal

from walkers.inputs import library
from walkers.inputs.bodies import ARRANGEMENTS, Mixture, Placed, Standing, Walkers, touching
from walkers.inputs.boundary import SIZES, Boundary
from walkers.inputs.case import Case, Run
from walkers.inputs.changes import MISSING, changed, parts_of, value_at
from walkers.inputs.errors import unusable
from walkers.inputs.library import Known, Library, expected_of
from walkers.inputs.loads import bridge_at_rest, contact_loads, reach
from walkers.inputs.origins import Notes, Origin, Whence, origins_of
from walkers.inputs.run_tables import resolve_drive, resolve_run
from walkers.inputs.schema import MOST_BEADS, CaseFile, MixtureTable
from walkers.physics.dimer import Dimer
from walkers.physics.laws import LAWS
from walkers.physics.matter import DEFAULT_LAW, Liquid
from walkers.physics.mixtures import MIXTURES
from walkers.physics.units import ABSENT, TEMPERATURE, parse_quantity

_PACKING = 0.55
"""Packing fraction of a settled wet pile, for the count that fills a height."""
_OVERLAP = 0.01
"""Radii by which beads that are given places may overlap with each other and the walls."""
_WAYS: Mapping[str, Literal["right", "left"]] = {"up": "right", "down": "left"}
"""What a climber's words mean."""
_FRICTION = ("contact.friction.bead_bead", "contact.friction.bead_wall", "contact.rolling_friction")
_OF_SURFACES = (
    *("liquid.viscosity_ratio", "liquid.volume_fraction", "liquid.contact_angle"),
    *("contact.rolling_friction", "contact.restitution", "contact.minimum_separation_ratio"),
)
_VISCOSITIES = ("liquid.kinematic_viscosity", "liquid.dynamic_viscosity")
_OF_LIQUIDS = ("liquid.surface_tension", "liquid.density", *_VISCOSITIES)
_LIQUIDS = ((_OF_LIQUIDS[0], _VISCOSITIES[1]), _OF_LIQUIDS[:3])
"""What a liquid of its own says: its surface tension, and its dynamic viscosity or density and kinematic viscosity."""
SUPPLIED = ("beads.density", *_OF_LIQUIDS, *_FRICTION[:2], *_OF_SURFACES)
"""Keys that a case may leave out because the library has values or defaults."""


def supplied(document: Mapping[str, Any], known_to: Library, notes: Notes) -> dict[str, Any]:
    """The tables of a case with what they leave out and the library has of the materials and the liquid they name.

    Raises `InputError` if they name what the library has not, and do not say all about it themselves.
    """
    said = {key: value_at(document, parts_of(key)) for key in (*SUPPLIED, "liquid.law")}
    given = {key for key, value in said.items() if value is not MISSING}
    named = {key: value_at(document, parts_of(key)) for key in ("beads.material", "boundary.material", "liquid.name")}
    for key, name in named.items():
        if name is not MISSING and not isinstance(name, str):
            raise unusable(key, "expected text in quotes")
    bead, wall, liquid = (None if name is MISSING else str(name) for name in named.values())
    described = given.issuperset(_FRICTION)
    for key, name, kind, says_all in (
        ("beads.material", bead, "materials", described and "beads.density" in given),
        ("liquid.name", liquid, "liquids", any(given.issuperset(of_one) for of_one in _LIQUIDS)),
        ("boundary.material", wall, "materials", described),
    ):
        if name is not None and not says_all and not known_to.has(kind, name):
            message = "not in the library, nor in a library.toml beside the case"
            raise unusable(key, f"{message}; {expected_of(name, known_to.names(kind))}")
    known, settings = _known(known_to, bead, wall, liquid, _mixture(document, liquid, notes)), {}
    # What was calibrated was so with one law of the bridges: with another it is a guess.
    calibrated = liquid if said["liquid.law"] in (MISSING, DEFAULT_LAW) else None
    for key in SUPPLIED:
        there = isinstance(document.get(key.split(".")[0]), Mapping) or key.startswith("contact")
        instead = key in _VISCOSITIES and not given.isdisjoint(_VISCOSITIES)
        if there and key in known and not (key in given or instead):
            settings[key] = known[key].written
            notes[key] = _origin_of(key, known[key], calibrated)
    tables = changed({"contact": {}, **document}, settings)
    tables.pop("library", None)
    return tables


def _mixture(document: Mapping[str, Any], liquid: str | None, notes: Notes) -> tuple[float, float] | None:
    """Mass fraction and temperature (K) of a liquid whose numbers depend on them; None of any other."""
    keys = ("liquid.mass_fraction", "liquid.temperature")
    share, temperature = (value_at(document, parts_of(key)) for key in keys)
    if liquid not in MIXTURES:
        for key, value in zip(keys, (share, temperature), strict=True):
            if value is not MISSING:
                raise unusable(key, f'expected none: it is for name = "{next(iter(MIXTURES))}"')
        return None
    if type(share) not in (int, float) or not 0 <= share <= 1:
        missing = "missing; " if share is MISSING else ""
        raise unusable(keys[0], f"{missing}expected the mass of the glycerol over that of the mixture, such as 0.87")
    if temperature is MISSING:
        temperature = "20 degC"
        notes[keys[1]] = Origin(keys[1], temperature, "default", value=parse_quantity(temperature, TEMPERATURE))
    try:
        return float(share), parse_quantity(str(temperature), TEMPERATURE)
    except ValueError as error:
        raise unusable(keys[1], str(error)) from error


@lru_cache(maxsize=1024)
def _known(
    known_to: Library, bead: str | None, wall: str | None, liquid: str | None, mixture: tuple[float, float] | None
) -> dict[str, Known]:
    """What is usual, and what the library has of materials and a liquid, by the keys of a case."""
    on_bead, on_wall = known_to.surface_pair(bead, bead), known_to.surface_pair(bead, wall)
    of_liquid = known_to.liquid(liquid, mixture) if liquid and known_to.has("liquids", liquid) else {}
    found = {
        "beads.density": known_to.material(bead)["density"] if bead and known_to.has("materials", bead) else None,
        "contact.friction.bead_bead": on_bead.get("friction"),
        "contact.friction.bead_wall": on_wall.get("friction"),
        **{key: on_wall.get(key.split(".")[1]) for key in _OF_SURFACES},
        **{f"liquid.{key}": known for key, known in of_liquid.items()},
    }
    return {**library.unmeasured()} | {key: known for key, known in found.items() if known}


@cache
def _origin_of(key: str, known: Known, liquid: str | None) -> Origin:
    """What was calibrated with other liquids is a guess for this one."""
    loose, text = library.unmeasured().get(key), str(known.written)
    if loose is None or (known.source and not known.calibrated_with):
        of_sizes = loose is not None and loose.logarithmic
        return Origin(key, text, known.origin, known.source, known.range, of_sizes, value=known.value)
    if liquid in known.calibrated_with:
        whence: Whence = "calibrated" if known.range else "assumed"
        return Origin(key, text, whence, known.source, known.range, loose.logarithmic, value=known.value)
    return Origin(key, text, "default", known.source, loose.range, loose.logarithmic, value=known.value)


def resolve(file: CaseFile, name: str, document: Mapping[str, Any], notes: Notes) -> Case:
    """Resolve a validated file, read from a document; ``notes`` are on what it leaves out.

    Raises `InputError` if something is missing that the library does not know, or keys contradict each other.
    """
    boundary = file.boundary
    _check_sizes(boundary)
    walkers = tuple(_walkers_of(key, table, boundary, notes) for key, table in file.walkers.items())
    mixture = _mixture_of(file.mixture, boundary) if file.mixture else None
    placed = Placed(tuple((*bead.at, bead.radius) for bead in file.placed)) if file.placed else None
    liquid, density = _liquid_of(file.liquid, notes), file.beads.density
    first = walkers[0].radii if walkers else ()
    dimer = Dimer((first[0], first[1]), density, liquid.surface_tension) if len(first) == 2 else None
    case = Case(
        name=name,
        title=file.title,
        walkers=walkers,
        mixture=mixture,
        placed=placed,
        boundary=boundary,
        drive=resolve_drive(file.drive, boundary, dimer, notes),
        gravity=file.environment.gravity,
        material=file.beads.material,
        density=density,
        liquid=liquid,
        contact=file.contact,
        seed=file.run.seed,
        run=Run(0.0, 1, 1, 0, False, 1, 1, 1, 1, 0.0, 0.0, 1),  # its step follows from the rest
    )
    if liquid.law not in LAWS:
        _check_law(case)
    case = replace(case, run=resolve_run(file.run, case, notes))
    along, across, _ = case.drive_axis
    uphill = atan2(across, along) + boundary.uphill if boundary.tilt else 0.0
    case = replace(case, boundary=replace(boundary, uphill=uphill))
    made = zip(file.walkers, case.walkers, strict=True)
    case = replace(case, walkers=tuple(_spaced(case, key, one, notes) for key, one in made))
    _check_bodies(case, file)
    if boundary.tilt and boundary.uphill == 0.0:
        notes.default("boundary.uphill", 0.0, "the direction of the drive")
    # Not in g: the paper's, 9.8 m/s², is not the case's gravity.
    notes["environment.gravity"] = Origin("", f"{case.gravity:g} m/s^2", "default", value=case.gravity)
    return case.read_from(document, partial(origins_of, file, document, notes))


def _check_law(case: Case) -> None:
    """Refuse a user's law that cannot be used for the beads of the case."""
    try:
        for radius in case.radii:
            bridge_at_rest(case, radius, inf)
    except ValueError as error:
        raise unusable("liquid.law", str(error)) from error


def _check_sizes(boundary: Boundary) -> None:
    """Refuse a boundary that has a size of another shape."""
    for key in {key for sizes in SIZES.values() for key in sizes} - {*SIZES[boundary.shape]}:
        if getattr(boundary, key) != getattr(Boundary, key):
            raise unusable(f"boundary.{key}", f"expected none of a {boundary.shape}")


def _liquid_of(table: Liquid, notes: Notes) -> Liquid:
    """The liquid of the bridges and their law; raises `InputError` if its viscosity is missing or said twice."""
    dynamic, kinematic = table.dynamic_viscosity, table.kinematic_viscosity
    if not isnan(dynamic) and kinematic is not None:
        raise unusable("liquid.dynamic_viscosity", "expected either kinematic_viscosity or dynamic_viscosity, not both")
    if kinematic is not None:
        assert table.density is not None
        dynamic = float(f"{kinematic * table.density:.15g}")
        notes.derived("liquid.dynamic_viscosity", dynamic, "from kinematic_viscosity and density")
    of_bridges = float(f"{dynamic * table.viscosity_ratio:.15g}")
    bare = replace(table, kinematic_viscosity=None, mass_fraction=None, temperature=None)
    return replace(bare, dynamic_viscosity=of_bridges, viscosity_ratio=1.0)


def _walkers_of(key: str, table: Walkers, boundary: Boundary, notes: Notes) -> Walkers:
    if table.facing in ("up", "down") and (not boundary.tilt or boundary.uphill):
        message = "on a plane that is tilted along the drive alone walkers face up or down"
        raise unusable(f"{key}.facing", f'expected "both", "right" or "left": {message}')
    if table.gap is None:
        notes.derived(f"{key}.gap", "auto", "where the forces at rest balance")
    of_others = ("arrangement", "places") if key == "dimers" else ("mean_radius", "sin_delta")
    for name in of_others:
        if getattr(table, name) not in ABSENT:
            raise unusable(f"{key}.{name}".replace("places", "at"), "expected none of " + key.partition("[")[0])
    walkers = replace(table, facing=_WAYS.get(table.facing, table.facing))
    if key == "dimers":
        radii = _radii(table, notes)
        return replace(walkers, radii=radii, mean_radius=None, sin_delta=None, arrangement="chain")
    if not 2 <= len(table.radii) <= 100:
        raise unusable(f"{key}.radii", "expected radii of 2 to 100 beads")
    if bool(table.arrangement) == bool(table.places):
        message = f"expected either an arrangement ({', '.join(ARRANGEMENTS)}) or places (at)"
        raise unusable(f"{key}.arrangement", message)
    return _arranged(walkers, key) if table.arrangement else _at_places(walkers, key)


def _radii(table: Walkers, notes: Notes) -> tuple[float, ...]:
    given = {name: getattr(table, name) for name in ("mean_radius", "sin_delta") if getattr(table, name) is not None}
    if table.radii:
        if len(table.radii) != 2:
            raise unusable("dimers.radii", 'expected two radii, such as ["0.3 mm", "0.2 mm"]')
        if given:
            message = "expected either the radii or mean_radius and sin_delta, not both"
            raise unusable(f"dimers.{next(iter(given))}", message)
        return table.radii
    assert table.mean_radius is not None
    assert table.sin_delta is not None
    first, second = (float(f"{table.mean_radius * share:.15g}") for share in (1 + table.sin_delta, 1 - table.sin_delta))
    notes.derived("dimers.radii", (first, second), "from mean_radius and sin_delta")
    return first, second


def _arranged(walkers: Walkers, key: str) -> Walkers:
    name = walkers.arrangement
    known = ARRANGEMENTS.get(name)
    if known is None:
        raise unusable(f"{key}.arrangement", expected_of(name, ARRANGEMENTS))
    key = f"{key}.radii"
    if not known.fewest <= len(walkers.radii) <= known.most:
        bound = f"at least {known.fewest}" if known.fewest < known.most else str(known.most)
        raise unusable(key, f"expected {bound} beads in a {name}")
    try:
        overlapping = touching(walkers.design, walkers.radii, -_OVERLAP)
    except ValueError as error:
        raise unusable(key, str(error)) from error
    if overlapping:
        one, other = (bead + 1 for bead in overlapping[0])
        raise unusable(key, f"beads {one} and {other} would overlap in a {name}; expected similar radii")
    return walkers


def _at_places(walkers: Walkers, key: str) -> Walkers:
    """A cluster whose beads are given places: they touch, do not overlap, and have a heading."""
    key, everyone, places = f"{key}.at", set(range(len(walkers.radii))), walkers.places
    if len(places) != len(everyone):
        raise unusable(key, f"expected a place for each of the {len(everyone)} beads")
    walkers = replace(walkers, arrangement="given")
    if overlapping := touching(places, walkers.radii, -_OVERLAP):
        one, other = overlapping[0]
        raise unusable(f"{key}[{other}]", f"overlaps with {key}[{one}]; expected beads that touch")
    if not any(walkers.front):
        raise unusable(key, "expected some beads ahead of others: this walker has no heading")
    joined = {0}
    for _ in everyone:
        joined |= {bead for pair in walkers.pairs if joined & {*pair} for bead in pair}
    if alone := everyone - joined:
        raise unusable(f"{key}[{min(alone)}]", "expected beads that touch: this bead is not connected to the first")
    return walkers


def _mixture_of(table: MixtureTable, boundary: Boundary) -> Mixture:
    """A mixture, its numbers of beads from shares, count or height."""
    small, large = (_sizes(key, getattr(table, key), table.sizes) for key in ("small", "large"))
    if max(small) >= min(large):
        raise unusable("mixture.large", "expected radii above those of the small beads")
    if (table.count is None) == (table.fill_height is None):
        raise unusable("mixture.count", "expected either a count or a fill_height")
    if not boundary.closed:
        raise unusable("boundary.shape", 'expected a container, such as "box": a mixture is poured into it')
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
            raise unusable("mixture.fill_height", f"that takes {count} beads; expected 1 to {MOST_BEADS}")
    few = round(count * share)
    return Mixture(small, large, (few, count - few))


def _sizes(key: str, bounds: tuple[float, float], number: int) -> tuple[float, ...]:
    """The middles of equal shares of a range of radii, m."""
    low, high = bounds
    if low > high:
        raise unusable(f"mixture.{key}", "expected the smaller radius first")
    return tuple(dict.fromkeys(float(f"{low + (high - low) * (k + 0.5) / number:.12g}") for k in range(number)))


def _spaced(case: Case, key: str, walkers: Walkers, notes: Notes) -> Walkers:
    """Settle the spacing of the walkers under a key and refuse starts in which beads overlap."""
    gap = walkers.gap
    if gap is not None and gap > 0.0:
        raise unusable(f"{key}.gap", "expected zero or less: a bridge forms on contact, so beads with a gap have none")
    _check_held(case, walkers)
    overlaps = contact_loads(case, walkers).overlaps if gap is None else (-gap,)
    if max(overlaps) * (1.0 + walkers.gap_spread) > 0.02 * min(walkers.radii):
        blamed, other = "contact.youngs_modulus", f"a larger modulus, or {key}.gap"
        if gap is not None:
            blamed, other = f"{key}.gap", f"{-0.02e6 * min(walkers.radii) / (1.0 + walkers.gap_spread):.3g} um or more"
        raise unusable(blamed, f"the beads overlap by more than 2 % of the smallest radius: expected {other}")
    if isinf(walkers.spacing):
        spacing = 2.0 * (walkers.length if walkers.meet else reach(case))
        avoided = "touch at the start" if walkers.meet else "meet"
        notes.derived(f"{key}.spacing", spacing, f"so that walkers do not {avoided}")
        return replace(walkers, spacing=spacing)
    # Beads of different walkers may touch, but not overlap, if they are meant to meet.
    least = (1.0 if walkers.meet else 1.5) * walkers.length
    if walkers.spacing < least and sum(one.replicates for one in case.walkers) > 1:
        message = f'neighbouring walkers would touch or overlap; expected at least {1e3 * least:.3g} mm, or "auto"'
        raise unusable(f"{key}.spacing", message)
    return walkers


def _check_held(case: Case, walkers: Walkers) -> None:
    """Refuse walkers that would not stay in contact at rest, because bridges push by more than weights press."""
    loads = contact_loads(case, walkers)
    names = [f"bead {bead} and the boundary" for bead in range(1, len(walkers.radii) + 1)]
    names += [f"beads {one + 1} and {other + 1}" for one, other in walkers.pairs]
    for name, pull, overlap in zip(names, loads.capillary, loads.overlaps, strict=True):
        if pull < 0.0 == overlap:  # no overlap: the load is tensile
            angle = case.liquid.contact_angle
            key, other = ("contact_angle", "a smaller angle or less liquid") if angle else ("law", "a law that pulls")
            pushed = f"at rest, the bridge pushes {name} apart ({-1e6 * pull:.3g} uN)"
            raise unusable(f"liquid.{key}", f"expected {other}: {pushed}")


def _check_bodies(case: Case, file: CaseFile) -> None:
    """Refuse bodies that do not fit into the boundary or beside each other."""
    boundary, mixture = case.boundary, case.mixture
    if case.run.ranks > 1 and not boundary.closed:
        raise unusable("run.ranks", "expected 1: walkers on a plane run slower on several processes")
    if not case.walkers and mixture is None and "seed" in file.run.model_fields_set:
        raise unusable("run.seed", "expected none with placed beads: every start would be the same")
    if case.liquid.conserved and (case.walkers or not boundary.closed):
        raise unusable("liquid.conserved", "expected false: only loose beads in a container share their liquid")
    if mixture is not None:
        _check_pour(mixture, boundary, case.tops_of_others(mixture))
    if case.placed is not None or case.meets or (case.walkers and not boundary.bare):
        _check_places(case, [key for key, table in file.walkers.items() for _ in range(table.replicates)])


def _check_pour(mixture: Mixture, boundary: Boundary, floor: float) -> None:
    largest = max(mixture.large)
    if boundary.width < 4.0 * largest:
        raise unusable("boundary.width", "expected at least two of the large beads side by side")
    if boundary.layer(largest).tight and boundary.width < 8.0 * largest:
        raise unusable("boundary.width", "expected at least four of the large beads side by side")
    level = floor + mixture.level(boundary)
    if level > 2.0 * boundary.height:  # walls and simulation go on to there
        needed = f"{level / 2.0 * 1e3:.3g} mm"
        raise unusable("boundary.height", f"too low for {mixture.count} beads; expected {needed} or more")


def _check_places(case: Case, keys: list[str]) -> None:
    """Walkers (each with its table's key) and beads that are placed: between the walls, and not within each other."""
    import numpy as np

    boundary = case.boundary
    standing: list[Standing] = []
    try:
        standing.extend(one for _, one in islice(case.standing(), len(keys)))
    except ValueError as error:
        raise unusable(f"{keys[len(standing)]}.radii", str(error)) from error
    if boundary.width < 2.0 * (1.0 - _OVERLAP) * max((max(one.radii) for one in case.walkers), default=0.0):
        raise unusable("boundary.width", "expected more than a bead's diameter")
    grid = boundary.grid(len(keys), max(one.spacing for one in case.walkers)) if keys else []
    of_walkers = zip(keys, grid, standing, strict=True)
    stood = [(key, x, y, one) for key, (x, y), walker in of_walkers for one in walker.beads]
    beads = [(key, (x + one.x, y + one.y, one.z), one.radius) for key, x, y, one in stood]
    owner = [number for number, walker in enumerate(standing) for _ in walker.beads]
    placed = case.placed.beads if case.placed is not None else ()
    walking = len(beads)
    beads += [(f"placed[{number}]", (x, y, z), radius) for number, (x, y, z, radius) in enumerate(placed)]
    clearances = boundary.side_clearance(np.array([bead[1] for bead in beads]))
    for number, ((key, (_, _, z), radius), clearance) in enumerate(zip(beads, clearances, strict=True)):
        least = (1.0 - _OVERLAP) * radius
        beside = clearance < least
        if number < walking and beside:
            message = f"the walkers do not fit between the walls of the {boundary.shape}: expected fewer or smaller"
            raise unusable(f"{key}.replicates", f"{message} walkers")
        if number < walking and z + radius > boundary.height:
            message = f"too low for the walkers of {key}; expected {1e3 * (z + radius):.4g} mm or more"
            raise unusable("boundary.height", message)
        if number >= walking and (beside or z < least or z + radius > boundary.height):
            raise unusable(f"{key}.at", "expected a bead within the boundary")
    if not (placed or case.meets):
        return
    from scipy.spatial import cKDTree

    near = cKDTree([place for _, place, _ in beads]).query_pairs(2.0 * max(radius for *_, radius in beads))
    strangers = (pair for pair in near if pair[1] >= walking or owner[pair[0]] != owner[pair[1]])
    for one, other in sorted(strangers, key=lambda pair: pair[::-1]):
        (key, place, first), (other_key, other_place, second) = beads[one], beads[other]
        least = first + second - _OVERLAP * min(first, second)
        if dist(place, other_place) < least:
            if other < walking:
                raise unusable(f"{other_key}.spacing", "beads of two walkers would overlap at the start; expected more")
            message = f"overlaps with {key if one >= walking else f'one of {key}'}; expected their centres at least"
            raise unusable(f"{other_key}.at", f"{message} {1e3 * least:.4g} mm apart")
