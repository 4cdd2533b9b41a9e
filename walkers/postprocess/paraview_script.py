"""A script that shows a run in ParaView, beside the files that it shows.

A script and no state file (``.pvsm``): only ParaView can write those, they hold all properties of one version and the
absolute paths of the files. A script is text that later versions read, and finds the files beside itself.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from walkers.inputs.errors import InputError, Problem
from walkers.inputs.text import rendered
from walkers.postprocess.analysis import analyses_of
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion, read_bridges
from walkers.postprocess.paraview import COLLECTION_NAME, SCRIPT_NAME, beads_at, shown_in_paraview, write_vtk
from walkers.postprocess.scene import Camera, camera_axes
from walkers.runner.files import write_text

_WIDE = 16.0 / 9.0
"""Width over height of the view."""
_AROUND = 1.15
"""Height and width of the view over those of what the beads reach."""
_NECK = 0.45
"""Radius of what is drawn of a bridge over that of the smallest bead."""
_SCALES = {"speed": "speed (m/s)", "radius": "radius (m)", "velocity": "velocity (m/s)", "omega": "omega (rad/s)"}
"""Titles of colour scales; others are numbers of something."""


def write_paraview(
    directory: Path, destination: Path | None = None, *, colour: str | None = None, **options: Any
) -> Path:
    """Write a run for ParaView, with a script that shows it.

    Parameters
    ----------
    directory
        A run directory.
    destination, options
        See `walkers.postprocess.paraview.write_vtk`.
    colour
        Array by which beads are coloured; if None, ``walker`` where there are walkers, else ``speed``.

    Returns
    -------
    Path
        The script.

    Raises
    ------
    InputError
        If there is no such array, or the folder holds anything else than such files.
    """
    driven = shown_in_paraview(directory, as_placed=options.get("as_placed", False)).driven
    names = _arrays(driven)
    colour = colour or ("walker" if driven.walkers else "speed")
    if colour not in names:
        raise InputError("--colour", [Problem("", None, f"{colour!r}: expected one of {', '.join(names)}")])
    collection = write_vtk(directory, destination=destination, **options)
    script = collection.parent / SCRIPT_NAME
    write_text(script, _script(driven, colour, collection.parent.resolve()))
    return script


def _arrays(motion: Motion) -> list[str]:
    """What beads carry in the files."""
    names = set(beads_at(motion, 0).array_names)
    bridges = next(read_bridges(motion), None)
    if bridges is not None:
        for analysis in analyses_of(motion.case):
            names |= set(analysis.point_data(motion)(bridges))
    return sorted(names)


def open_paraview(script: Path) -> None:
    """Start ParaView with a script, and do not wait for it.

    Raises
    ------
    InputError
        If there is no ParaView.
    """
    program = shutil.which("paraview")
    if program is None:
        raise InputError(
            "--open", [Problem("", None, f"no program paraview is installed; {script} shows the run in one")]
        )
    subprocess.Popen([program, f"--script={script}"], start_new_session=True)


def _script(motion: Motion, colour: str, folder: Path) -> str:
    camera = Camera.around(motion, camera_axes(motion), share=_AROUND)
    tall = camera.height(_WIDE)

    def listed(vector: FloatArray) -> str:
        return ", ".join(repr(float(value)) for value in vector)

    return rendered(
        "walkers.postprocess",
        "paraview.py.j2",
        title=motion.case.title or motion.case.name,
        name=SCRIPT_NAME,
        collection=COLLECTION_NAME,
        folder=str(folder),
        colour=colour,
        scale=_SCALES.get(colour),
        extent=_extent(motion, colour),
        rounds=48 if len(motion.radius) < 100 else 24,
        neck=_NECK * float(motion.radius.min()),
        closed=motion.case.boundary.closed,
        middle=listed(1e-3 * camera.middle),
        camera=listed(1e-3 * camera.place(10.0 * tall)),
        up=listed(camera.axes[1]),
        half=1e-3 * tall / 2.0,
    )


def _extent(motion: Motion, colour: str) -> tuple[float, float] | None:
    """Of the scale of what changes from frame to frame: from nothing to what one in a hundred exceeds."""
    vectors = {"speed": motion.velocity, "velocity": motion.velocity, "omega": motion.spin}.get(colour)
    return None if vectors is None else (0.0, float(np.percentile(np.linalg.norm(vectors, axis=-1), 99.0)))
