"""The progress of runs and sweeps: bars, lines, and the time that is left."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import pytest
from tomli_w import dumps as to_toml

from tests.conftest import ESCAPE, SHORT, brief_pile, document, on_terminal
from walkers.errors import Stopped
from walkers.inputs.sweep import load_sweep
from walkers.pace import Pace
from walkers.progress import Progress, _Lines, progress_of
from walkers.runs.making import make_runs
from walkers.sweeps.scheduler import SweepOptions, _SweepLoop, plan_sweep, run_sweep
from walkers.sweeps.workers import Workers

DAY = 86_400.0


# --- the estimate ---------------------------------------------------------------------------------


def test_the_pace_of_work_that_has_not_begun_is_the_predicted_one() -> None:
    assert Pace.of_prediction(DAY).slowness == 1.0


def test_the_pace_of_long_work_follows_the_measurement() -> None:
    """A tenth of the work took three times as long as predicted, then all of the rest."""
    begun = Pace.of_prediction(100.0).after(30.0, 10.0)
    assert 2.0 < begun.slowness < 3.0
    assert begun.after(270.0, 90.0).slowness == pytest.approx(3.0, rel=0.02)


def test_the_first_minute_of_a_day_hardly_changes_its_estimate() -> None:
    """A run has begun, and nothing is known of it yet."""
    assert Pace.of_prediction(DAY).after(60.0, 0.0).slowness < 1.03


def test_the_estimate_does_not_jump_between_looks() -> None:
    """A pile that is four times slower than predicted, with a look each second."""
    pace = Pace.of_prediction(3600.0)
    left = 3600.0
    estimates = []
    while left > 0.0:
        pace = pace.after(1.0, 0.25)
        left -= 0.25
        estimates.append(left * pace.slowness)
    for earlier, later in pairwise(estimates):
        assert later < earlier + 0.01 * 3600.0
    assert max(estimates) < 4.0 * 3600.0


def test_old_work_counts_less_than_new_work() -> None:
    """A slow first half on a busy machine, and a fast second half."""
    pace = Pace.of_prediction(100.0)
    for _ in range(50):
        pace = pace.after(10.0, 1.0)
    for _ in range(40):
        pace = pace.after(1.0, 1.0)
    assert pace.slowness < 3.0


# --- lines ----------------------------------------------------------------------------------------


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first line is due at once, and later lines as soon as there is something to tell."""
    monkeypatch.setattr("walkers.progress._FIRST_LINE_SECONDS", 0.0)
    monkeypatch.setattr("walkers.progress._SHORTEST_SILENCE_SECONDS", 0.0)


def lines_of(shares: list[float], told: Callable[[float], str]) -> list[str]:
    """The lines of work that is told at these shares, until it is done."""
    stream = io.StringIO()
    lines = _Lines("work", stream)
    for share in shares:
        lines.tell(Progress(share, told(share)))
    lines.end()
    return stream.getvalue().splitlines()


@pytest.mark.usefixtures("impatient")
def test_a_line_is_written_at_the_start_at_each_tenth_and_at_the_end() -> None:
    shares = [number / 40 for number in range(41)]
    lines = lines_of(shares, lambda share: f"{100 * share:g} %")
    tenths = [f"work: {10 * tenth} %" for tenth in range(11)]
    assert lines == [*tenths, "work: done in 0 s"]


@pytest.mark.usefixtures("impatient")
def test_a_line_that_says_the_same_is_not_written_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("walkers.progress._LONGEST_SILENCE_SECONDS", 0.0)
    lines = lines_of([0.0, 0.001, 0.002], lambda share: f"{100 * share:.0f} %")
    assert lines == ["work: 0 %", "work: done in 0 s"]


def test_short_work_has_no_lines() -> None:
    assert lines_of([0.0, 0.5, 1.0], str) == []


@pytest.mark.usefixtures("impatient")
def test_work_that_fails_is_not_done(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(Stopped), progress_of("work") as tell:
        assert tell is not None
        tell(Progress(0.5, "half"))
        raise Stopped("enough")
    assert capsys.readouterr().err == "work: half\n"


# --- bars -----------------------------------------------------------------------------------------


@pytest.fixture
def case_file(tmp_path: Path) -> str:
    """The file of a case of two beads in the working directory."""
    (tmp_path / "mine.toml").write_text(to_toml(document(run={**SHORT, "cycles": 60})))
    return "mine.toml"


def bars_in(printed: str) -> list[str]:
    """The states of a bar on a terminal, which are written over each other."""
    states = re.split(r"[\r\n]", ESCAPE.sub("", printed).replace("\x1b[2K", ""))
    return [state for state in states if " left" in state]


def test_a_run_has_a_bar_on_a_terminal_with_the_time_left(case_file: str, tmp_path: Path) -> None:
    printed = on_terminal("run", case_file, folder=tmp_path, errors=True)
    bars = bars_in(printed)
    assert bars[0].startswith("mine ")
    assert re.search(r"━.* \d+ %, .* left, .* s simulated", bars[-1])
    assert max(len(bar) for bar in bars) <= 80
    assert "\x1b[1A\x1b[2K" in printed  # the bar has gone


def test_a_sweep_has_the_bar_of_a_run(case_file: str, tmp_path: Path) -> None:
    sweep = f'case = "{case_file}"\n[axes]\ndrive.frequency = ["80 Hz", "90 Hz"]\n'
    (tmp_path / "two.toml").write_text(sweep)
    bars = bars_in(on_terminal("sweep", "two.toml", folder=tmp_path, errors=True))
    assert re.search(r"^two .* \d of 2 points done, \d+ % of the work, .* left", bars[0])


def test_a_bar_has_no_colours_if_they_are_not_wanted(case_file: str, tmp_path: Path) -> None:
    printed = on_terminal("run", case_file, folder=tmp_path, errors=True, NO_COLOR="1")
    assert bars_in(printed)
    assert re.findall(r"\x1b\[[\d;]*m", printed) == []


@pytest.mark.parametrize("case", ["quiet", "terminal without control"])
def test_a_bar_is_shown_only_where_it_can_be(case: str, case_file: str, tmp_path: Path) -> None:
    if case == "quiet":
        printed = on_terminal("run", case_file, "-q", folder=tmp_path, errors=True)
    else:
        printed = on_terminal("run", case_file, folder=tmp_path, errors=True, TERM="dumb")
    assert "mine: velocity" in printed
    assert "━" not in printed


# --- sweeps ---------------------------------------------------------------------------------------


@pytest.fixture
def sweep_of_a_pile(in_folder: Path) -> str:
    """A sweep with one pile, which has some segments."""
    (in_folder / "pile.toml").write_text(to_toml(brief_pile().document))
    (in_folder / "one.toml").write_text('case = "pile.toml"\n[axes]\nrun.seed = [1]\n')
    return "one.toml"


def test_a_sweep_that_begins_takes_as_long_as_predicted(in_folder: Path) -> None:
    """Thirty piles on one core, the first of which has run for a moment."""
    sweep = load_sweep("pile-starts")
    told: list[str] = []

    def stop(progress: Progress) -> None:
        told.append(progress.text)
        raise Stopped("enough")

    plan = plan_sweep(sweep, in_folder / "runs", SweepOptions(1))
    with pytest.raises(Stopped):
        run_sweep(sweep, in_folder / "runs", SweepOptions(1), on_progress=stop)
    predicted = sum(deck.seconds for deck in plan.decks)
    (minutes,) = re.findall(r", (\d+) min left", told[0])
    assert 60.0 * float(minutes) == pytest.approx(predicted, rel=0.5)


def test_what_an_earlier_call_has_done_does_not_count_as_fast_work(
    sweep_of_a_pile: str, in_folder: Path
) -> None:
    sweep = load_sweep(sweep_of_a_pile)
    out = in_folder / "runs"

    def stop_later(progress: Progress) -> None:
        if progress.share > 0.4:
            raise Stopped("enough")

    plan = plan_sweep(sweep, out, SweepOptions(1))
    with pytest.raises(Stopped):
        make_runs(plan.cases, out, plan.engine, on_progress=stop_later)
    (deck,) = plan.decks
    with ThreadPoolExecutor(1) as executor:
        loop = _SweepLoop(plan, Workers(executor))
        loop.decks[Future()] = deck
        loop._look_at([deck])
    assert loop.shares[deck] > 0.2
    assert loop.seconds_left == pytest.approx((1.0 - loop.shares[deck]) * deck.seconds)
    assert loop.pace.predicted == Pace.of_prediction(deck.seconds).predicted
