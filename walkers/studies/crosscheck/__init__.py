"""A second engine, written from the published formulas alone, that the decks' results are checked against.

It is a referee and no replacement: `laws` says which terms act, `kernels` has their formulas and the integration,
`engine` drives them, `setup` takes beads, walls and drive from a case. Of the bridges it takes the law
(`walkers.physics.laws`), which it interpolates in its own way, and nothing of the decks. `comparison` compares a run
with it, `report` tells what came out.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from walkers.studies.chapter import Chapter


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """The chapter of docs/explanation/validation.md; see `walkers.studies.crosscheck.report.chapter`."""
    from walkers.studies.crosscheck import report

    return report.chapter(out, quick=quick)
