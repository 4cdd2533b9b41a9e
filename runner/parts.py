"""Runs made in parts: the pile's, which take long, each part from a restart file to the next.

A run is made in ``NAME-HASH.part``, its parts in ``parts/0000``, ``parts/0001``, … there. A part that is being made is
called ``0003.new`` and gets its name when it is whole; an interrupted run goes on after the last whole part. Since
the parts are the same whether the run was interrupted or not, so is all that comes out of it, bit for bit.
"""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.inputs.errors import Stopped, WalkersError
from walkers.inputs.pile import PileCase
from walkers.runner.binary import Engine
from walkers.runner.directory import (
    CASE_NAME,
    FAILURE_NAME,
    MANIFEST_NAME,
    FinishedRun,
    finished_run,
    manifest,
    move_into_place,
    record_failure,
    recover,
    room_on_disk,
    run_place,
    unfinished,
    write_deck,
)
from walkers.runner.failures import RunBusy
from walkers.runner.files import read_json, settle, settle_entry, write_json
from walkers.runner.launch import EngineReport, Progress, launch
from walkers.runner.locks import locked
from walkers.templates.deck import OUTPUT_NAME, Deck
from walkers.templates.pile import PREVIOUS_RESTART_NAME, RESTART_NAME, Part, render_part, settling_steps

PARTS = "parts"
PART_NAME = "part.json"
_LEAST_BYTES = 150
"""Of a restart file, an atom: whole ones had 300 to 580."""


@dataclass(frozen=True)
class PileProgress:
    """How far a pile is: simulated time and wall time of this call (s), whether it is driven, share of the drive."""

    simulated: float
    elapsed: float
    driven: bool
    share: float


def run_pile(
    case: PileCase,
    engine: Engine,
    out: Path,
    *,
    force: bool = False,
    on_progress: Callable[[PileProgress], None] | None = None,
    time_limit: float | None = None,
) -> tuple[FinishedRun, bool]:
    """Run a pile, or go on with it.

    Parameters
    ----------
    case, engine
        What is run.
    out
        Folder of the run directories; made if need be.
    force
        Begin anew, also if the run is there.
    on_progress
        Called a few times a second.
    time_limit
        Wall time in s for each part.

    Returns
    -------
    run
        Its parts are in ``parts/``.
    found
        Whether it was there before.

    Raises
    ------
    RunBusy
        If another process is making the same run.
    EngineFailure
        If the engine fails; the parts before stay, and the next call goes on after them.
    """
    place = run_place(case, engine, out)
    out.mkdir(parents=True, exist_ok=True)
    with locked([place]) as ours:
        if place not in ours:
            raise RunBusy(unfinished(place))
        recover(place)
        there = finished_run(place)
        if there is not None and not force:
            return there, True
        made = unfinished(place)
        if force and made.exists():
            shutil.rmtree(made)
        try:
            return _make(_Making(case, engine, made, list(ours.values()), on_progress, time_limit), place), False
        except Stopped:
            raise
        except (WalkersError, OSError) as failure:
            record_failure(made, failure)
            raise


class _Making:
    """A run that is being made or gone on with."""

    def __init__(
        self,
        case: PileCase,
        engine: Engine,
        directory: Path,
        locks: Sequence[int],
        on_progress: Callable[[PileProgress], None] | None,
        time_limit: float | None,
    ) -> None:
        self.case, self.engine, self.directory, self.locks = case, engine, directory, locks
        self.on_progress, self.time_limit = on_progress, time_limit
        self.begin = time.perf_counter()
        directory.mkdir(exist_ok=True)
        (directory / PARTS).mkdir(exist_ok=True)
        write_json(directory / CASE_NAME, case.as_dict())
        (directory / FAILURE_NAME).unlink(missing_ok=True)
        self.done = [_read_part(path) for path in part_directories(directory)]

    def make(self, part: Part) -> dict[str, Any]:
        """Make the next part and say what it was."""
        number = len(self.done)
        place = self.directory / PARTS / f"{number:04d}"
        new = place.with_name(place.name + ".new")
        shutil.rmtree(new, ignore_errors=True)
        deck = render_part(self.case, part)
        with room_on_disk(new, deck):
            said = self._made(part, deck, new, number)
            settle(new)
            new.rename(place)
            settle_entry(place.parent)
        # The restart before the last one is kept, should the last one prove bad.
        if number > 1:
            (place.with_name(f"{number - 2:04d}") / RESTART_NAME).unlink(missing_ok=True)
        self.done.append(said)
        return said

    def _made(self, part: Part, deck: Deck, new: Path, number: int) -> dict[str, Any]:
        """Run the deck of a part in a fresh directory."""
        new.mkdir()
        write_deck(deck, new)
        if part.begin:
            shutil.copyfile(new.with_name(f"{number - 1:04d}") / RESTART_NAME, new / PREVIOUS_RESTART_NAME)
        report = launch(
            deck, new, self.engine, on_progress=self._tell(part), time_limit=self.time_limit, keep_open=self.locks
        )
        (new / PREVIOUS_RESTART_NAME).unlink(missing_ok=True)
        said = {**vars(part), **vars(report), "root_mean_square_velocity": _agitation(new)}
        restart = new / RESTART_NAME
        size = restart.stat().st_size if restart.exists() else 0
        if size < _LEAST_BYTES * deck.layout.atoms:  # the engine does not look whether there was room for it
            raise DamagedPart(f"{restart} is incomplete ({size} bytes): is the disk full?")
        write_json(new / PART_NAME, said)
        return said

    def _tell(self, part: Part) -> Callable[[Progress], None]:
        run, tell = self.case.run, self.on_progress

        def advance(progress: Progress) -> None:
            if tell is None:
                return
            step = max(progress.step, part.begin)
            driven = 0 if part.drive_from is None else step - part.drive_from
            share = driven / (run.cycles * run.steps_per_cycle)
            elapsed = time.perf_counter() - self.begin
            tell(PileProgress(step * run.time_step, elapsed, part.drive_from is not None, share))

        return advance


def _make(making: _Making, place: Path) -> FinishedRun:
    case, run = making.case, making.case.run
    started = time.time()
    while (start := _settled_at(making)) is None:
        begin = making.done[-1]["end"] if making.done else 0
        making.make(Part(begin, begin + settling_steps(case), None))
    end = start + run.cycles * run.steps_per_cycle
    while (begin := making.done[-1]["end"]) < end:
        making.make(Part(begin, min(begin + run.cycles_per_part * run.steps_per_cycle, end), start))
    seconds = [sum(part[name] for part in making.done) for name in ("wall_seconds", "loop_seconds")]
    report = EngineReport(making.done[0]["version"], seconds[0], seconds[1], end)
    said = manifest(case, place.name, making.engine, report, started=started, directory=making.directory)
    settling = {"drive_from": start, "settled": making.done[_first_driven(making) - 1]["root_mean_square_velocity"]}
    for left in [making.directory / "result.json", *making.directory.glob("*.parquet")]:
        left.unlink(missing_ok=True)  # of somebody who looked before the end
    # Of all calls that it took.
    said["seconds"]["total"] = max(said["seconds"]["total"], seconds[0])
    write_json(making.directory / MANIFEST_NAME, {**said, **settling, "parts": len(making.done)})
    move_into_place(making.directory, place)
    return FinishedRun(place)


def _first_driven(making: _Making) -> int:
    driven = [number for number, part in enumerate(making.done) if part["drive_from"] is not None]
    return driven[0] if driven else len(making.done)


def _settled_at(making: _Making) -> int | None:
    """Step at which the drive begins: the end of the first part that leaves the pile at rest, or the last allowed."""
    run = making.case.run
    for part in making.done:
        if part["drive_from"] is not None:
            return int(part["drive_from"])
        at_rest = part["root_mean_square_velocity"] < run.settled_below
        if at_rest or part["end"] * run.time_step >= run.longest_settling:
            return int(part["end"])
    return None


def _read_part(directory: Path) -> dict[str, Any]:
    try:
        said = read_json(directory / PART_NAME)
        if said["end"] > said["begin"] and "drive_from" in said:
            return said
        raise ValueError("begin, end or drive_from make no sense")
    except (OSError, ValueError, KeyError, TypeError) as error:
        told = f"{directory} is damaged ({error}): delete {directory.parent.parent} to have the run made again"
        raise DamagedPart(told) from error


class DamagedPart(WalkersError):
    """A part of an unfinished run that cannot be gone on from."""


def _agitation(directory: Path) -> float:
    """Root mean square velocity of the beads at the end of a part, by mass, m/s: the deck has it printed last."""
    told = re.findall(rb"^root mean square velocity (\S+)", (directory / OUTPUT_NAME).read_bytes(), re.MULTILINE)
    return float(told[-1])


def is_pile(directory: Path) -> bool:
    """Whether a run directory is a pile's."""
    return (directory / PARTS).is_dir()


def part_directories(directory: Path) -> list[Path]:
    """The whole parts of a run, in their order."""
    return sorted(path for path in (directory / PARTS).glob("[0-9]*") if not path.suffix)
