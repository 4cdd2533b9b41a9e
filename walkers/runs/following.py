"""Files for ParaView of a run that goes on: they grow with its complete segments.

What the files contain is decided in `walkers.postprocess.show.paraview`.
"""

from __future__ import annotations

import time
from pathlib import Path

from walkers.postprocess.show.paraview import GrowingVtk
from walkers.progress import Progress, Tell
from walkers.runner import run_directory
from walkers.runs.making import progress_at
from walkers.runs.so_far import complete_part, nothing_yet, segments_so_far
from walkers.runs.status import state_at, worst_status
from walkers.warning import warn_user

_LOOK_SECONDS = 1.0
"""Time between two looks at a run."""


def follow_vtk(
    place: Path, destination: Path, *, every: int | None = None, on_progress: Tell | None = None
) -> Path:
    """Write the frames of a run for ParaView as its segments are completed, until the run ends.

    At the end of a finished run, the files are those of `walkers.postprocess.show.paraview`'s
    ``write_vtk``.

    Parameters
    ----------
    place
        The final directory of the run. A run that nobody makes has ended.
    destination, every
        As of ``write_vtk``.
    on_progress
        Called at each look at the run.

    Returns
    -------
    Path
        The ``.pvd`` file.

    Raises
    ------
    InputError
        If the destination is refused, or the run has ended without a complete segment of its drive.

    Warns
    -----
    UserWarning
        If the run has ended before it was finished.
    """
    files = GrowingVtk(destination, every=every)
    complete_segments = 0
    while True:
        # Asked before segments are read: those that were complete at the end are read after it.
        goes_on = run_directory.is_locked(place)
        is_repeated = goes_on and run_directory.unfinished(place).is_dir()
        if run_directory.is_finished(place) and not is_repeated:
            files.finish(place)
            return files.collection
        try:
            complete_segments = _grow(files, place, complete_segments)
        except FileNotFoundError:
            if run_directory.unfinished(place).is_dir():
                raise
            continue  # the run has been finished, and its directory renamed
        if not goes_on:
            break
        if on_progress is not None:
            on_progress(_progress_of(files, place))
        time.sleep(_LOOK_SECONDS)
    status = worst_status([state_at(place).status])
    if not files.frames:
        raise nothing_yet(place, status)
    warn_user(f"{place.name}: {segments_so_far(place)}: the run is {status}")
    return files.collection


def _grow(files: GrowingVtk, place: Path, complete_before: int) -> int:
    """Add the segments of a run that are complete now; return their number."""
    so_far = segments_so_far(place)
    if so_far is None or so_far.complete == complete_before:
        return complete_before
    with complete_part(place, "running", warn=False) as directory:
        files.grow(directory)
    return so_far.complete


def _progress_of(files: GrowingVtk, place: Path) -> Progress:
    """The progress of a run, with the number of frames that have been written."""
    run = progress_at(place) or Progress(0.0, "between two segments")
    return Progress(run.share, f"{files.frames} frames; the run: {run.text}")
