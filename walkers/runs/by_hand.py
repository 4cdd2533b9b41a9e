"""Decks that are run by hand: write the folder of a deck, and make a run directory of it after the run.

The folder becomes the run directory and its only segment. ``deck.json`` contains the original case and deck. The engine
prints the parameters that it reads: those that were edited are other values of keys of the case, other edits are named.
"""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Collection, Mapping
from dataclasses import replace
from math import isclose, pi
from pathlib import Path
from typing import Any

from walkers.errors import input_error
from walkers.files import checksum, read_json, write_json
from walkers.inputs.bridge_laws import source_of
from walkers.inputs.case_building import build_case, stored_case
from walkers.inputs.config_table import changed
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.tables.run import CONSTANT, settling_of
from walkers.postprocess.measure.dump import DumpError
from walkers.postprocess.measure.results import measure
from walkers.rounding import percent
from walkers.runner import run_directory
from walkers.runner.binary import find_engine
from walkers.runner.compiled_model import plugin_of, write_run_script
from walkers.runner.failures import EngineFailure, MissingFrames
from walkers.runner.launch import judge
from walkers.runner.manifest import (
    MANIFEST_NAME,
    FinishedRun,
    checksums,
    read_manifest,
    write_manifest,
)
from walkers.runs.case_text import quantity_kind
from walkers.templates import deck as decks
from walkers.templates.deck import Segment
from walkers.templates.parameters import PRINTED, suffixes

_LOGS = (decks.OUTPUT_NAME, "log.liggghts")
"""Output of the engine by `write_run_script`, and the default log of LIGGGHTS."""
_PRINTED = re.compile(rf"^{PRINTED} (.+)$", re.MULTILINE)
_LINE = re.compile(r"^variable +(\w+) string +(\S+)", re.MULTILINE)
_SAME = 1e-9
_OF_SINES = ("frequency", "peak_acceleration", "phase")
_KEYS: Mapping[str, str] = {
    "gravity": "environment.gravity",
    "density": "beads.density",
    "viscosity": "liquid.dynamic_viscosity",
    **{f"friction_{pair}": f"contact.friction.{pair}" for pair in ("bead_bead", "bead_wall")},
    **{
        name: f"contact.{name}"
        for name in ("youngs_modulus", "poissons_ratio", "restitution", "rolling_friction")
    },
}
"""For parameters of a deck, the key of a case."""
_SCALE = """# Writes tables for another viscosity: the deck gives the factor of the resistances.
/^[-+.0-9]/ { printf "%s %s", $1, $2; for (i = 3; i <= NF; i++) printf " %.12g", resistance * $i
              printf "\\n"; next }
{ print }
"""


def write_folder(case: Case, folder: Path) -> Path:
    """Write the complete deck of a case to a new folder, and return the path of the deck.

    `InputError` if the folder exists or cannot be made; errors of `find_engine` and `plugin_of`.
    """
    deck, engine = decks.render_deck(case, decks.single_segment(case)), find_engine()
    plugin = plugin_of(engine)
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise input_error(
            folder, f"cannot make the folder ({error.strerror}): expected the name of a new one"
        ) from error
    try:
        run_directory.write_deck(deck, folder)
        (folder / decks.SCALE_NAME).write_text(_SCALE, encoding="utf-8")
        write_run_script(folder, engine, plugin, deck.layout.ranks)
        if law := source_of(case.liquid.law):
            shutil.copyfile(law, folder / run_directory.LAW_NAME)
        record = {
            "case": case.as_dict(),
            "deck": deck.text,
            "sha256": checksums(folder, deck.files),
        }
        write_json(folder / run_directory.DECK_RECORD_NAME, record)
    except OSError as error:  # a disk that is full names no file
        error.filename = str(folder)
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder / decks.DECK_NAME


def as_run(case: Case, directory: Path | None) -> Case:
    """The case with the number of cycles of its finished run, if there is one; `InputError` if it cannot be read."""
    if not case.run.until_steady or directory is None:
        return case
    try:
        return case.for_cycles(int(read_manifest(directory)["steps"]) // case.run.steps_per_cycle)
    except FileNotFoundError:
        return case
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise input_error(
            directory, f"the run's {MANIFEST_NAME} cannot be read ({error})"
        ) from error


def take_in(folder: Path) -> None:
    """Make a run directory of the folder of a deck that was run by hand, unless it is up to date.

    `InputError` if the deck was not run, is still running, or failed; or its files cannot be read.
    """
    deck, logs = (
        folder / decks.DECK_NAME,
        [folder / name for name in _LOGS if (folder / name).is_file()],
    )
    if not logs:
        expected = f"expected a log of the engine, {' or '.join(_LOGS)}"
        raise input_error(
            folder, f"the deck was not run ({expected}); do: cd {folder} && sh {decks.RUN_NAME}"
        )
    log, manifest = max(logs, key=_age), folder / MANIFEST_NAME
    if manifest.is_file() and _age(manifest) >= max(_age(deck), _age(log)):
        return
    try:
        _measure(folder, deck, log)
    except MissingFrames as failure:
        why = "the engine that was started by hand still runs or was stopped, or its dump was cut later"
        raise input_error(folder, f"{why}: {failure}") from failure
    except EngineFailure as failure:
        raise input_error(folder, f"the deck that was run by hand failed: {failure}") from failure
    except (OSError, ValueError, KeyError, TypeError, DumpError) as error:
        raise input_error(
            folder, f"the deck that was run by hand cannot be read ({error})"
        ) from error


def _age(path: Path) -> int:
    return path.stat().st_mtime_ns


def _measure(folder: Path, deck: Path, log: Path) -> None:
    """Write the files of a run directory: case, layout, segment, tables, result, last the manifest."""
    from walkers.postprocess.measure.gait import are_constant

    record = read_json(folder / run_directory.DECK_RECORD_NAME)
    before = run_directory.with_recorded_law(stored_case(record["case"]), folder)
    words = (_PRINTED.findall(log.read_text(encoding="utf-8", errors="replace")) or [""])[
        -1
    ].split()
    values = {name: float(value) for name, value in zip(words[::2], words[1::2], strict=True)}
    was = _parameters(record["deck"], values)
    edited = {
        name: now
        for name, now in values.items()
        if name in was and not isclose(now, was[name], rel_tol=_SAME)
    }
    case = before.for_cycles(before.run.attempts[0])
    if edited:
        case = _edited(case, values, edited, f"{folder}: the edited deck")
    edits = [f"{name} {value:g}, was {was[name]:g}" for name, value in edited.items()]
    edits += _other_edits(
        record["deck"], deck.read_text(encoding="utf-8", errors="surrogateescape"), values
    )
    edits += _edited_files(record.get("sha256", {}), folder)
    rest = int(values.get("rest_steps", 0))
    segment = Segment(0, rest + case.run.steps, rest)
    rendered = decks.render_deck(case, segment)
    report = judge(rendered, folder, log)
    report = replace(report, wall_seconds=report.loop_seconds)
    notes = ["run by hand", *([f"the deck was edited: {'; '.join(edits)}"] if edits else [])]
    if _age(deck) > _age(log):
        notes.append(f"{deck.name} is newer than {log.name}: if it was edited since, run it again")
    (folder / MANIFEST_NAME).unlink(missing_ok=True)
    write_json(folder / run_directory.CASE_NAME, case.as_dict(), sync=False)
    write_json(folder / decks.LAYOUT_NAME, rendered.layout.as_dict(), sync=False)
    run_directory.write_segment_record(
        folder, segment, report, by_hand=run_directory.ByHand(notes, bool(edits))
    )
    # Cycles that were enough for the finished run of a case may be too few for an edited deck.
    planned = before.run
    doubtful = (
        case.run.cycles < planned.cycles if planned.until_steady else case.apart and case != before
    )
    if doubtful and not are_constant(folder):
        reached = f"the velocities are not constant within {percent(CONSTANT)} after {case.run.cycles} cycles"
        more = f"{planned.cycles}, as walkers run does," if planned.until_steady else "more"
        notes.append(f"{reached}; set cycles to {more} and run again")
        run_directory.write_segment_record(
            folder, segment, report, by_hand=run_directory.ByHand(notes, bool(edits))
        )
    measure(folder)
    scaled = folder / decks.SCALED_BRIDGES_NAME
    tables = scaled if scaled.is_file() else folder / decks.BRIDGES_NAME
    finished = FinishedRun(
        case=case,
        name=folder.name,
        engine=None,
        report=report,
        started=time.time(),
        segments=1,
        drive_from=rest,
        by_hand=notes,
        bridge_tables=checksum(tables),
    )
    write_manifest(folder, finished)


def _parameters(deck: str, values: Mapping[str, float]) -> dict[str, float]:
    """The parameters of a deck as it was written; those that follow from others, from the new values of these."""
    was = {
        name: float(text) for name, text in _LINE.findall(deck) if name in values and text[0] != "$"
    }
    now = {**was, **values}
    for end in (name.removeprefix("amplitude") for name in values if name.startswith("amplitude")):
        peak, turning = now[f"peak_acceleration{end}"], 2.0 * pi * now[f"frequency{end}"]
        was |= {f"amplitude{end}": peak / turning**2, f"peak_velocity{end}": peak / turning}
    cycle = now["cycle_frequency" if "cycle_frequency" in now else "frequency"]
    return was | {"time_step": 1.0 / (cycle * now["steps_per_cycle"])}


def _edited(
    case: Case, values: Mapping[str, float], edited: Mapping[str, float], source: str
) -> Case:
    """The case that the engine ran, from the parameters that it printed."""
    keys, number_of_sines = dict(_KEYS), len(case.excitation.harmonics)
    for place, end in enumerate(suffixes(number_of_sines)):
        table = "drive" if number_of_sines == 1 else f"drive.harmonics[{place}]"
        keys |= {f"{name}{end}": f"{table}.{name}" for name in _OF_SINES}
    numbers = {keys[name]: value for name, value in edited.items() if name in keys}
    for (
        name,
        key,
    ) in (
        keys.items()
    ):  # a deck has no Γ0: the acceleration is that for the density for which it was made
        if (
            key.endswith("peak_acceleration")
            and case.document["drive"].get("waveform", "sine") == "sine"
        ):
            end = name.removeprefix("peak_acceleration")
            implied = values[f"amplitude{end}"] * (2.0 * pi * values[f"frequency{end}"]) ** 2
            numbers[key] = implied if f"amplitude{end}" in edited else values[name]
    changes: dict[str, Any] = {
        key: f"{number!r} {kind.unit}" if (kind := quantity_kind(key)) else number
        for key, number in numbers.items()
    }
    step, steps, cycles = values["time_step"], int(values["steps_per_cycle"]), int(values["cycles"])
    if "viscosity" in edited:
        changes["liquid.viscosity_ratio"] = 1.0
    if "steps_per_cycle" in edited:
        changes |= {"run.time_step": f"{step!r} s", "run.allow_unstable": True}
    if "cycles" in edited:
        changes |= {"run.cycles": cycles} | (
            {"run.settling_cycles": settling_of(cycles)} if case.apart else {}
        )
    ran = build_case(
        changed(CaseFile, case.document, changes), source=source, name=case.name
    ).for_cycles(cycles)
    frequency, parts = ran.excitation.frequency, case.run.samples_per_cycle
    if not isclose(step * steps * frequency, 1.0, rel_tol=_SAME) or steps % parts:
        raise ValueError(
            f"{steps} steps of {step:g} s are not one cycle of {frequency:g} Hz in {parts} equal parts: "
            f"edit steps_per_cycle (a multiple of {parts}); time_step follows from it and the frequency"
        )
    for key, walkers in case.walkers_by_key.items():
        ran = ran.with_value_at(f"{key}.spacing", walkers.spacing)
    lasts = {"time_step": step, "steps_per_cycle": steps, "cycles": cycles}
    kept = ("samples_per_cycle", "cycles_per_sample", "samples_per_bridge_sample")
    return ran.with_values(
        run=ran.run.with_values(**lasts, **{name: getattr(case.run, name) for name in kept})
    )


def _edited_files(written: Mapping[str, str], folder: Path) -> list[str]:
    """A line about files of the deck whose checksums are not those with which they were written."""
    edited = [name for name in sorted(written) if checksum(folder / name) != written[name]]
    return [f"{', '.join(edited)}, of which the case knows nothing"] if edited else []


def _other_edits(written: str, edited_text: str, parameters: Collection[str]) -> list[str]:
    """A line about edited commands that set no parameter, if there are any."""

    def sets_parameter(line: str) -> bool:
        return (named := _LINE.match(line)) is not None and named[1] in parameters

    before, after = (
        [
            " ".join(line.partition("#")[0].split())
            for line in text.splitlines()
            if not sets_parameter(line)
        ]
        for text in (written, edited_text)
    )
    lines = [line for line in after if line not in [*before, ""]] or [
        line for line in before if line not in after
    ]
    return (
        [f"{len(lines)} other line(s), which are not part of the case, first: {lines[0]}"]
        if lines
        else []
    )
