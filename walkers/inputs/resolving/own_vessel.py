"""A vessel of the user's own, of a mesh or of planes: its walls, its extent, and its size in beads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import acos, degrees
from typing import Any

from walkers.errors import key_error
from walkers.inputs.config_table import present
from walkers.inputs.meshes.mesh_surface import vessel_of
from walkers.inputs.meshes.vessel import SHARP, Vessel
from walkers.inputs.resolving.notes import Notes
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.drive import unit_vector
from walkers.inputs.tables.shapes.vessel import Plane
from walkers.inputs.tables.shapes.walls import BOTTOM

_WIDEST = 1000.0  # largest width of a vessel in diameters of the largest bead


def with_vessel(
    boundary: Boundary,
    document: Mapping[str, Any],
    largest: float,
    notes: Notes,
) -> Boundary:
    """Complete a vessel of the user's own by its walls and its extent.

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
        With planes, or with points and triangles if planes cannot describe the vessel. A boundary
        of another shape is the same.

    Raises
    ------
    InputError
        If the mesh or the planes are no vessel, or if beads are too large or too small for it.
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
    width, size = float(f"{2.0 * abs(vessel.points[:, :2]).max():.12g}"), 2.0 * largest
    if not 1.0 < width / size < _WIDEST:
        wide, across = (
            f"{length:.4g} m" if length >= 1.0 else f"{1e3 * length:.4g} mm"
            for length in (width, size)
        )
        message = f"the vessel is {wide} wide and the beads {across}; expected 1 to {_WIDEST:g} beads across"
        raise key_error("boundary.scale" if boundary.mesh else "boundary.planes", message)
    notes.add("boundary.width", why)
    notes.add("boundary.shape", why)
    return boundary.with_values(width=width, shape="vessel")


def _of_mesh(boundary: Boundary, mesh: str, document: Mapping[str, Any]) -> tuple[Boundary, Vessel]:
    """The boundary with the walls of a mesh, and its surface."""
    try:
        vessel = vessel_of(document["meshes"][mesh], present(boundary.scale, "boundary.scale"))
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise key_error("meshes", f"expected points and triangles of {mesh}") from error
    planes = tuple(Plane(point=point, normal=normal) for point, normal in vessel.planes())
    if planes:
        return boundary.with_values(planes=planes), vessel
    points = tuple(map(tuple, vessel.points.tolist()))
    triangles = tuple(map(tuple, vessel.triangles.tolist()))
    return boundary.with_values(points=points, triangles=triangles), vessel


def _of_planes(boundary: Boundary) -> tuple[Boundary, Vessel]:
    """The boundary with planes in order, and the surface between them."""
    boundary = boundary.with_values(planes=_planes(boundary.planes))
    vessel = boundary.with_values(shape="vessel").vessel
    if abs(lowest := float(vessel.points[:, 2].min())) > 1e-9:
        raise key_error(
            "boundary.planes",
            f"have their lowest point at z = {1e3 * lowest:.4g} mm; expected 0 mm",
        )
    if (top := vessel.height) < (1.0 - 1e-9) * present(boundary.height, "boundary.height"):
        raise key_error(
            "boundary.height", f"the planes close the vessel; expected at most {1e3 * top:.4g} mm"
        )
    return boundary, vessel


def _planes(planes: Sequence[Plane]) -> tuple[Plane, ...]:
    """The planes with normals of length one, a level one through the origin first."""
    units = []
    for number, plane in enumerate(planes):
        try:
            units.append(plane.with_values(normal=unit_vector(plane.normal)))
        except ValueError as error:
            raise key_error(
                f"boundary.planes[{number}].normal", "expected a direction such as [0, 0, 1]"
            ) from error
    for (number, first), (index, second) in combinations(enumerate(units), 2):
        turn = acos(
            max(
                -1.0, min(1.0, sum(a * b for a, b in zip(first.normal, second.normal, strict=True)))
            )
        )
        if turn < SHARP:
            message = f"turns by {degrees(turn):.3g} deg from planes[{number}]; expected 45 deg or more, or a mesh"
            raise key_error(f"boundary.planes[{index}].normal", message)
    return tuple(
        sorted(units, key=lambda plane: plane.normal != BOTTOM.normal or plane.point[2] != 0.0)
    )
