"""STL meshes of the walls: a face is one triangle far larger than the box, a round wall a prism.

Each size of beads in a round wall has a prism of its own, as a mesh of these beads' group: its faces are so narrow that
they end where these beads, touching, leave one for the next, and `precision` is so coarse that the edges between them
count as shared all the same. A bead that comes to a triangle of a lower number is held by both until it leaves the
first: at less than 2 % of the places, and on half of their ways only.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from walkers.inputs.boundary import Face, Round
from walkers.templates.scene import Bead


def face_triangle(face: Face, size: float) -> str:
    """STL facet of a face: one triangle about the face's centroid, its normal toward the beads.

    Parameters
    ----------
    face
        The wall.
    size
        Half of the triangle's width, m; far larger than the box.
    """
    index = ("x", "y", "z").index(face.axis)
    # Two axes in the plane of the wall, in the order that makes the corners run counter-clockwise about the normal.
    first, second = ((index + 1) % 3, (index + 2) % 3)[:: face.side]
    corners = []
    for along, up in ((-1.0, -0.6), (1.0, -0.6), (0.0, 1.2)):
        offset = [0.0, 0.0, 0.0]
        offset[first], offset[second] = along * size, up * size
        away = face.turned((offset[0], offset[1], offset[2]))
        corners.append([middle + shift for middle, shift in zip(face.centroid, away, strict=True)])
    return _facet(face, corners)


_SLACK = 0.02
"""By how much of their radius beads may be pressed into a round wall without a gap between its faces."""
_SAME_SIZE = 0.01
"""Of a round wall's radius: beads whose radii differ by less share its mesh."""
_COARSEST = 9e-4
"""m; the engine takes no precision of a mesh above a millimetre."""


@dataclass(frozen=True)
class WallMesh:
    """The walls as some of the beads meet them.

    Attributes
    ----------
    name
        Of its file, without the suffix.
    text
        STL.
    beads
        Ids of the beads that meet it; empty if all do.
    precision
        Distance up to which the engine takes two nodes for one, m; None for its own.
    """

    name: str
    text: str
    beads: tuple[int, ...] = ()
    precision: float | None = None


def wall_meshes(beads: Iterable[Bead], faces: Sequence[Face], half_width: float) -> tuple[WallMesh, ...]:
    """The walls: one mesh for all beads, or where a wall is round, one for each size of beads.

    Parameters
    ----------
    beads
        What is within the walls.
    faces
        The walls.
    half_width
        Half of the simulation box's largest side, m.
    """
    around = next((face.of for face in faces if face.of), None)
    if around is None:
        return (WallMesh("walls", _stl(face_triangle(face, 20.0 * half_width) for face in faces)),)
    sizes: list[list[Bead]] = []
    for bead in sorted(beads, key=lambda one: (one.radius, one.id)):
        if not sizes or bead.radius - sizes[-1][0].radius > _SAME_SIZE * around.radius:
            sizes.append([])
        sizes[-1].append(bead)
    meshes = []
    for number, size in enumerate(sizes, 1):
        half = around.half_width((1.0 - _SLACK) * size[0].radius)
        facets = (strip(face, face.of, half) if face.of else face_triangle(face, 20.0 * half_width) for face in faces)
        ids = tuple(sorted(bead.id for bead in size))
        # Nodes of adjacent faces are less than that apart, those of one face twice as far.
        meshes.append(WallMesh(f"walls_{number}", _stl(facets), ids, min(half, _COARSEST)))
    return tuple(meshes)


def strip(face: Face, around: Round, half: float) -> str:
    """STL facets of a side of a round wall: an upright strip, each piece of it two triangles.

    Parameters
    ----------
    face
        The side.
    around
        The round wall.
    half
        Half of the strip's width, m.
    """
    x, y, _ = face.centroid
    facets = []
    for piece in range(around.pieces):
        bottom, top = (around.bottom + (around.top - around.bottom) * (piece + end) / around.pieces for end in (0, 1))
        corners = []
        for along, z in ((-half, bottom), (half, bottom), (half, top), (-half, top)):
            right, up, _ = face.turned((0.0, along, 0.0))
            corners.append((x + right, y + up, z))
        facets += [_facet(face, [corners[number] for number in numbers]) for numbers in ((0, 3, 2), (0, 2, 1))]
    return "".join(facets)


def _facet(face: Face, corners: Iterable[Sequence[float]]) -> str:
    vertices = "".join("      vertex " + " ".join(repr(float(value)) for value in one) + "\n" for one in corners)
    normal = " ".join(repr(value) for value in face.normal)
    return f"  facet normal {normal}\n    outer loop\n{vertices}    endloop\n  endfacet\n"


def _stl(facets: Iterable[str]) -> str:
    return f"solid walls\n{''.join(facets)}endsolid walls\n"
