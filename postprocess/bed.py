"""The pile itself, frame by frame: its surface, density, segregation, agitation and bridges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from inputs.pile import Container
from postprocess.pile import Bridges

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Bed:
    """One frame of a pile.

    Attributes
    ----------
    surface, surface_low, surface_high : float
        Median, 10th and 90th percentile over x-y cells of the height of each cell's highest bead top in the bulk, m.
    brazil_nut, brazil_nut_of_bulk : float
        Mean height of the large beads minus that of the small ones, over the sum of the two; of all beads, and of the
        bulk alone.
    mean_square_velocity : float
        m²/s², relative to the container, at the phase at which frames are taken (at 0 several times below the mean over
        a cycle).
    coordination : float
        Bridges between beads, touching or open, twice, over beads.
    touching, opened : int
        Bridges between beads that touch and that do not.
    mean_force : float
        Normal force of the bridges between beads, positive where they pull together, N.
    bulk : int
        Beads in the bulk.
    """

    surface: float
    surface_low: float
    surface_high: float
    brazil_nut: float
    brazil_nut_of_bulk: float
    mean_square_velocity: float
    coordination: float
    touching: int
    opened: int
    mean_force: float
    bulk: int


def bed_of(
    position: FloatArray,
    velocity: FloatArray,
    radius: FloatArray,
    large: npt.NDArray[np.bool_],
    bulk: npt.NDArray[np.bool_],
    bridges: Bridges,
    container: Container,
) -> Bed:
    """The state of a pile in a frame.

    Parameters
    ----------
    position, velocity : ndarray, shape (N, 3)
    radius : ndarray, shape (N,)
    large, bulk : ndarray of bool, shape (N,)
        Class, and whether a bead belongs to the bulk.
    bridges
        Of the frame.
    container
        Its cross-section is cut into cells of about four large radii.
    """
    tops = surface_cells(position[bulk], radius[bulk], container, 4.0 * float(radius.max()))
    low, middle, high = (float(value) for value in np.percentile(tops, (10.0, 50.0, 90.0)))
    touching = int((bridges.gap <= 0.0).sum())
    return Bed(
        surface=middle,
        surface_low=low,
        surface_high=high,
        brazil_nut=segregation(position[:, 2], large),
        brazil_nut_of_bulk=segregation(position[bulk, 2], large[bulk]),
        mean_square_velocity=float(np.mean(np.sum(velocity**2, axis=1))),
        coordination=2.0 * len(bridges.beads) / len(position),
        touching=touching,
        opened=len(bridges.gap) - touching,
        mean_force=float(bridges.force.mean()) if len(bridges.force) else 0.0,
        bulk=int(bulk.sum()),
    )


def surface_cells(position: FloatArray, radius: FloatArray, container: Container, cell: float) -> FloatArray:
    """Height of the highest bead top in each x-y cell that has a bead, m."""
    across = max(1, int(container.width / cell))
    place = np.clip(((position[:, :2] / container.width + 0.5) * across).astype(int), 0, across - 1)
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
    position: FloatArray, radius: FloatArray, container: Container, layer: float
) -> tuple[FloatArray, FloatArray]:
    """Packing fraction against height, averaged over frames.

    Parameters
    ----------
    position : ndarray, shape (F, N, 3)
    radius : ndarray, shape (N,)
    container
        Gives the cross-section.
    layer
        Thickness of the layers, m. A sphere's volume is shared out exactly between the layers that it reaches into.

    Returns
    -------
    height : ndarray, shape (L,)
        Middles of the layers, m.
    fraction : ndarray, shape (L,)
    """
    top = float((position[..., 2] + radius).max())
    edges = np.arange(0.0, top + layer, layer)
    below = np.zeros(len(edges))
    for frame in position:
        # Volume of a sphere below an edge that lies h above its centre.
        h = np.clip(edges[:, None] - frame[:, 2], -radius, radius)
        below += (np.pi * (2.0 / 3.0 * radius**3 + radius**2 * h - h**3 / 3.0)).sum(axis=1) / len(position)
    volumes = np.diff(below)
    return (edges[1:] + edges[:-1]) / 2.0, volumes / (container.cross_section * layer)
