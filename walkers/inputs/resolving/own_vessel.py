"""A vessel of the user's own, of a mesh or of planes: its walls, its extent, and its size in beads.

Surfaces of vessels themselves are the subject of `walkers.inputs.meshes`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import acos, degrees
from typing import Any

from walkers.arrays import Vector
from walkers.errors import key_error
from walkers.inputs.config_table import present
from walkers.inputs.meshes.mesh_surface import vessel_of
from walkers.inputs.meshes.vessel import SHARP, Vessel
from walkers.inputs.resolving.notes import Notes
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.drive import unit_vector
from walkers.inputs.tables.shapes.vessel import Plane
from walkers.inputs.tables.shapes.walls import BOTTOM

_ROUNDING = 1e-9
"""Rounding error of the height of a point, m, and relative one of a height."""
_WIDEST = 1000.0
"""Largest width of a vessel in diameters of the largest bead."""


def with_vessel(
    boundary: Boundary,
    document: Mapping[str, Any],
    largest: float,
    notes: Notes,
) -> Boundary:
    """Complete a vessel of the user's own by its walls and its extent.

    Boundaries of other shapes are returned as they are.

    Parameters
    ----------
    boundary
        The boundary as the file of a case says it.
    document
        The tables of the case, with the points and triangles of its mesh.
    largest
        Radius of the largest bead, m.
    notes
        Get the sources of the extent.

    Returns
    -------
    Boundary
        With planes, or with points and triangles if planes cannot describe the vessel.

    Raises
    ------
    InputError
        If the mesh or the planes do not form a vessel, or if beads are too large or too small
        for it.
    """
    if boundary.mesh is None and not boundary.planes:
        return boundary
    if boundary.mesh is not None:
        why = "of the mesh"
        boundary, vessel = _of_mesh(boundary, boundary.mesh, document)
        boundary = boundary.with_values(height=vessel.height)
        notes.add("boundary.height", why)
    else:
        why = "of the planes"
        boundary, vessel = _of_planes(boundary)
    width = float(f"{2.0 * abs(vessel.points[:, :2]).max():.12g}")
    _check_width(boundary, width, 2.0 * largest)
    notes.add("boundary.width", why)
    notes.add("boundary.shape", why)
    return boundary.with_values(width=width, shape="vessel")


def _check_width(boundary: Boundary, width: float, diameter: float) -> None:
    """Refuse a vessel whose width (m) is too small or too large for the beads (diameter in m)."""
    if 1.0 < width / diameter < _WIDEST:
        return
    problem = f"the vessel is {_length_text(width)} wide and the beads {_length_text(diameter)}"
    key = "boundary.scale" if boundary.mesh else "boundary.planes"
    raise key_error(key, f"{problem}; expected 1 to {_WIDEST:g} beads across")


def _length_text(length: float) -> str:
    """A length (m) in metres or in millimetres."""
    if length >= 1.0:
        return f"{length:.4g} m"
    return f"{1e3 * length:.4g} mm"


def _of_mesh(boundary: Boundary, mesh: str, document: Mapping[str, Any]) -> tuple[Boundary, Vessel]:
    """The boundary with the planes of a mesh, or else with its triangles, and its surface."""
    try:
        vessel = vessel_of(document["meshes"][mesh], present(boundary.scale, "boundary.scale"))
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise key_error("meshes", f"expected points and triangles of {mesh}") from error
    planes = tuple(Plane(point=point, normal=normal) for point, normal in vessel.planes())
    if planes:
        return boundary.with_values(planes=planes), vessel
    points = tuple(tuple(point) for point in vessel.points.tolist())
    triangles = tuple(tuple(triangle) for triangle in vessel.triangles.tolist())
    return boundary.with_values(points=points, triangles=triangles), vessel


def _of_planes(boundary: Boundary) -> tuple[Boundary, Vessel]:
    """The boundary with planes in order, and the surface between them."""
    boundary = boundary.with_values(planes=_planes(boundary.planes))
    vessel = boundary.with_values(shape="vessel").vessel
    lowest = float(vessel.points[:, 2].min())
    if abs(lowest) > _ROUNDING:
        problem = f"have their lowest point at z = {1e3 * lowest:.4g} mm"
        raise key_error("boundary.planes", f"{problem}; expected 0 mm")
    if vessel.height < (1.0 - _ROUNDING) * present(boundary.height, "boundary.height"):
        expected = f"expected at most {1e3 * vessel.height:.4g} mm"
        raise key_error("boundary.height", f"the planes close the vessel; {expected}")
    return boundary, vessel


def _planes(planes: Sequence[Plane]) -> tuple[Plane, ...]:
    """The planes with normals of length one, level planes through the origin first.

    Refuses planes that turn by less than 45°.
    """
    with_unit_normals = []
    for number, plane in enumerate(planes):
        try:
            with_unit_normals.append(plane.with_values(normal=unit_vector(plane.normal)))
        except ValueError as error:
            expected = "expected a direction such as [0, 0, 1]"
            raise key_error(f"boundary.planes[{number}].normal", expected) from error
    for (number, plane), (later_number, later) in combinations(enumerate(with_unit_normals), 2):
        turn = _angle_between(plane.normal, later.normal)
        if turn < SHARP:
            problem = f"turns by {degrees(turn):.3g} deg from planes[{number}]"
            message = f"{problem}; expected 45 deg or more, or a mesh"
            raise key_error(f"boundary.planes[{later_number}].normal", message)
    floors = [plane for plane in with_unit_normals if _is_floor(plane)]
    sides = [plane for plane in with_unit_normals if not _is_floor(plane)]
    return (*floors, *sides)


def _angle_between(first: Vector, second: Vector) -> float:
    """Angle between two unit vectors, rad."""
    cosine = sum(a * b for a, b in zip(first, second, strict=True))
    return acos(max(-1.0, min(1.0, cosine)))


def _is_floor(plane: Plane) -> bool:
    """Whether a plane is level, with the beads above it, and at z = 0."""
    return plane.normal == BOTTOM.normal and plane.point[2] == 0.0
