"""The complete segments of an unfinished run, as a run directory that pictures can be made of.

The directory is a copy beside the runs, of hard links, so that the run may go on, or finish, in the
meantime. It is measured and removed in the end. The title of its case says which segments it has.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil
from pathlib import Path

from walkers.errors import InputError, input_error
from walkers.files import SO_FAR_SCRATCH, link_or_copy, read_json, scratch_folder
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.results import measure
from walkers.runner import run_directory
from walkers.templates.deck import RESTART_NAME
from walkers.warning import warn_user


@dataclass(frozen=True)
class SegmentsSoFar:
    """The complete segments of an unfinished run.

    Attributes
    ----------
    complete
        Number of complete segments.
    total
        Number of all segments that are expected now.
    """

    complete: int
    total: int

    def __str__(self) -> str:
        """The segments as text."""
        return f"segments 1 to {self.complete} of {self.total}"


def segments_so_far(place: Path) -> SegmentsSoFar | None:
    """The complete segments of an unfinished run; None if none of its drive is complete yet.

    Parameters
    ----------
    place
        The final directory of the run.
    """
    incomplete = run_directory.unfinished(place)
    segments = run_directory.segment_directories(incomplete)
    settling = _settling_segments(segments)
    if settling is None:
        return None
    run = run_directory.case_of(incomplete).run
    return SegmentsSoFar(len(segments), settling + ceil(run.cycles / run.cycles_per_segment))


@contextmanager
def complete_part(place: Path, status: str, *, warn: bool = True) -> Iterator[Path]:
    """Yield a measured run directory with the complete segments of an unfinished run.

    Parameters
    ----------
    place
        The final directory of the run, which has several segments.
    status
        Status of the run, for its title.
    warn
        Whether to warn that the run is not finished.

    Yields
    ------
    Path
        The directory, which is removed in the end.

    Raises
    ------
    InputError
        If no segment of the drive is complete yet.

    Warns
    -----
    UserWarning
        With the numbers of the segments.
    """
    incomplete = run_directory.unfinished(place)
    so_far = segments_so_far(place)
    if so_far is None:
        raise nothing_yet(place, status)
    case = run_directory.case_of(incomplete)
    part = f"{so_far}: the run is {status}"
    if warn:
        warn_user(f"{case.name}: {part}")
    with scratch_folder(place.parent, SO_FAR_SCRATCH) as folder:
        directory = folder / place.name
        directory.mkdir()
        title = f"{case.title or case.name} ({part})"
        segments = run_directory.segment_directories(incomplete)[: so_far.complete]
        _fill(directory, case.with_values(title=title), segments)
        measure(directory)
        yield directory


def nothing_yet(place: Path, status: str) -> InputError:
    """The error about an unfinished run with no complete segment of its drive."""
    message = f"the run is {status}, and no segment of its drive is complete yet"
    return input_error(place, message)


def _settling_segments(segments: list[Path]) -> int | None:
    """Number of segments before the drive; None if no segment of the drive is complete."""
    for number, segment in enumerate(segments):
        record = read_json(segment / run_directory.SEGMENT_NAME)
        if record["drive_from"] is not None:
            return number
    return None


def _fill(directory: Path, case: Case, segments: list[Path]) -> None:
    """Write a case into a directory, and link the files of its segments but for restarts."""
    run_directory.write_case(directory, case)
    for segment in segments:
        copy = directory / run_directory.SEGMENTS / segment.name
        copy.mkdir(parents=True)
        for file in segment.iterdir():
            if file.name != RESTART_NAME:
                link_or_copy(file, copy / file.name)
