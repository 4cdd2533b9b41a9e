"""The bench: scenes of a few beads, run by the engine, read back as arrays."""

from __future__ import annotations

import itertools
import shutil
import threading
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.inputs import resolve_case
from walkers.inputs.boundary import Face
from walkers.inputs.case import Case, Run
from walkers.inputs.drive import Vector
from walkers.inputs.errors import Stopped
from walkers.postprocess.dump import BinaryDump, FloatArray
from walkers.postprocess.local_dump import read_local_dump
from walkers.runner.binary import Engine
from walkers.runner.directory import write_deck
from walkers.runner.launch import Progress, launch
from walkers.templates.deck import Deck, Plan, Recording, compose, plan_of
from walkers.templates.engine import ALL_WORKAROUNDS, Workarounds
from walkers.templates.layout import BEAD_COLUMNS, FORCE_COLUMNS, WALL_BRIDGES, Layout
from walkers.templates.scene import Bead, Scene

FIRST_BEAD = 2
"""Id of the first bead of a scene with one carrier."""
_BEAD_COLUMNS = (*BEAD_COLUMNS, *FORCE_COLUMNS)
_WALL_BRIDGE_COLUMNS = tuple(" ".join(WALL_BRIDGES).split())
FLOOR = Face("z", 1, (0.0, 0.0, 0.0))


def free_run(run: Run, time_step: float) -> Run:
    """The same with a time step (s) of which a cycle need not be a multiple: a bench counts steps by itself."""
    return replace(run, time_step=time_step, steps_per_cycle=0)


def bench_case(**changes: dict[str, Any]) -> Case:
    """A case without friction, damping, viscosity, gravity and drive, to which a check adds what it measures."""
    tables: dict[str, dict[str, Any]] = {
        "beads": {"density": "4.0 g/cm^3"},
        "dimers": {"radii": ["0.3 mm", "0.2 mm"]},
        "liquid": {"surface_tension": "19.2 mN/m", "dynamic_viscosity": "0 Pa*s"},
        "boundary": {"material": "glass"},
        "contact": {"friction": {"bead_bead": 0.0, "bead_wall": 0.0}, "rolling_friction": 0.0, "restitution": 1.0},
        "drive": {"frequency": "80 Hz", "peak_acceleration": "0 g", "frame": "container"},
        "run": {"time_step": "1 us", "samples_per_cycle": 1},
        "environment": {"gravity": "0 m/s^2"},
    }
    return changed_case(tables, changes)


def changed_case(tables: dict[str, dict[str, Any]], changes: dict[str, dict[str, Any]]) -> Case:
    """A case from its tables with those of a check merged in."""
    merged = {table: {**tables.get(table, {}), **changes.get(table, {})} for table in {**tables, **changes}}
    return resolve_case(merged, source="<audit>", name="audit")


@dataclass(frozen=True)
class Measured:
    """Series of a deck: F frames of N atoms.

    Attributes
    ----------
    steps : ndarray, shape (F,)
    position, velocity, spin, force, torque : ndarray, shape (F, N, 3)
        SI units, by atom id.
    directory, layout
        Of the run.
    missing
        How many carriers of the scene the deck was run without.
    """

    steps: npt.NDArray[np.int64]
    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    force: FloatArray
    torque: FloatArray
    directory: Path
    layout: Layout
    missing: int = 0

    def row(self, bead: int) -> int:
        """Row of a bead, by the id that it has in the scene."""
        return bead - 1 - self.missing

    def wall_bridges(self, column: str) -> tuple[npt.NDArray[np.int64], FloatArray]:
        """Steps and one column of what the engine reported of the bridges to walls, both of shape (rows,)."""
        columns = self.layout.wall_bridge_columns
        steps, rows = read_local_dump(self.directory / self.layout.wall_bridge_dump, columns)
        return steps, rows[:, columns.index(column)]


class AuditStopped(Stopped):
    """Somebody stopped the audit while an engine ran."""


@dataclass
class Bench:
    """Runs decks of an engine in a folder of its own.

    Attributes
    ----------
    engine
        The binary on trial.
    folder
        Where decks are run.
    workarounds
        Those of the decks on trial; tests take some away to see the audit fail.
    pile_time_step
        Step in s at which the small pile is tried instead of the one that ``auto`` takes; tests set it too large.
    stop
        Set to end the engines that run.
    """

    engine: Engine
    folder: Path
    workarounds: Workarounds = ALL_WORKAROUNDS
    pile_time_step: float | None = None
    stop: threading.Event = field(default_factory=threading.Event)
    version: str = "unknown"
    _numbers: itertools.count[int] = field(default_factory=itertools.count)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def new_directory(self) -> Path:
        """A fresh directory for a deck."""
        with self._lock:
            directory = self.folder / f"deck-{next(self._numbers):03d}"
        directory.mkdir(parents=True)
        return directory

    def _look(self, _: Progress) -> None:
        if self.stop.is_set():
            raise AuditStopped("the audit was stopped")

    def run(self, plan: Plan, carry: Path | None = None) -> Measured:
        """Run a plan and read its series.

        Parameters
        ----------
        plan
            Torques are read where its recording has `FORCE_COLUMNS`; see `bench_recording`.
        carry
            A file to put into the deck's directory, such as a restart file.
        """
        deck = compose(plan)
        if not plan.walkers:  # what is driven by a check may move faster than what is driven by the walls
            deck = replace(deck, fastest=inf)
        directory = self.new_directory()
        write_deck(deck, directory)
        if carry is not None:
            shutil.copy(carry, directory)
        self.version = launch(deck, directory, self.engine, on_progress=self._look).version
        missing = 0 if plan.workarounds.carriers else len(plan.scene.carriers)
        return replace(read_series(deck, directory), missing=missing)


def read_series(deck: Deck, directory: Path) -> Measured:
    """Read the bead dump of a deck as `Measured`."""
    dump = BinaryDump(directory / deck.layout.bead_dump, deck.layout.bead_columns)
    frames = dump.stack()

    def vectors(name: str) -> FloatArray:
        start = dump.column(name)
        return frames[:, :, start : start + 3]

    unknown = np.full_like(vectors("x"), np.nan)  # a line that stands on what was not recorded fails
    force, torque = (vectors(name) if name in dump.columns else unknown for name in ("fx", "tqx"))
    return Measured(dump.steps, vectors("x"), vectors("vx"), vectors("omegax"), force, torque, directory, deck.layout)


def bench_plan(case: Case, workarounds: Workarounds) -> Plan:
    """The plan of a case that records forces as well, as `bench_recording` does."""
    plan = plan_of(case, workarounds=workarounds)
    recording = replace(plan.recording, bead_columns=_BEAD_COLUMNS, wall_bridge_columns=_WALL_BRIDGE_COLUMNS)
    return replace(plan, recording=recording)


def bench_recording(steps: int, sample_every: int) -> Recording:
    """Record beads with their torques; bridges at the start and the end only."""
    return Recording(
        steps=steps,
        sample_every=sample_every,
        bridge_every=steps,
        status_every=steps,
        bead_columns=_BEAD_COLUMNS,
        wall_bridge_columns=_WALL_BRIDGE_COLUMNS,
    )


def scene_on_floor(beads: list[Bead], half_width: float = 0.02, height: float = 0.02) -> Scene:
    """Beads over the floor z = 0 with its carrier in the corner; ids are given here, from 2 (`FIRST_BEAD`)."""
    numbered = tuple(replace(bead, id=FIRST_BEAD + number) for number, bead in enumerate(beads))
    edge = half_width + 2e-3
    carrier: Vector = (half_width + 1e-3, half_width + 1e-3, height + 1e-3)
    return Scene(numbered, (FLOOR,), (carrier,), (-edge, -edge, -2e-3), (edge, edge, height + 2e-3))
