"""The bench: scenes of a few beads, run by the engine, read back as arrays."""

from __future__ import annotations

import itertools
import shutil
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from walkers.inputs import resolve_case
from walkers.inputs.boundary import BOTTOM, Wall
from walkers.inputs.case import Case
from walkers.inputs.errors import Stopped
from walkers.physics.bridge import Curve, Forces, Surfaces
from walkers.postprocess.dump import BinaryDump, FloatArray
from walkers.runner.binary import Engine
from walkers.runner.directory import write_deck
from walkers.runner.launch import Progress, launch
from walkers.templates.deck import Deck, Plan, Recording, compose
from walkers.templates.layout import BEAD_COLUMNS, FORCE_COLUMNS
from walkers.templates.scene import Bead, Scene

DRY = {"law": f"{__name__}:dry"}
"""Of a case's liquid, where there are to be no bridges."""
FLOOR = BOTTOM


def dry(surfaces: Surfaces) -> Curve:
    """The law of no liquid."""
    return Curve(lambda gaps: Forces(*[np.zeros_like(gaps)] * 5), rupture=surfaces.closest)


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
    merged = {table: {**tables.get(table, {}), **changes.get(table, {})} for table in {**tables, **changes}}
    return resolve_case(merged, source="<audit>", name="audit")


@dataclass(frozen=True)
class Measured:
    """Series of a deck: F frames of N atoms, arrays of shape (F, N, 3) in SI units; time in s, of shape (F,)."""

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    force: FloatArray
    torque: FloatArray
    directory: Path


@dataclass
class Bench:
    """Runs decks of an engine in a folder of its own.

    ``engine`` is the binary on trial, ``stop`` is set to end the engines that run, ``version`` is what they told.
    """

    engine: Engine
    folder: Path
    stop: threading.Event = field(default_factory=threading.Event)
    version: str = "unknown"
    _numbers: itertools.count[int] = field(default_factory=itertools.count)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def run(self, plan: Plan | Deck, carry: Path | None = None) -> Measured:
        """Run a plan, or a deck, and read its series.

        Parameters
        ----------
        plan
            Forces are read where its recording has `FORCE_COLUMNS`; see `bench_recording`.
        carry
            A file to put into the deck's directory, such as a restart file.
        """
        deck = compose(plan) if isinstance(plan, Plan) else plan
        deck = replace(deck, fastest=inf)  # what a check drives may move faster than what walls drive
        with self._lock:
            directory = self.folder / f"deck-{next(self._numbers):03d}"
        directory.mkdir(parents=True)
        write_deck(deck, directory)
        if carry is not None:
            shutil.copy(carry, directory)
        self.version = launch(deck, directory, self.engine, on_progress=self._look).version
        return read_series(deck, directory)

    def _look(self, _: Progress) -> None:
        if self.stop.is_set():
            raise Stopped("the audit was stopped")


def read_series(deck: Deck, directory: Path) -> Measured:
    """Read the bead dump of a deck."""
    dump = BinaryDump(directory / deck.layout.bead_dump, deck.layout.bead_columns)
    frames = dump.stack()

    def vectors(name: str) -> FloatArray:
        start = dump.column(name)
        return frames[:, :, start : start + 3]

    time = dump.steps.astype(np.float64) * deck.layout.time_step
    position, velocity, spin, force, torque = (vectors(name) for name in ("x", "vx", "omegax", "fx", "tqx"))
    return Measured(time, position, velocity, spin, force, torque, directory)


def bench_recording(steps: int, sample_every: int = 1) -> Recording:
    """Record beads with their forces and torques; bridges at the start and the end only."""
    return Recording(steps, sample_every, steps, steps, bead_columns=(*BEAD_COLUMNS, *FORCE_COLUMNS))


def bench_scene(beads: Sequence[Bead], walls: Sequence[Wall] = (FLOOR,), edge: float = 0.01) -> Scene:
    """Beads, which are numbered here, between walls in a box about the origin, ``edge`` (m) half its width."""
    numbered = tuple(replace(bead, id=number) for number, bead in enumerate(beads, 1))
    return Scene(numbered, tuple(walls), (-edge,) * 3, (edge,) * 3)


def farthest(measured: FloatArray, expected: FloatArray) -> float:
    """The largest distance of two series of vectors, over the largest expected vector."""
    scale = np.linalg.norm(expected, axis=-1).max()
    return float(np.linalg.norm(measured - expected, axis=-1).max() / (scale or 1.0))
