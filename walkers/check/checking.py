"""From a case to its comparison: its runs are made if they are missing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from walkers.check.comparison import Comparison, PileComparison, compare, compare_piles
from walkers.check.laws import Laws
from walkers.inputs.case import Case
from walkers.pipeline import Run, run
from walkers.runner.directory import FinishedRun

DECKS = Laws()


def crosscheck(
    case: Case,
    out: Path,
    laws: Laws = DECKS,
    *,
    seeds: int = 1,
    every_step: bool = True,
    make: Callable[[Case, Path], Run] = run,
) -> Comparison | PileComparison:
    """Compare a case's run with the second engine; a pile is compared as a pile.

    Parameters
    ----------
    case
        The case.
    out
        Folder of the run directories.
    laws
        Of the second engine.
    seeds
        How many starts of a pile, from the case's seed on.
    every_step
        Whether to average walkers' gait over all steps, too.
    make
        Makes the run of a case if it is missing.

    Raises
    ------
    runner.EngineFailure
        If the engine fails in one of the known ways.

    Examples
    --------
    >>> from walkers.inputs.reading import load_case
    >>> crosscheck(load_case("fig1b"), tmp).disagreements
    []
    """
    if case.mixture is None:
        done = make(case, out)
        return compare(done.motion, laws, _seconds(done), every_step)
    starts = [replace(case, seed=case.seed + number) for number in range(seeds)]
    runs = [make(one, out) for one in starts]
    return compare_piles([one.motion for one in runs], laws, [_seconds(one) for one in runs])


def _seconds(done: Run) -> float | None:
    """Wall time that LIGGGHTS took for the steps of a run, s; None if it made other runs with them."""
    manifest = FinishedRun(done.directory).manifest
    return None if "shared_deck" in manifest else float(manifest["seconds"]["engine_loop"])
