"""Measure what docs/explanation/performance.md states of piles: ``make bench-piles`` prints its tables.

Seconds depend on the machine; the shares and ratios of one run are what counts.
"""

from __future__ import annotations

import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

from walkers.inputs import resolve_case, shipped_cases
from walkers.inputs.case import Case
from walkers.postprocess import read_motion, tabulate
from walkers.runner import FinishedRun, find_engine, open_run
from walkers.runner.directory import SEGMENTS, write_deck
from walkers.runner.files import read_json
from walkers.templates.deck import (
    DECK_NAME,
    OUTPUT_NAME,
    PREVIOUS_RESTART_NAME,
    RESTART_NAME,
    Segment,
    render_deck,
)

_REPEATS = 2


def _case(name: str, **run: Any) -> Case:
    tables = tomllib.loads(shipped_cases()[name].read_text())
    tables["run"] |= run
    return resolve_case(tables, name=name)


def _run(case: Case, out: Path) -> FinishedRun:
    """Make a run, without its tables."""
    with open_run(case, find_engine(), out) as run:
        run.make()
        return run.finish()


def measure_loop(out: Path) -> None:
    """Share of the engine's loop in the wall time of a run, and bead-steps a second against the deck run by hand."""
    print("| | ratio |\n|---|---|")
    case = _case("pile-small", duration="0.5 s", segment="0.25 s")
    begin = time.perf_counter()
    run = _run(case, out)
    wall = time.perf_counter() - begin
    loop = run.manifest["seconds"]["engine_loop"]
    print(f"| engine's loop over wall time, small pile, segments of 0.25 s | {loop / wall:.3f} |")
    ours, theirs = [], []
    last = run.segments[-1]
    for number in range(_REPEATS):
        again = _case("pile-small", duration="0.5 s", segment="0.25 s")
        redone = _run(again, out / f"again-{number}")
        ours.append(read_json(redone.segments[-1] / "segment.json")["loop_seconds"])
        theirs.append(_by_hand(case, last, out / "by-hand"))
    steps = read_json(last / "segment.json")
    speed = case.count * (steps["end"] - steps["begin"])
    print(f"| its last segment: bead-steps a second, `walkers run` over by hand | {min(theirs) / min(ours):.3f} |")
    print(f"\n{speed / min(ours) / 1e6:.2f} million bead-steps a second on one core")


def _by_hand(case: Case, segment: Path, folder: Path) -> float:
    """Loop time of a segment's deck when ``liggghts`` is called on it in a folder, s."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    said = read_json(segment / "segment.json")
    write_deck(render_deck(case, Segment(said["begin"], said["end"], said["drive_from"])), folder)
    before = segment.with_name(f"{int(segment.name) - 1:04d}") / RESTART_NAME
    shutil.copyfile(before, folder / PREVIOUS_RESTART_NAME)
    command = ["liggghts", "-in", DECK_NAME]
    with (folder / OUTPUT_NAME).open("wb") as output:
        subprocess.run(command, cwd=folder, check=True, stdout=output)
    told = re.findall(rb"^Loop time of (\S+)", (folder / OUTPUT_NAME).read_bytes(), re.MULTILINE)
    return float(told[-1])


def measure_ranks(out: Path) -> None:
    """The shaken full pile on one rank and on two."""
    print("\n| full pile | bead-steps a second |\n|---|---|")
    for ranks in (1, 2):
        case = _case("pile-fig1a", duration="0.1 s", segment="0.1 s", ranks=ranks, longest_settling="0.05 s")
        run = _run(case, out)
        segment = read_json(run.segments[-1] / "segment.json")
        speed = (segment["end"] - segment["begin"]) * case.count / segment["loop_seconds"] / 1e6
        print(f"| {ranks} rank{'s' * (ranks > 1)} | {speed:.2f} million |")


def measure_tables(out: Path) -> None:
    """Time and memory of the tables of the full pile with 2,000 frames and their bridges."""
    case = _case("pile-fig1a", duration="0.37 s", frames_per_second=5440.0, segment="0.1 s", longest_settling="0.05 s")
    run = _run(case, out)
    frames = len(read_motion(run.directory).time)
    begin = time.perf_counter()
    command = [sys.executable, __file__, "tabulate", str(run.directory)]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    seconds = time.perf_counter() - begin
    size = sum(path.stat().st_size for path in (run.directory / SEGMENTS).rglob("*")) / 1e6
    print("\n| full pile | seconds | MB of memory | MB read |\n|---|---|---|---|")
    print(f"| tables of {frames} frames with bridges | {seconds:.1f} | {float(told):.0f} | {size:.0f} |")


def main() -> None:
    """Print the tables."""
    if sys.argv[1:2] == ["tabulate"]:
        tabulate(sys.argv[2])
        print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)
        return
    with tempfile.TemporaryDirectory() as folder:
        measure_loop(Path(folder))
        measure_ranks(Path(folder))
        measure_tables(Path(folder))


if __name__ == "__main__":
    main()
