"""A pile for ParaView: beads, bridges and the container as .vtp, joined by one .pvd in seconds."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.inputs.pile import Container
from walkers.postprocess.clusters import components
from walkers.postprocess.paraview import FOLDER_NAME, Frame, lines_between, write_series
from walkers.postprocess.pile import Bridges, PileMotion, read_bridges
from walkers.postprocess.pile_result import PileAnalysis, analyse

if TYPE_CHECKING:
    import pyvista as pv

COLLECTION_NAME = "pile.pvd"


def write_pile_vtk(directory: Path, *, every: int = 1, vtu: bool = False, destination: Path | None = None) -> Path:
    """Write a pile for ParaView.

    Parameters
    ----------
    directory
        A run directory.
    every
        Take one of so many frames of the drive.
    vtu
        Also write the beads as ``.vtu``.
    destination
        Folder to write, replaced if it holds nothing but such files; ``vtk`` in the run directory if None.

    Returns
    -------
    Path
        The ``.pvd`` file: its times are seconds of drive; part 0 the beads, part 1 the container, part 2 the bridges.

    Raises
    ------
    InputError
        If the folder holds anything else than such files.
    """
    frames = _frames(analyse(directory), max(1, every))
    return write_series(destination or directory / FOLDER_NAME, COLLECTION_NAME, frames, vtu=vtu)


def _frames(found: PileAnalysis, every: int) -> Iterator[Frame]:
    motion = found.motion
    start = motion.first_driven
    for frame, bridges in enumerate(read_bridges(motion)):
        if frame < start or (frame - start) % every:
            continue
        meshes = {
            0: ("beads", beads_of(found, frame, bridges)),
            1: ("container", container_of(motion.case.container)),
            2: ("bridges", bridges_of(motion, frame, bridges)),
        }
        yield Frame(float(motion.time[frame]), frame, meshes)


def beads_of(found: PileAnalysis, frame: int, bridges: Bridges) -> pv.PolyData:
    """Beads of a frame as points, relative to the container, SI units.

    Point data: ``bead`` (number, from 0), ``radius``, ``large``, ``velocity``, ``speed``, ``component`` (connected by
    bridges), ``liquid`` (in its bridges, m³), ``track`` (of `walkers.postprocess.clusters`; -1 for none) and
    ``is_climber``.
    """
    import pyvista as pv

    motion = found.motion
    count = len(motion.radius)
    track, climber = np.full(count, -1, dtype=np.int64), np.zeros(count, dtype=np.int64)
    for number, (one, climb) in enumerate(zip(found.tracks, found.climbs, strict=True)):
        if members := list(one.members_at(frame)):
            track[members] = number
            climber[members] = int(climb.climbed)
    mesh = pv.PolyData(motion.position[frame].copy())
    mesh.point_data["bead"] = np.arange(count)
    mesh.point_data["radius"] = motion.radius
    mesh.point_data["large"] = motion.large.astype(np.int64)
    mesh.point_data["velocity"] = motion.velocity[frame].copy()
    mesh.point_data["speed"] = np.linalg.norm(motion.velocity[frame], axis=1)
    mesh.point_data["component"] = components(count, bridges)
    mesh.point_data["liquid"] = found.liquid[frame].copy()
    mesh.point_data["track"] = track
    mesh.point_data["is_climber"] = climber
    return mesh


def bridges_of(motion: PileMotion, frame: int, bridges: Bridges) -> pv.PolyData:
    """Bridges between beads as lines between their centres, with ``force`` (N), ``gap`` (m) and ``touching``."""
    mesh = lines_between(motion.position[frame][bridges.beads])
    mesh.cell_data["force"] = bridges.force
    mesh.cell_data["gap"] = bridges.gap
    mesh.cell_data["touching"] = (bridges.gap <= 0.0).astype(np.int64)
    return mesh


def container_of(container: Container) -> pv.PolyData:
    """Floor and walls up to the rim."""
    import pyvista as pv

    half, height = container.width / 2.0, container.height
    if container.shape == "cylinder":
        tube: pv.PolyData = pv.Cylinder(
            center=(0.0, 0.0, height / 2.0), direction=(0.0, 0.0, 1.0), radius=half, height=height, capping=False
        )
        return tube
    box = pv.Box(bounds=(-half, half, -half, half, 0.0, container.height))
    # The last face but one is the floor, the last the lid, which is not there.
    sides: pv.PolyData = box.extract_cells(range(5)).extract_surface()
    return sides
