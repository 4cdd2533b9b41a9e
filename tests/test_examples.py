"""The examples in docstrings, run as they stand."""

from __future__ import annotations

import doctest
from importlib import import_module
from pathlib import Path

import pytest

import walkers


@pytest.mark.parametrize(
    "module", ["walkers", "walkers.pipeline", "walkers.inputs.reading", "walkers.postprocess.motion"]
)
def test_examples_give_what_they_say(module: str, runs_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a folder of the tests (``tmp``), with what a user would have imported."""
    if module == "walkers":  # its sweep is there for its table: Fig. 4b would take all of 60 cycles
        monkeypatch.setattr("walkers.inputs.run_tables._MOST_CYCLES", 12)
    failed, tried = doctest.testmod(import_module(module), extraglobs={"tmp": runs_folder, "walkers": walkers})
    assert tried
    assert not failed


def test_the_public_names_are_few_and_documented() -> None:
    names = ["Run", "find_run", "load", "load_case", "plot_sweep", "report", "run", "sweep", "sweep_figure"]
    assert dir(walkers) == walkers.__all__ == names
    assert all(getattr(walkers, name).__doc__ for name in walkers.__all__)
