"""Files for ParaView by meshio: beads, boundary and bridges of each frame, listed with their times (s) in a .pvd.

Names of arrays end with their units, as in ``speed (m/s)``; indices and numbers have none. ``show.py`` shows the files;
the ``.pvd`` also holds the view of the run, for this script.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from walkers.errors import check_limits, input_error
from walkers.files import VTK_SCRATCH, scratch_folder
from walkers.postprocess.measure import piles
from walkers.postprocess.measure.clusters import connected
from walkers.postprocess.measure.motion import Bridges, Motion, read_bridges, read_motion
from walkers.postprocess.show.camera import camera_axes
from walkers.postprocess.show.meshes import mesh_of, walls_of
from walkers.postprocess.show.necks import bridge_ends
from walkers.postprocess.show.scene import Scene, gathered

if TYPE_CHECKING:
    import meshio

SCRIPT = "show.py"
"""Name of the script that shows an export."""
_COLLECTION = "walkers.pvd"
_LISTED = re.compile(r'file="((?:beads|boundary|bridges)_\d+\.vtu)"')
_WIDE, _AROUND = (
    16.0 / 9.0,
    1.15,
)  # width over height of the view; extent of the view over that of the motion
_NECK = 0.45  # drawn radius of a bridge over the radius of the smallest bead


def write_vtk(
    directory: Path, destination: Path | None = None, *, every: int | None = None
) -> Path:
    """Write a run for ParaView, with a script that shows it, and return the ``.pvd`` file with times in s.

    Each frame has the blocks ``beads``, ``boundary`` and, if they were recorded in it, ``bridges``; independent walkers
    are side by side.

    Parameters
    ----------
    directory, destination
        A run directory; the folder to write, ``vtk`` in the run directory if None. An `InputError` is raised unless it
        is new, empty, or has no files but those that its ``walkers.pvd`` lists, and is no symbolic link.
    every
        Write every ``every``-th sample of the drive; None: one per cycle, or all samples if they are further apart.
    """
    check_limits("every", every, 1)
    destination = destination or directory / "vtk"
    earlier, place = _earlier(destination), destination.absolute()
    motion = read_motion(directory)
    motion = gathered(motion) if motion.case.boundary.bare else motion
    root = ElementTree.Element(
        "VTKFile", type="Collection", version="0.1", byte_order="LittleEndian"
    )
    root.set("view", json.dumps(_view(motion.driven)))
    entries = ElementTree.SubElement(root, "Collection")
    place.parent.mkdir(parents=True, exist_ok=True)
    try:
        with scratch_folder(place.parent, VTK_SCRATCH) as new:
            for frame, meshes in _frames(motion, every or motion.case.run.samples_per_cycle):
                for part, (kind, mesh) in enumerate(meshes.items()):
                    entry = {
                        "timestep": repr(float(motion.time[frame])),
                        "part": str(part),
                        "name": kind,
                    }
                    entry["file"] = f"{kind}_{frame:06d}.vtu"
                    mesh.write(new / entry["file"])
                    ElementTree.SubElement(entries, "DataSet", entry)
            ElementTree.indent(root)
            ElementTree.ElementTree(root).write(new / _COLLECTION)
            shutil.copyfile(Path(__file__).with_name("show.py.txt"), new / SCRIPT)
            for path in earlier:
                path.unlink()
            new.rename(place)  # refused by the system if the folder is not empty
    except OSError as error:
        error.filename = error.filename or str(
            destination
        )  # a disk that is full does not say which
        raise
    return destination / _COLLECTION


def _earlier(place: Path) -> list[Path]:
    """Files of an earlier export in a folder, as its .pvd lists them; InputError if there is anything else."""
    collection, files = place / _COLLECTION, list(place.iterdir()) if place.is_dir() else []
    listed = _LISTED.findall(
        collection.read_text("utf-8", "replace") if collection.is_file() else ""
    )
    foreign = sorted(
        {path.name for path in files} - ({_COLLECTION, SCRIPT, *listed} if listed else set())
    )
    held = f"it holds {foreign[0]}" if foreign else "it is a file" if place.is_file() else ""
    if held := "it is a symbolic link" if place.is_symlink() else held:
        expected = "expected a new or empty folder, or a folder that walkers export has written"
        raise input_error(place, f"{expected}; {held}")
    return files


def _frames(motion: Motion, every: int) -> Iterator[tuple[int, dict[str, meshio.Mesh]]]:
    """Frames of the drive, each with its meshes ``beads``, ``boundary`` and, if there are any, ``bridges``."""
    frames = range(motion.first_driven, len(motion.time), every)
    recorded = read_bridges(motion, frames)
    bridges, walls = next(recorded, None), _walls(motion)
    tracks = piles.tracks_of(motion) if piles.applies(motion.case) else None
    for frame in frames:
        meshes = {"beads": _beads(motion, frame), "boundary": walls.copy()}
        meshes["boundary"].points += motion.substrate[frame]
        if bridges is not None and bridges.frame == frame:
            if tracks is not None:
                track, climber = (values[frame].astype(np.int64) for values in tracks)
                component = connected(len(motion.radius), bridges.beads)
                meshes["beads"].point_data |= {
                    "component": component,
                    "track": track,
                    "is_climber": climber,
                }
            if len(bridges):  # meshio does not read empty arrays
                meshes["bridges"] = _bridges(motion, bridges)
            bridges = next(recorded, None)
        yield frame, meshes


def _beads(motion: Motion, frame: int) -> meshio.Mesh:
    """Beads of a frame as vertices in the laboratory, SI units.

    Point data: ``bead`` and ``walker`` (indices from 0; -1 for no walker), ``radius (m)``, ``large``,
    ``omega (rad/s)``, and ``velocity (m/s)`` and ``speed (m/s)`` relative to the boundary.
    """
    import meshio

    beads, velocity = np.arange(len(motion.radius)), motion.velocity[frame]
    arrays = {
        **{"bead": beads, "walker": motion.walker_of, "large": motion.large.astype(np.int64)},
        **{"radius (m)": motion.radius, "omega (rad/s)": motion.spin[frame]},
        **{"velocity (m/s)": velocity, "speed (m/s)": np.linalg.norm(velocity, axis=1)},
    }
    return meshio.Mesh(
        motion.position[frame] + motion.substrate[frame], {"vertex": beads[:, None]}, arrays
    )


def _bridges(motion: Motion, bridges: Bridges) -> meshio.Mesh:
    """Bridges of a frame as lines, from centre to centre, or from a centre to the nearest point of the wall.

    Cell data: ``bead_1`` and ``bead_2`` (indices from 0; -1 for a wall), ``wall`` (index; -1 for none), ``gap (m)``,
    ``normal_force (N)``, ``touching`` and ``walker`` (of the first bead).
    """
    import meshio

    rows = bridges.rows()
    begins, ends = bridge_ends(motion, motion.position[bridges.frame], bridges.contacts)
    arrays = {
        **{name: rows[name] for name in ("bead_1", "bead_2", "wall")},
        **{"gap (m)": rows["gap"], "normal_force (N)": rows["normal_force"]},
        **{
            "touching": rows["touching"].astype(np.int64),
            "walker": motion.walker_of[rows["bead_1"]],
        },
    }
    points = np.concatenate([begins, ends]) + motion.substrate[bridges.frame]
    lines = np.arange(len(points)).reshape(2, -1).T
    return meshio.Mesh(
        points, {"line": lines}, cell_data={name: [array] for name, array in arrays.items()}
    )


def _walls(motion: Motion) -> meshio.Mesh:
    """The walls as triangles; two walls share no points."""
    import meshio

    walls = mesh_of(walls_of(motion)).triangulate()
    return meshio.Mesh(np.asarray(walls.points), {"triangle": walls.regular_faces})


def _view(motion: Motion) -> dict[str, Any]:
    """Settings of the script: colours (by walker; without walkers by speed), sizes (m), tilt and camera."""
    scene = Scene.around(motion, camera_axes(motion), _AROUND)
    tall = scene.height(_WIDE)
    camera, middle, up = scene.camera(10.0 * tall)
    # The scale of speeds ends at their 99th percentile.
    fast = (
        None
        if motion.walkers
        else float(np.percentile(np.linalg.norm(motion.velocity, axis=-1), 99.0))
    )
    return {
        **{"colour": "walker" if motion.walkers else "speed (m/s)", "largest": fast},
        **{
            "neck": _NECK * float(motion.radius.min()),
            "rounds": 48 if len(motion.radius) < 100 else 24,
        },
        **{"closed": motion.case.boundary.closed, "tilted": motion.case.boundary.tilted},
        **{
            "camera": [*(1e-3 * camera)],
            "middle": [*(1e-3 * middle)],
            "up": [*up],
            "half": 1e-3 * tall / 2.0,
        },
    }
