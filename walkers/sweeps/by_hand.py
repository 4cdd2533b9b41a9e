"""Decks that are run by hand: write the folder of a deck, and make a run directory of it after the run.

The folder becomes the run directory and its only segment. ``deck.json`` contains the original case and deck. The engine
prints the parameters that it reads: a deck with edited parameters gives another case.
"""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Collection, Mapping
from dataclasses import replace
from math import isclose, isfinite, nan
from pathlib import Path
from typing import Any

from walkers.errors import refused
from walkers.inputs.case import Case
from walkers.inputs.drive import Excitation, Harmonic
from walkers.inputs.run import CONSTANT, limits_of
from walkers.inputs.table import changed as table_changed
from walkers.physics.laws import source_of
from walkers.postprocess.dump import DumpError
from walkers.postprocess.results import measure
from walkers.rounding import percent
from walkers.runner.binary import find_engine, plugin_of, write_run_script
from walkers.runner.directory import (
    CASE_NAME,
    DECK_RECORD_NAME,
    LAW_NAME,
    layout_of,
    with_recorded_law,
    write_deck,
    write_segment_record,
)
from walkers.runner.failures import EngineFailure, MissingFrames
from walkers.runner.files import read_json, write_json
from walkers.runner.launch import EngineReport, judge
from walkers.runner.manifest import MANIFEST_NAME, read_manifest, write_manifest
from walkers.templates.deck import (
    DECK_NAME,
    LAYOUT_NAME,
    OUTPUT_NAME,
    RUN_NAME,
    SCALE_NAME,
    Deck,
    Segment,
    render_deck,
    whole,
)
from walkers.templates.parameters import PRINTED, suffixes

_LOGS = (OUTPUT_NAME, "log.liggghts")
"""Output of the engine by `write_run_script`, and the default log of LIGGGHTS."""
_PRINTED = re.compile(rf"^{PRINTED} (.+)$", re.MULTILINE)
_GIVEN = re.compile(r"^variable +(\w+) string ([-+.\de]+)(?: |$)", re.MULTILINE)
_LINE = re.compile(r"^variable +(\w+) string (\S+)", re.MULTILINE)
_VARIABLE = re.compile(r"variable (\w+) string")
_SAME = 1e-9
_SETTINGS: Mapping[str, tuple[str, str]] = {
    "gravity": ("environment.gravity", "m/s^2"),
    "density": ("beads.density", "kg/m^3"),
    "youngs_modulus": ("contact.youngs_modulus", "Pa"),
    "surface_tension": ("liquid.surface_tension", "N/m"),
    "viscosity": ("liquid.dynamic_viscosity", "Pa*s"),
    **{name: (f"contact.{name}", "") for name in ("poissons_ratio", "restitution", "rolling_friction")},
    **{f"friction_{pair}": (f"contact.friction.{pair}", "") for pair in ("bead_bead", "bead_wall")},
}
"""For parameters of a deck, the key of a case and its unit."""
_SCALE = """# Writes tables for another surface tension and viscosity: the deck gives the factors pull and resistance.
/^[-+.0-9]/ { printf "%s", $1; printf " %.12g", pull * $2; for (i = 3; i <= NF; i++) printf " %.12g", resistance * $i
              printf "\\n"; next }
{ print }
"""


def write_folder(case: Case, folder: Path) -> Path:
    """Write the complete deck of a case to a new folder, and return the path of the deck.

    `InputError` if the folder exists or cannot be made; errors of `find_engine` and `plugin_of`.
    """
    deck, engine = render_deck(case, whole(case)), find_engine()
    plugin = plugin_of(engine)
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise refused(folder, f"cannot make the folder ({error.strerror}): expected the name of a new one") from error
    try:
        write_deck(deck, folder)
        (folder / SCALE_NAME).write_text(_SCALE, encoding="utf-8")
        write_run_script(folder, engine, plugin, deck.layout.ranks)
        if law := source_of(case.liquid.law):
            shutil.copyfile(law, folder / LAW_NAME)
        write_json(folder / DECK_RECORD_NAME, {"case": case.as_dict(), "deck": deck.text})
    except OSError as error:  # a disk that is full names no file
        error.filename = str(folder)
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder / DECK_NAME


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
    if _is_current(folder):
        return
    try:
        record = read_json(folder / DECK_RECORD_NAME)
        case, written = with_recorded_law(Case.from_dict(record["case"]), folder), str(record["deck"])
        now = (folder / DECK_NAME).read_text(encoding="utf-8", errors="surrogateescape")
        logs = [folder / name for name in _LOGS if (folder / name).is_file()]
        if not logs:
            expected = f"expected a log of the engine, {' or '.join(_LOGS)}"
            raise refused(folder, f"the deck was not run ({expected}); do: cd {folder} && sh {RUN_NAME}")
        log = max(logs, key=lambda path: path.stat().st_mtime_ns)
        said = log.read_text(encoding="utf-8", errors="replace")
        ran, segment, changes = _as_run(case, written, now, said, f"{folder}: the edited deck")
        deck = render_deck(ran, segment)
        notes = ["run by hand", *([f"the deck was edited: {'; '.join(changes)}"] if changes else [])]
        if (folder / DECK_NAME).stat().st_mtime_ns > log.stat().st_mtime_ns:
            notes.append(f"{DECK_NAME} is newer than {log.name}: if it was edited since, run it again")
        _write(folder, ran, deck, segment, _judged(deck, folder, log), notes, case)
    except (OSError, ValueError, KeyError, TypeError, DumpError) as error:
        raise refused(folder, f"the deck that was run by hand cannot be read ({error})") from error


def _is_current(folder: Path) -> bool:
    """Whether the folder became a run directory after the deck was last edited or run."""
    try:
        layout, made = layout_of(folder), (folder / MANIFEST_NAME).stat().st_mtime_ns
        names = [DECK_NAME, layout.bead_dump, layout.pair_bridge_dump, layout.wall_bridge_dump]
        logs = [name for name in _LOGS if (folder / name).is_file()]
        return all((folder / name).stat().st_mtime_ns <= made for name in [*names, *logs])
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _judged(deck: Deck, folder: Path, log: Path) -> EngineReport:
    try:
        report = judge(deck, folder, log)
    except MissingFrames as failure:
        why = "the engine that was started by hand still runs or was stopped, or its dump was cut later"
        raise refused(folder, f"{why}: {failure}") from failure
    except EngineFailure as failure:
        raise refused(folder, f"the deck that was run by hand failed: {failure}") from failure
    return replace(report, wall_seconds=report.loop_seconds)


def _as_run(case: Case, written: str, now: str, said: str, source: str) -> tuple[Case, Segment, list[str]]:
    """The case that the engine ran, its segment, and the edits, from the deck as written and now, and the log."""
    given = {name: float(value) for name, value in _GIVEN.findall(written)}
    words = (_PRINTED.findall(said) or [""])[-1].split()
    printed = {name: _number(name, value) for name, value in zip(words[::2], words[1::2], strict=True)}
    values, case = {**given, **printed}, case.for_cycles(case.run.attempts[0])
    edited = {name: values[name] for name, value in given.items() if values[name] != value}
    changes = [f"{name} {value:g}, was {given[name]:g}" for name, value in edited.items()]
    before, after = dict(_LINE.findall(written)), dict(_LINE.findall(now))
    follow = {f"amplitude{end}": one.amplitude for end, one in _by_suffix(case.excitation)}  # from other parameters
    follow |= {"peak_velocity": case.excitation.peak_velocity, "time_step": case.run.time_step}
    changed = [name for name in printed if name in follow and name not in given and after.get(name) != before[name]]
    changes += [f"{name} {printed[name]:g}, was {follow[name]:g}" for name in changed]
    differ = edited or not all(isclose(values.get(name, one), one, rel_tol=_SAME) for name, one in follow.items())
    ran, rest = _edited(case, values, edited, source) if differ else case, int(values.get("rest_steps", 0))
    return ran, Segment(0, rest + ran.run.steps, rest), [*changes, *_other_changes(written, now, printed)]


def _number(name: str, value: str) -> float:
    try:
        return float(value)
    except ValueError as error:
        raise ValueError(f'variable {name}: expected a number, found "{value}"') from error


def _edited(case: Case, values: Mapping[str, float], edited: Mapping[str, float], source: str) -> Case:
    """The case with the values of a deck's parameters, some of which were edited: changes of its tables."""
    sines = tuple(_sine(one, end, values) for end, one in _by_suffix(case.excitation))
    drive, run = Excitation(sines, case.drive.frame), case.run
    steps, cycles, step = int(values["steps_per_cycle"]), int(values["cycles"]), values.get("time_step", run.time_step)
    parts, frequency = run.samples_per_cycle, drive.frequency
    if not isclose(step * steps * frequency, 1.0, rel_tol=_SAME) or steps % parts:
        raise ValueError(
            f"{steps} steps of {step:g} s are not one cycle of {frequency:g} Hz in {parts} equal parts: "
            f"edit steps_per_cycle (a multiple of {parts}); time_step follows from it and the frequency"
        )
    if not isclose(start := values.get("peak_velocity", drive.peak_velocity), drive.peak_velocity, rel_tol=_SAME):
        raise ValueError(
            f"beads start at peak_velocity {start:g} m/s, but the walls at {drive.peak_velocity:g} m/s: edit "
            "peak_acceleration or frequency, from which amplitude and peak_velocity follow"
        )
    document = {name: table for name, table in case.document.items() if name != "uncertain"}
    table, other = document.get("run", {}), frequency != case.excitation.frequency
    settings = {key: (edited[name], unit) for name, (key, unit) in _SETTINGS.items() if name in edited}
    changes: dict[str, Any] = {key: f"{value!r} {unit}" if unit else value for key, (value, unit) in settings.items()}
    changes |= {"liquid.viscosity_ratio": 1.0} if "viscosity" in edited else {}
    if {"steps_per_cycle", "time_step"} & edited.keys() or "time_step" in table:
        changes |= {"run.time_step": f"{step!r} s"}
        changes |= {"run.allow_unstable": True} if limits_of(case).exceeded_by(step) else {}
    if cycles != run.cycles or (other and "duration" in table):
        changes["run.cycles"] = cycles
    if cycles != run.cycles:
        document["run"] = {name: value for name, value in table.items() if name != "settling_cycles"}
    if other and (case.loose or "frames_per_second" in table):
        often = {"samples_per_cycle": parts} if parts > 1 else {"frames_per_second": frequency / run.cycles_per_sample}
        changes |= {f"run.{name}": value for name, value in often.items()}
    # A deck has no Γ0, but the acceleration for the density and the surface tension that it was made for.
    by_gamma0 = any(one.gamma0 is not None for one in (case.drive, *case.drive.harmonics))
    if drive != case.excitation or (by_gamma0 and {"density", "surface_tension"} & edited.keys()):
        tables = [_table(one) for one in sines]
        document["drive"] = {"frame": drive.frame, **(tables[0] if len(tables) == 1 else {"harmonics": tables})}
    ran = Case.read(table_changed(Case, document, changes), source=source, name=case.name).for_cycles(cycles)
    for key, walkers in case.walkers_by_key.items():
        ran = ran.put(f"{key}.spacing", walkers.spacing)
    return ran.but(run=ran.run.but(time_step=step, steps_per_cycle=steps, cycles=cycles))


def _by_suffix(drive: Excitation) -> list[tuple[str, Harmonic]]:
    return list(zip(suffixes(len(drive.harmonics)), drive.harmonics, strict=True))


def _sine(one: Harmonic, end: str, values: Mapping[str, float]) -> Harmonic:
    """A sine from its parameters; an amplitude that contradicts the acceleration was edited and replaces it."""
    names = ("frequency", "peak_acceleration", "phase")
    one = one.but(**{name: values.get(f"{name}{end}", getattr(one, name)) for name in names})
    implied = values.get(f"amplitude{end}", nan) * one.angular_frequency**2
    same = not isfinite(implied) or isclose(implied, one.peak_acceleration, rel_tol=_SAME)
    return one if same else one.but(peak_acceleration=implied)


def _table(one: Harmonic) -> dict[str, Any]:
    """A sine as a case file has it."""
    axis = one.axis if isinstance(one.axis, str) else [*one.axis]
    units = {"frequency": "Hz", "peak_acceleration": "m/s^2", "phase": "rad"}
    return {"axis": axis, **{name: f"{getattr(one, name)!r} {unit}" for name, unit in units.items()}}


def _other_changes(written: str, now: str, given: Collection[str]) -> list[str]:
    """A line about edited commands other than parameters, if there are any."""
    before, after = (
        [
            command
            for line in text.splitlines()
            if (command := " ".join(line.partition("#")[0].split()))
            and not ((match := _VARIABLE.match(command)) and match[1] in given)
        ]
        for text in (written, now)
    )
    others = [line for line in after if line not in before] or [line for line in before if line not in after]
    return [f"{len(others)} other line(s), which are not part of the case, first: {others[0]}"] if others else []


def _write(
    folder: Path, case: Case, deck: Deck, segment: Segment, report: EngineReport, notes: list[str], before: Case
) -> None:
    """Write the files of a run directory of a deck, exported for ``before``: tables, result, last the manifest."""
    from walkers.postprocess.gait import are_constant

    (folder / MANIFEST_NAME).unlink(missing_ok=True)
    write_json(folder / CASE_NAME, case.as_dict(), at_once=False)
    write_json(folder / LAYOUT_NAME, deck.layout.as_dict(), at_once=False)
    write_segment_record(folder, segment, report, by_hand=notes)
    wanted = before.run
    # Cycles that were enough for the finished run of a case may be too few for an edited deck.
    doubtful = case.run.cycles < wanted.cycles if wanted.until_steady else case.apart and case != before
    if doubtful and not are_constant(folder):
        reached = f"the velocities are not constant within {percent(CONSTANT)} after {case.run.cycles} cycles"
        further = f"walkers run continues to {wanted.cycles}: set cycles to {wanted.cycles} and run the deck again"
        notes.append(f"{reached}; {further if wanted.until_steady else 'set cycles to more and run the deck again'}")
        write_segment_record(folder, segment, report, by_hand=notes)
    measure(folder)
    about: dict[str, Any] = {"drive_from": segment.drive_from, "segments": 1, "by_hand": notes}
    write_manifest(case, folder.name, None, report, started=time.time(), directory=folder, **about)
