"""The engine's log of a run, whole or as it grows.

Each segment has a log of its own; the logs are joined in the order of the segments. A run that was
made in a shared deck has the log of that deck. What the logs say is judged in
`walkers.runner.launch`.
"""

from __future__ import annotations

import codecs
import os
import time
from collections.abc import Iterator, Sequence
from io import BufferedReader
from pathlib import Path

from walkers.errors import InputError, input_error
from walkers.files import open_regular
from walkers.runner import run_directory
from walkers.runs.by_hand import LOG_NAMES
from walkers.runs.making import DECK_FOLDER
from walkers.templates.deck import OUTPUT_NAME

_LOOK_SECONDS = 0.2
"""Time between two looks at a log that grows."""
_PIECE_BYTES = 1 << 20
"""Largest part of a log that is read at once."""


def logs_of(place: Path) -> list[Path]:
    """The files of the engine's log of a run, in the order of its segments.

    Parameters
    ----------
    place
        The final directory of the run.

    Returns
    -------
    list of Path
        One file for each segment, also for the one that is being made; empty if there is no log.
        While a finished run is made again, these are the files of the new one.
    """
    directory = run_directory.unfinished(place)
    is_repeated = run_directory.is_locked(place) and directory.is_dir()
    if run_directory.is_finished(place) and not is_repeated:
        directory = place
    segments = sorted((directory / run_directory.SEGMENTS).glob("[0-9]*"))
    files = [segment / OUTPUT_NAME for segment in segments if (segment / OUTPUT_NAME).is_file()]
    if files:
        return files
    of_shared_deck = directory / DECK_FOLDER / OUTPUT_NAME
    if of_shared_deck.is_file():
        return [of_shared_deck]
    return _latest_by_hand(directory)


def _latest_by_hand(directory: Path) -> list[Path]:
    """The latest log of a deck that was run by hand; empty if there is none."""
    logs = [directory / name for name in LOG_NAMES if (directory / name).is_file()]
    logs.sort(key=lambda log: log.stat().st_mtime)
    return logs[-1:]


def read_log(place: Path) -> str:
    """Read the engine's log of a run, finished or not.

    Parameters
    ----------
    place
        The final directory of the run.

    Returns
    -------
    str
        The log. A line such as ``==> segments/0001/engine.log <==`` begins each segment.

    Raises
    ------
    InputError
        If there is no log.
    """
    return "".join(_pieces(place, follow=False))


def follow_log(place: Path) -> Iterator[str]:
    """Yield the engine's log of a run in pieces, until the run ends.

    Parameters
    ----------
    place
        The final directory of the run. A run that nobody makes has ended.

    Yields
    ------
    str
        What has been added to the log of `read_log`, in the order of the segments.

    Raises
    ------
    InputError
        If the run has ended without a log.
    """
    yield from _pieces(place, follow=True)


def _pieces(place: Path, *, follow: bool) -> Iterator[str]:
    """Yield what the log contains and, with ``follow``, what is added until the run ends."""
    log = None
    try:
        while True:
            # Asked before the log is read: what was written before the end is read after it.
            goes_on = follow and run_directory.is_locked(place)
            if log is not None:
                yield from log.new_pieces()
            next_log = _log_after(log, logs_of(place))
            if next_log is not None:
                if log is not None:
                    yield from log.new_pieces()  # what came before the next log was begun
                    log.close()
                log = next_log
                yield log.heading
            elif goes_on:
                time.sleep(_LOOK_SECONDS)
            elif log is None:
                raise _without_log(place)
            else:
                return
    finally:
        if log is not None:
            log.close()


class _OpenLog:
    """The log of a segment, which stays open while its folder is renamed.

    Attributes
    ----------
    heading
        Line before the log; empty if the run has no folders of segments.
    """

    def __init__(self, path: Path) -> None:
        self._file: BufferedReader = open_regular(path)
        self._decoder = codecs.getincrementaldecoder("utf-8")("backslashreplace")
        self.heading = ""
        run = run_directory.run_of_segment(path.parent)
        if run != path.parent:
            # The segment that is being made has a suffix, which it loses when it is complete.
            segment = path.parent.relative_to(run).with_suffix("")
            self.heading = f"==> {segment / path.name} <==\n"

    def new_pieces(self) -> Iterator[str]:
        """Yield what has been added since the last call."""
        while True:
            added = self._file.read(_PIECE_BYTES)
            if not added:
                return
            yield self._decoder.decode(added)

    def is_file_at(self, path: Path) -> bool:
        """Whether a path leads to the open file."""
        try:
            return os.path.samestat(os.fstat(self._file.fileno()), path.stat())
        except OSError:
            return False

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _log_after(current: _OpenLog | None, files: Sequence[Path]) -> _OpenLog | None:
    """The log that follows the current one; None if there is none as yet.

    If the current one has been removed, as that of a shorter attempt, it is the first log.
    """
    following = list(files)
    for number, file in enumerate(files):
        if current is not None and current.is_file_at(file):
            following = list(files[number + 1 :])
    if not following:
        return None
    try:
        return _OpenLog(following[0])
    except FileNotFoundError:  # its folder has just been renamed; it is found at the next look
        return None


def _without_log(place: Path) -> InputError:
    """The error about a run without a log."""
    if run_directory.is_finished(place):
        return input_error(place, "the run has no log of the engine: its files were removed")
    return input_error(place, "the run has no log: the engine has not started yet")
