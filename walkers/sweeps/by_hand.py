"""Decks that are run by hand: write the folder of a deck, and make a run directory of it after the run.

The folder becomes the run directory and its only segment. ``deck.json`` contains the original case and deck. The engine
prints the parameters that it reads: a deck with edited parameters gives the case with other values of these keys.
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

from walkers.errors import refused
from walkers.inputs.case import Case
from walkers.inputs.run import CONSTANT
from walkers.inputs.table import changed
from walkers.physics.laws import source_of
from walkers.postprocess.dump import DumpError
from walkers.postprocess.results import measure
from walkers.rounding import percent
from walkers.runner import directory as on_disk
from walkers.runner.binary import find_engine, plugin_of, write_run_script
from walkers.runner.failures import EngineFailure, MissingFrames
from walkers.runner.files import read_json, write_json
from walkers.runner.launch import EngineReport, judge
from walkers.runner.manifest import MANIFEST_NAME, read_manifest, write_manifest
from walkers.sweeps.readable import kind_of
from walkers.templates import deck as decks
from walkers.templates.deck import Deck, Segment
from walkers.templates.parameters import PRINTED, suffixes

_LOGS = (decks.OUTPUT_NAME, "log.liggghts")
"""Output of the engine by `write_run_script`, and the default log of LIGGGHTS."""
_PRINTED = re.compile(rf"^{PRINTED} (.+)$", re.MULTILINE)
_LINE = re.compile(r"^variable +(\w+) string (\S+)", re.MULTILINE)
_SAME = 1e-9
_SINE = {"frequency": "Hz", "peak_acceleration": "m/s^2", "phase": "rad"}
_KEYS: Mapping[str, str] = {
    "gravity": "environment.gravity",
    "density": "beads.density",
    "viscosity": "liquid.dynamic_viscosity",
    "time_step": "run.time_step",
    **{f"friction_{pair}": f"contact.friction.{pair}" for pair in ("bead_bead", "bead_wall")},
    **{name: f"contact.{name}" for name in ("youngs_modulus", "poissons_ratio", "restitution", "rolling_friction")},
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
    deck, engine = decks.render_deck(case, decks.whole(case)), find_engine()
    plugin = plugin_of(engine)
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise refused(folder, f"cannot make the folder ({error.strerror}): expected the name of a new one") from error
    try:
        on_disk.write_deck(deck, folder)
        (folder / decks.SCALE_NAME).write_text(_SCALE, encoding="utf-8")
        write_run_script(folder, engine, plugin, deck.layout.ranks)
        if law := source_of(case.liquid.law):
            shutil.copyfile(law, folder / on_disk.LAW_NAME)
        write_json(folder / on_disk.DECK_RECORD_NAME, {"case": case.as_dict(), "deck": deck.text})
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
        raise refused(directory, f"the run's {MANIFEST_NAME} cannot be read ({error})") from error


def take_in(folder: Path) -> None:
    """Make a run directory of the folder of a deck that was run by hand, unless it is up to date.

    `InputError` if the deck was not run, is still running, or failed; or its files cannot be read.
    """
    logs = [folder / name for name in _LOGS if (folder / name).is_file()]
    try:
        ages = {path: path.stat().st_mtime_ns for path in [folder / decks.DECK_NAME, *logs, folder / MANIFEST_NAME]}
        if max(ages.values()) == ages[folder / MANIFEST_NAME]:
            return
    except OSError:  # it is no run directory yet
        pass
    if not logs:
        expected = f"expected a log of the engine, {' or '.join(_LOGS)}"
        raise refused(folder, f"the deck was not run ({expected}); do: cd {folder} && sh {decks.RUN_NAME}")
    log = max(logs, key=lambda path: path.stat().st_mtime_ns)
    try:
        record, deck = read_json(folder / on_disk.DECK_RECORD_NAME), folder / decks.DECK_NAME
        case, written = on_disk.with_recorded_law(Case.from_dict(record["case"]), folder), str(record["deck"])
        edited_text = deck.read_text(encoding="utf-8", errors="surrogateescape")
        log_text = log.read_text(encoding="utf-8", errors="replace")
        ran, segment, changes = _as_run(case, written, edited_text, log_text, f"{folder}: the edited deck")
        notes = ["run by hand", *([f"the deck was edited: {'; '.join(changes)}"] if changes else [])]
        if deck.stat().st_mtime_ns > log.stat().st_mtime_ns:
            notes.append(f"{decks.DECK_NAME} is newer than {log.name}: if it was edited since, run it again")
        rendered = decks.render_deck(ran, segment)
        report = judge(rendered, folder, log)
        _write(folder, ran, rendered, segment, replace(report, wall_seconds=report.loop_seconds), notes, case)
    except MissingFrames as failure:
        why = "the engine that was started by hand still runs or was stopped, or its dump was cut later"
        raise refused(folder, f"{why}: {failure}") from failure
    except EngineFailure as failure:
        raise refused(folder, f"the deck that was run by hand failed: {failure}") from failure
    except (OSError, ValueError, KeyError, TypeError, DumpError) as error:
        raise refused(folder, f"the deck that was run by hand cannot be read ({error})") from error


def _as_run(case: Case, written: str, edited_text: str, log_text: str, source: str) -> tuple[Case, Segment, list[str]]:
    """The case that the engine ran, its segment, and the edits, from the deck as written and now, and the log."""
    case = case.for_cycles(case.run.attempts[0])
    before, after = dict(_LINE.findall(written)), dict(_LINE.findall(edited_text))
    words = (_PRINTED.findall(log_text) or [""])[-1].split()
    values = {name: float(value) for name, value in zip(words[::2], words[1::2], strict=True)}
    # The engine prints a number as its line has it. A formula gives another number if a parameter in it was edited.
    follow = {f"amplitude{end}": sine.amplitude for end, sine in _by_suffix(case)}
    follow |= {"peak_velocity": case.excitation.peak_velocity, "time_step": case.run.time_step}
    was = {name: float(text) if text[0] != "$" else follow[name] for name, text in before.items() if name in values}
    edited = {
        name: values[name]
        for name, number in was.items()
        if (after.get(name) != before[name] if before[name][0] == "$" else values[name] != number)
    }
    ran, rest = _edited(case, values, edited, source) if edited else case, int(values.get("rest_steps", 0))
    changes = [f"{name} {number:g}, was {was[name]:g}" for name, number in edited.items()]
    return ran, Segment(0, rest + ran.run.steps, rest), [*changes, *_other_changes(written, edited_text, values)]


def _edited(case: Case, values: Mapping[str, float], edited: Mapping[str, float], source: str) -> Case:
    """The case with the values of a deck's edited parameters."""
    steps, cycles, step = int(values["steps_per_cycle"]), int(values["cycles"]), values["time_step"]
    document = {name: table for name, table in case.document.items() if name != "uncertain"}
    numbers = {**edited, "time_step": step} if "steps_per_cycle" in edited else edited
    keys = {key: (numbers[name], kind_of(key)) for name, key in _KEYS.items() if name in numbers}
    changes: dict[str, Any] = {key: f"{value!r} {kind.unit}" if kind else value for key, (value, kind) in keys.items()}
    changes |= {"liquid.viscosity_ratio": 1.0} if "viscosity" in edited else {}
    changes |= {"run.allow_unstable": True} if "run.time_step" in changes else {}
    if cycles != case.run.cycles:
        changes["run.cycles"] = cycles
        document["run"] = {
            name: setting for name, setting in document.get("run", {}).items() if name != "settling_cycles"
        }
    # A deck has no Γ0, but the acceleration for the density and the surface tension that it was made for.
    by_gamma0 = any(sine.gamma0 is not None for sine in (case.drive, *case.drive.harmonics))
    if (sines := _sines(case, values)) != _sines(case, {}) or by_gamma0:
        kept = {name: value for name, value in document["drive"].items() if name in ("frame", "ramp")}
        document["drive"] = {**kept, **(sines[0] if len(sines) == 1 else {"harmonics": sines})}
    ran = Case.read(changed(Case, document, changes), source=source, name=case.name).for_cycles(cycles)
    drive, parts = ran.excitation, case.run.samples_per_cycle
    if not isclose(step * steps * drive.frequency, 1.0, rel_tol=_SAME) or steps % parts:
        raise ValueError(
            f"{steps} steps of {step:g} s are not one cycle of {drive.frequency:g} Hz in {parts} equal parts: "
            f"edit steps_per_cycle (a multiple of {parts}); time_step follows from it and the frequency"
        )
    if not isclose(start := values.get("peak_velocity", drive.peak_velocity), drive.peak_velocity, rel_tol=_SAME):
        raise ValueError(
            f"beads start at peak_velocity {start:g} m/s, but the walls at {drive.peak_velocity:g} m/s: edit "
            "peak_acceleration or frequency, from which amplitude and peak_velocity follow"
        )
    for key, walkers in case.walkers_by_key.items():
        ran = ran.put(f"{key}.spacing", walkers.spacing)
    sampling = {name: getattr(case.run, name) for name in ("cycles_per_sample", "samples_per_bridge_sample")}
    run = ran.run.but(time_step=step, steps_per_cycle=steps, cycles=cycles, samples_per_cycle=parts, **sampling)
    return ran.but(run=run)


def _by_suffix(case: Case) -> list[tuple[str, Any]]:
    sines = case.excitation.harmonics
    return list(zip(suffixes(len(sines)), sines, strict=True))


def _sines(case: Case, values: Mapping[str, float]) -> list[dict[str, Any]]:
    """The sines of a drive as tables of a case file, with other values; an edited amplitude gives the acceleration."""
    tables = []
    for end, sine in _by_suffix(case):
        numbers = {name: values.get(f"{name}{end}", getattr(sine, name)) for name in _SINE}
        implied = values.get(f"amplitude{end}", 0.0) * (2.0 * pi * numbers["frequency"]) ** 2
        if implied and not isclose(implied, numbers["peak_acceleration"], rel_tol=_SAME):
            numbers["peak_acceleration"] = implied
        axis = sine.axis if isinstance(sine.axis, str) else [*sine.axis]
        tables.append({"axis": axis, **{name: f"{number!r} {_SINE[name]}" for name, number in numbers.items()}})
    return tables


def _other_changes(written: str, edited_text: str, parameters: Collection[str]) -> list[str]:
    """A line about other edited commands, if there are any."""
    before, after = (
        [
            command
            for line in text.splitlines()
            if (command := " ".join(line.partition("#")[0].split()))
            and not ((parameter := _LINE.match(line)) and parameter[1] in parameters)
        ]
        for text in (written, edited_text)
    )
    lines = [line for line in after if line not in before] or [line for line in before if line not in after]
    return [f"{len(lines)} other line(s), which are not part of the case, first: {lines[0]}"] if lines else []


def _write(
    folder: Path, case: Case, deck: Deck, segment: Segment, report: EngineReport, notes: list[str], before: Case
) -> None:
    """Write the files of a run directory of a deck, exported for ``before``: tables, result, last the manifest."""
    from walkers.postprocess.gait import are_constant

    (folder / MANIFEST_NAME).unlink(missing_ok=True)
    write_json(folder / on_disk.CASE_NAME, case.as_dict(), at_once=False)
    write_json(folder / decks.LAYOUT_NAME, deck.layout.as_dict(), at_once=False)
    on_disk.write_segment_record(folder, segment, report, by_hand=notes)
    planned = before.run
    # Cycles that were enough for the finished run of a case may be too few for an edited deck.
    doubtful = case.run.cycles < planned.cycles if planned.until_steady else case.apart and case != before
    if doubtful and not are_constant(folder):
        reached = f"the velocities are not constant within {percent(CONSTANT)} after {case.run.cycles} cycles"
        further = f"walkers run continues to {planned.cycles}: set cycles to {planned.cycles} and run the deck again"
        notes.append(f"{reached}; {further if planned.until_steady else 'set cycles to more and run the deck again'}")
        on_disk.write_segment_record(folder, segment, report, by_hand=notes)
    measure(folder)
    about: dict[str, Any] = {"drive_from": segment.drive_from, "segments": 1, "by_hand": notes}
    write_manifest(case, folder.name, None, report, started=time.time(), directory=folder, **about)
