"""Vessels of the user's own that are given by planes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from walkers.arrays import Vector
from walkers.errors import key_error
from walkers.inputs.meshes.triangles import merged
from walkers.inputs.meshes.vessel import Vessel


def vessel_between(planes: Sequence[tuple[Vector, Vector]], height: float) -> Vessel:
    """The vessel that planes enclose up to a height (m); raises `InputError` if they enclose none."""
    from scipy.optimize import linprog
    from scipy.spatial import HalfspaceIntersection

    far = 1e3 * height
    ends = [((0.0, 0.0, height), (0.0, 0.0, -1.0))]
    ends += [(tuple(-far * axis), tuple(axis)) for axis in np.array([*np.eye(3), *-np.eye(3)[:2]])]
    points, normals = (np.array(column) for column in zip(*planes, *ends, strict=True))
    offsets = np.einsum("px,px->p", normals, points)
    spheres = np.column_stack(
        [-normals, np.ones(len(normals))]
    )  # the largest one between them is in the middle
    best = linprog([0, 0, 0, -1], spheres, -offsets, bounds=[(None, None)] * 3 + [(0, None)])
    if best.status or best.x[3] < 1e-9:
        raise key_error(
            "boundary.planes",
            "enclose nothing; expected normals toward the beads, and a height above them",
        )
    room = HalfspaceIntersection(np.column_stack([-normals, offsets]), best.x[:3])
    corners = room.intersections
    if np.abs(corners).max() > 0.999 * far:
        out = corners[np.abs(corners).max(axis=1).argmax()]
        side = f"{'-+'[int(out[abs(out).argmax()] > 0.0)]}{'xyz'[int(abs(out).argmax())]}"
        raise key_error(
            "boundary.planes", f"are open toward {side}; expected planes that close the vessel"
        )
    triangles: list[list[int]] = []
    for number, normal in enumerate(normals[: len(planes)]):
        held = np.array(
            [place for place, meeting in enumerate(room.dual_facets) if number in meeting]
        )
        if len(held) < 3:
            raise key_error(
                f"boundary.planes[{number}]",
                "is behind the others; expected planes that beads can touch",
            )
        spokes = corners[held] - corners[held].mean(axis=0)
        around = held[
            np.argsort(np.arctan2(spokes @ np.cross(normal, spokes[0]), spokes @ spokes[0]))
        ]
        triangles += [[around[0], *pair] for pair in pairwise(around[1:])]
    return Vessel(*merged(corners, np.array(triangles)))
