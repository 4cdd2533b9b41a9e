"""The pile itself, frame by frame: its surface, density, segregation, agitation and bridges."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from walkers.inputs.boundary import Boundary
from walkers.physics.capillary import bridge_volume_at_wall, bridge_volume_between_beads
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Bridges, Motion


def bed_of(motion: Motion, bulk: npt.NDArray[np.bool_], bridges: Bridges, liquid: FloatArray) -> dict[str, float | int]:
    """The state of a pile in a frame: most columns of `walkers.postprocess.tables.BED`.

    Parameters
    ----------
    motion
        Of the pile.
    bulk : ndarray of bool, shape (N,)
        Whether a bead belongs to the bulk.
    bridges
        Of the frame.
    liquid : ndarray, shape (N,)
        Of `liquid_of_beads`.
    """
    frame = bridges.frame
    position, radius, large = motion.position[frame], motion.radius, motion.large
    container = motion.case.boundary  # its cross-section is cut into cells of about four large radii
    tops = surface_cells(position[bulk], radius[bulk], container, 4.0 * float(radius.max()))
    # With no bulk the floor is the surface.
    low, middle, high = (float(value) for value in np.percentile(tops if len(tops) else [0.0], (10.0, 50.0, 90.0)))
    touching = int((bridges.gap <= 0.0).sum())
    return {
        "surface": middle,
        "surface_low": low,
        "surface_high": high,
        "brazil_nut": segregation(position[:, 2], large),
        "brazil_nut_of_bulk": segregation(position[bulk, 2], large[bulk]),
        "mean_square_velocity": float(np.mean(np.sum(motion.velocity[frame] ** 2, axis=1))),
        "contacts": 2.0 * touching / len(position),
        "bridges": 2.0 * len(bridges.beads) / len(position),
        "touching": touching,
        "opened": len(bridges.gap) - touching,
        "mean_force": float(bridges.force.mean()) if len(bridges.force) else 0.0,
        "liquid_in_bridges": float(liquid.sum()),
        "bulk": int(bulk.sum()),
    }


def coordination_of_inner(bridges: Bridges, count: int) -> dict[str, float | None]:
    """Contacts and bridges, to other beads, of the beads that are bridged to no wall and not to the floor.

    Beads at a wall have fewer neighbours among the beads than those within, which a small pile has few of.

    Parameters
    ----------
    bridges
        Of a frame.
    count
        Number of beads.

    Returns
    -------
    dict
        ``beads``, how many they are, ``contacts`` and ``bridges``, the means of these beads; None where there is none.
    """
    inner = np.ones(count, dtype=bool)
    inner[bridges.wall_beads] = False
    beads = int(inner.sum())
    ends = inner[bridges.beads]
    if not beads:
        return {"beads": 0, "contacts": None, "bridges": None}
    return {
        "beads": beads,
        "contacts": float(ends[bridges.gap <= 0.0].sum() / beads),
        "bridges": float(ends.sum() / beads),
    }


def liquid_of_beads(radius: FloatArray, volume_fraction: float, bridges: Bridges) -> FloatArray:
    """Liquid in the bridges of each bead, m³, shape (N,): half of that of each of its bridges, all of that at walls.

    The engine gives a bridge a share of the films of its two beads, that of the caps which they cover of each other
    (Shi and McCarthy 2008), and half of a bead's film to a bridge with a wall, whatever other bridges it has. Caps of
    beads that touch do not overlap, so that a frame's liquid is less than was given; the rest is on the beads.
    """
    sizes, which = np.unique(radius, return_inverse=True)
    between = np.array([[bridge_volume_between_beads(one, other, volume_fraction) for other in sizes] for one in sizes])
    at_wall = np.array([bridge_volume_at_wall(size, volume_fraction) for size in sizes])
    liquid = np.zeros(len(radius))
    pairs = bridges.beads
    np.add.at(liquid, pairs, between[which[pairs[:, 0]], which[pairs[:, 1]]][:, None] / 2.0)
    np.add.at(liquid, bridges.wall_beads, at_wall[which[bridges.wall_beads]])
    return liquid


def surface_cells(position: FloatArray, radius: FloatArray, container: Boundary, cell: float) -> FloatArray:
    """Height of the highest bead top in each x-y cell that has a bead, m."""
    across = max(1, int(container.inner_width / cell))
    place = np.clip(((position[:, :2] / container.inner_width + 0.5) * across).astype(int), 0, across - 1)
    number = place[:, 0] * across + place[:, 1]
    tops = np.full(across * across, -np.inf)
    np.maximum.at(tops, number, position[:, 2] + radius)
    found: FloatArray = tops[np.isfinite(tops)]
    return found


def segregation(height: FloatArray, large: npt.NDArray[np.bool_]) -> float:
    """The Brazil-nut index: ⟨z⟩ of the large beads minus ⟨z⟩ of the small ones, over their sum; 0 without a class."""
    if not large.any() or large.all():
        return 0.0
    above, below = float(height[large].mean()), float(height[~large].mean())
    return (above - below) / (above + below)


def packing_profile(
    position: FloatArray, radius: FloatArray, liquid: FloatArray, container: Boundary, layer: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Packing fraction and liquid against height, averaged over frames.

    Parameters
    ----------
    position : ndarray, shape (F, N, 3)
    radius : ndarray, shape (N,)
    liquid : ndarray, shape (F, N)
        Of `liquid_of_beads`; it is taken to be where the bead's centre is.
    container
        Gives the cross-section.
    layer
        Thickness of the layers, m. A sphere's volume is shared out exactly between the layers that it reaches into.

    Returns
    -------
    height : ndarray, shape (L,)
        Middles of the layers, m.
    fraction, liquid_fraction : ndarray, shape (L,)
        Volumes of beads and of bridges over that of the layer.
    """
    top = float((position[..., 2] + radius).max())
    edges = np.arange(0.0, top + layer, layer)
    below = np.zeros(len(edges))
    for frame in position:
        # Volume of a sphere below an edge that lies h above its centre.
        h = np.clip(edges[:, None] - frame[:, 2], -radius, radius)
        below += (np.pi * (2.0 / 3.0 * radius**3 + radius**2 * h - h**3 / 3.0)).sum(axis=1) / len(position)
    wet = np.histogram(position[..., 2], bins=edges, weights=liquid)[0] / len(position)
    room = container.cross_section * layer
    return (edges[1:] + edges[:-1]) / 2.0, np.diff(below) / room, wet / room
