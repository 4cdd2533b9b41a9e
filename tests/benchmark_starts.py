"""Start many engines, several at a time, and count those that never started (docs/reference/runs.md)."""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import repeat
from pathlib import Path

from tests.conftest import make_case
from walkers.runner.binary import Engine, find_engine
from walkers.runner.directory import write_deck
from walkers.runner.failures import EngineNeverStarted
from walkers.runner.launch import launch
from walkers.templates.deck import Deck, render_deck

AT_ONCE = 8


def failed_starts(number: int, folder: Path, at_once: int = AT_ONCE) -> list[str]:
    """What engines said that never started, of so many; none is tried again."""
    run = {"time_step": "2 us", "cycles": 2, "settling_cycles": 0, "samples_per_cycle": 1}
    deck = render_deck(make_case(run=run, drive={"frequency": "2 kHz"}))
    with ThreadPoolExecutor(at_once) as pool:
        said = pool.map(_said, repeat(deck), repeat(find_engine()), (folder / str(each) for each in range(number)))
        return [words for words in said if words]


def _said(deck: Deck, engine: Engine, directory: Path) -> str:
    directory.mkdir()
    write_deck(deck, directory)
    try:
        launch(deck, directory, engine, starts=1)
    except EngineNeverStarted as failure:
        return str(failure)
    finally:
        shutil.rmtree(directory)
    return ""


def main() -> None:
    """Print how many of 5,000 starts (or of as many as the first argument says) failed."""
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 5000
    with tempfile.TemporaryDirectory(prefix="walkers-starts-") as folder:
        begin = time.perf_counter()
        failed = failed_starts(number, Path(folder))
    seconds = time.perf_counter() - begin
    print(f"{len(failed)} of {number} engines never started, {AT_ONCE} at a time, {1e3 * seconds / number:.0f} ms each")
    for words in failed[:10]:
        print(f"  {words}")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
