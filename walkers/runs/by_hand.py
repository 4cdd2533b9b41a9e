"""Decks that are run by hand: their folders, and run directories of them after the run.

The folder of a deck becomes the run directory and its only segment. Its ``deck.json`` contains the
case and the deck as they were written. The engine prints the parameters of the deck that it reads.
Edited parameters become other values of the case; other edits are named in the result.
"""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isclose, pi
from pathlib import Path
from typing import Any

from walkers.errors import input_error
from walkers.files import checksum, read_json, write_json
from walkers.inputs.bridge_laws import source_of
from walkers.inputs.case_building import build_case, stored_case
from walkers.inputs.config_table import changed
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.tables.materials import FrictionLaw
from walkers.inputs.tables.run import CONSTANT, settling_of
from walkers.postprocess.measure.dump import DumpError
from walkers.postprocess.measure.results import measure
from walkers.rounding import percent
from walkers.runner import run_directory
from walkers.runner.binary import find_engine
from walkers.runner.compiled_model import plugin_of, write_run_script
from walkers.runner.failures import EngineFailure, MissingFrames
from walkers.runner.launch import EngineReport, judge
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

LOG_NAMES = (decks.OUTPUT_NAME, "log.liggghts")
"""Output of the engine by `write_run_script`, and the default log of LIGGGHTS."""
_PRINTED_LINE = re.compile(rf"^{PRINTED} (.+)$", re.MULTILINE)
"""Line of a log with the names and values of all parameters."""
_PARAMETER_LINE = re.compile(r"^variable +(\w+) string +(\S+)", re.MULTILINE)
"""Line of a deck that sets a parameter: name and value."""
_SAME_VALUE = 1e-9
"""Relative difference up to which a printed parameter is the written one."""
_HARMONIC_PARAMETERS = ("frequency", "peak_acceleration", "phase")
"""Parameters of a deck that have a value for each harmonic of the drive."""
_KEYS: Mapping[str, str] = {
    "gravity": "environment.gravity",
    "density": "beads.density",
    "viscosity": "liquid.dynamic_viscosity",
    "friction_bead_bead": "contact.friction.bead_bead",
    "friction_bead_wall": "contact.friction.bead_wall",
    "youngs_modulus": "contact.youngs_modulus",
    "poissons_ratio": "contact.poissons_ratio",
    "restitution": "contact.restitution",
    "rolling_friction": "contact.rolling_friction",
}
"""For parameters of a deck, the keys of a case; those of the drive depend on its harmonics."""
_SCALE = """# Writes tables for another viscosity: the deck gives the factor of the resistances.
/^edge/ { printf "edge %.12g\\n", $2 * resistance ^ (2 / 3); next }
/^[-+.0-9]/ { printf "%s %s", $1, $2; for (i = 3; i <= NF; i++) printf " %.12g", resistance * $i
              printf "\\n"; next }
{ print }
"""
"""Program for ``awk`` that a deck calls if its viscosity was edited."""


@dataclass(frozen=True)
class _RunByHand:
    """A deck that was run by hand.

    Attributes
    ----------
    written
        The case for which the deck was written.
    case
        The case that the engine ran.
    segment
        The steps of the run.
    edits
        What was edited, as text.
    """

    written: Case
    case: Case
    segment: Segment
    edits: Sequence[str]


# --- before the run -------------------------------------------------------------------------------


def write_folder(case: Case, folder: Path) -> Path:
    """Write the complete deck of a case to a new folder.

    Returns
    -------
    Path
        The deck in the folder.

    Raises
    ------
    InputError
        If the folder exists or cannot be made.
    WalkersError
        If there is no engine (`find_engine`), or the contact model cannot be compiled
        (`plugin_of`).
    """
    deck = decks.render_deck(case, decks.single_segment(case))
    engine = find_engine()
    plugin = plugin_of(engine)
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        reason = f"cannot make the folder ({error.strerror})"
        raise input_error(folder, f"{reason}: expected the name of a new one") from error
    try:
        run_directory.write_deck(deck, folder)
        (folder / decks.SCALE_NAME).write_text(_SCALE, encoding="utf-8")
        write_run_script(folder, engine, plugin, deck.layout.ranks)
        law = source_of(case.liquid.law)
        if law:
            shutil.copyfile(law, folder / run_directory.LAW_NAME)
        record = {
            "case": case.as_dict(),
            "deck": deck.text,
            "sha256": checksums(folder, deck.files),
        }
        write_json(folder / run_directory.DECK_RECORD_NAME, record)
    except OSError as error:
        error.filename = str(folder)  # the error of a full disk names no file
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder / decks.DECK_NAME


def as_run(case: Case, directory: Path | None) -> Case:
    """The case with the number of cycles that its run took.

    Only a case that runs until the velocity is constant (``until_steady``) changes.

    Parameters
    ----------
    case
        A case.
    directory
        The directory of its finished run; None if there is none.

    Raises
    ------
    InputError
        If the manifest of the run cannot be read.
    """
    if not case.run.until_steady or directory is None:
        return case
    try:
        steps = int(read_manifest(directory)["steps"])
        return case.for_cycles(steps // case.run.steps_per_cycle)
    except FileNotFoundError:
        return case
    except (OSError, ValueError, KeyError, TypeError) as error:
        reason = f"the run's {MANIFEST_NAME} cannot be read ({error})"
        raise input_error(directory, reason) from error


# --- after the run --------------------------------------------------------------------------------


def take_in(folder: Path) -> None:
    """Make a run directory of the folder of a deck that was run by hand, unless it is up to date.

    Raises
    ------
    InputError
        If the deck was not run, is still running, or failed, or if its files cannot be read.
    """
    deck = folder / decks.DECK_NAME
    logs = [folder / name for name in LOG_NAMES if (folder / name).is_file()]
    if not logs:
        expected = f"expected a log of the engine, {' or '.join(LOG_NAMES)}"
        command = f"cd {folder} && sh {decks.RUN_NAME}"
        raise input_error(folder, f"the deck was not run ({expected}); do: {command}")
    log = max(logs, key=_modified)
    manifest = folder / MANIFEST_NAME
    if manifest.is_file() and _modified(manifest) >= max(_modified(deck), _modified(log)):
        return
    try:
        _make_run_directory(folder, deck, log)
    except MissingFrames as failure:
        reason = (
            "the engine that was started by hand still runs or was stopped, "
            "or its dump was cut later"
        )
        raise input_error(folder, f"{reason}: {failure}") from failure
    except EngineFailure as failure:
        raise input_error(folder, f"the deck that was run by hand failed: {failure}") from failure
    except (OSError, ValueError, KeyError, TypeError, DumpError) as error:
        reason = f"the deck that was run by hand cannot be read ({error})"
        raise input_error(folder, reason) from error


def _modified(path: Path) -> int:
    """Time of the last change of a file, in ns since the epoch."""
    return path.stat().st_mtime_ns


def _make_run_directory(folder: Path, deck: Path, log: Path) -> None:
    """Write the files of a run directory: case, layout, segment, tables, result, manifest."""
    run = _read_run(folder, deck, log)
    rendered = decks.render_deck(run.case, run.segment)
    report = judge(rendered, folder, log)
    report = replace(report, wall_seconds=report.loop_seconds)
    notes = ["run by hand"]
    if run.edits:
        notes.append(f"the deck was edited: {'; '.join(run.edits)}")
    if _modified(deck) > _modified(log):
        notes.append(f"{deck.name} is newer than {log.name}: if it was edited since, run it again")
    (folder / MANIFEST_NAME).unlink(missing_ok=True)
    write_json(folder / run_directory.CASE_NAME, run.case.as_dict(), sync=False)
    write_json(folder / decks.LAYOUT_NAME, rendered.layout.as_dict(), sync=False)
    _write_segment_record(folder, run, report, notes)
    advice = _advice_on_length(folder, run)
    if advice:
        notes.append(advice)
        _write_segment_record(folder, run, report, notes)
    measure(folder)
    scaled_tables = folder / decks.SCALED_BRIDGES_NAME
    tables = scaled_tables if scaled_tables.is_file() else folder / decks.BRIDGES_NAME
    finished = FinishedRun(
        case=run.case,
        name=folder.name,
        engine=None,
        report=report,
        started=time.time(),
        segments=1,
        drive_from=run.segment.drive_from or 0,
        by_hand=notes,
        bridge_tables=checksum(tables),
    )
    write_manifest(folder, finished)


def _write_segment_record(
    folder: Path, run: _RunByHand, report: EngineReport, notes: Sequence[str]
) -> None:
    """Write the record of the only segment, with what the user should know about the run."""
    by_hand = run_directory.ByHand(notes, deck_edited=bool(run.edits))
    run_directory.write_segment_record(folder, run.segment, report, by_hand=by_hand)


def _advice_on_length(folder: Path, run: _RunByHand) -> str:
    """Advice to run more cycles if the velocities are not constant; empty if they are.

    The cycles that were enough for the finished run of a case may be too few for an edited deck.
    The segment of the run must have been written.
    """
    from walkers.postprocess.measure.gait import are_constant

    planned = run.written.run
    cycles = run.case.run.cycles
    if planned.until_steady:
        may_be_short = cycles < planned.cycles
        advice = f"set cycles to {planned.cycles}, as walkers run does, and run again"
    else:
        # Walkers that are apart (independent of each other) reach a constant velocity; others and
        # loose beads need not.
        may_be_short = run.case.apart and run.case != run.written
        advice = "increase cycles and run again"
    if not may_be_short or are_constant(folder):
        return ""
    reached = f"the velocities are not constant within {percent(CONSTANT)} after {cycles} cycles"
    return f"{reached}; {advice}"


def _read_run(folder: Path, deck: Path, log: Path) -> _RunByHand:
    """What was run, from the record of the written deck, the deck as it is now, and the log."""
    record = read_json(folder / run_directory.DECK_RECORD_NAME)
    written = run_directory.with_recorded_law(stored_case(record["case"]), folder)
    values = _printed_parameters(log)
    written_values = _written_parameters(record["deck"], values)
    edited = {}
    edits = []
    for name, value in values.items():
        if name not in written_values:
            continue
        if not isclose(value, written_values[name], rel_tol=_SAME_VALUE):
            edited[name] = value
            edits.append(f"{name} {value:g}, was {written_values[name]:g}")
    case = written.for_cycles(written.run.attempts[0])
    if edited:
        case = _edited_case(case, values, edited, source=f"{folder}: the edited deck")
    text = deck.read_text(encoding="utf-8", errors="surrogateescape")
    edits += _edited_commands(record["deck"], text, values)
    edits += _edited_files(record.get("sha256", {}), folder)
    rest_steps = int(values.get("rest_steps", 0))
    segment = Segment(0, rest_steps + case.run.steps, rest_steps)
    return _RunByHand(written, case, segment, edits)


def _printed_parameters(log: Path) -> dict[str, float]:
    """The parameters that the engine printed last, by their names in the deck; empty if none."""
    lines = _PRINTED_LINE.findall(log.read_text(encoding="utf-8", errors="replace"))
    if not lines:
        return {}
    words = lines[-1].split()
    names = words[::2]
    values = [float(word) for word in words[1::2]]
    return dict(zip(names, values, strict=True))


def _written_parameters(deck: str, values: Mapping[str, float]) -> dict[str, float]:
    """The parameters of a deck as it was written.

    Parameters that the deck derives from others are computed from the new ``values`` of these, so
    that they differ only if their own line was edited.
    """
    written = {}
    for name, text in _PARAMETER_LINE.findall(deck):
        is_formula = text.startswith("$")
        if name in values and not is_formula:
            written[name] = float(text)
    current = {**written, **values}
    for name in values:
        if name.startswith("amplitude"):
            suffix = name.removeprefix("amplitude")
            peak_acceleration = current[f"peak_acceleration{suffix}"]
            angular_frequency = 2.0 * pi * current[f"frequency{suffix}"]
            written[f"amplitude{suffix}"] = peak_acceleration / angular_frequency**2
            written[f"peak_velocity{suffix}"] = peak_acceleration / angular_frequency
    cycle_frequency = current["cycle_frequency" if "cycle_frequency" in current else "frequency"]
    written["time_step"] = 1.0 / (cycle_frequency * current["steps_per_cycle"])
    return written


def _edited_case(
    case: Case, values: Mapping[str, float], edited: Mapping[str, float], source: str
) -> Case:
    """The case that the engine ran.

    Parameters
    ----------
    case
        The case for which the deck was written.
    values
        All parameters that the engine printed, SI units.
    edited
        Those that were edited.
    source
        What messages call the edited deck.

    Raises
    ------
    InputError
        If a case cannot have the values.
    ValueError
        If the steps do not make up cycles.
    """
    changes = _changes(case, values, edited)
    cycles = int(values["cycles"])
    document = changed(CaseFile, case.document, changes)
    edited_case = build_case(document, source=source, name=case.name).for_cycles(cycles)
    time_step = values["time_step"]
    steps_per_cycle = int(values["steps_per_cycle"])
    frequency = edited_case.excitation.frequency
    samples = case.run.samples_per_cycle
    is_one_cycle = isclose(time_step * steps_per_cycle * frequency, 1.0, rel_tol=_SAME_VALUE)
    if not is_one_cycle or steps_per_cycle % samples:
        raise ValueError(
            f"{steps_per_cycle} steps of {time_step:g} s are not one cycle of {frequency:g} Hz in "
            f"{samples} equal parts: edit steps_per_cycle (a multiple of {samples}); "
            "time_step follows from it and the frequency"
        )
    # The deck still has the spacing and the sampling of the case for which it was written. From the
    # edited values, the case would choose others.
    for key, walkers in case.walkers_by_key.items():
        edited_case = edited_case.with_value_at(f"{key}.spacing", walkers.spacing)
    run = edited_case.run.with_values(
        time_step=time_step,
        steps_per_cycle=steps_per_cycle,
        cycles=cycles,
        samples_per_cycle=case.run.samples_per_cycle,
        cycles_per_sample=case.run.cycles_per_sample,
        samples_per_bridge_sample=case.run.samples_per_bridge_sample,
    )
    return edited_case.with_values(run=run)


def _changes(
    case: Case, values: Mapping[str, float], edited: Mapping[str, float]
) -> dict[str, Any]:
    """Keys of the case that edited parameters change, with their values as in a case file."""
    keys = _keys_of_parameters(case)
    numbers = {keys[name]: value for name, value in edited.items() if name in keys}
    if case.document["drive"].get("waveform", "sine") == "sine":
        numbers |= _peak_accelerations(keys, values, edited)
    changes: dict[str, Any] = {}
    for key, number in numbers.items():
        kind = quantity_kind(key)
        changes[key] = number if kind is None else f"{number!r} {kind.unit}"
    if "viscosity" in edited:
        changes["liquid.viscosity_ratio"] = 1.0
    if "steps_per_cycle" in edited:
        changes["run.time_step"] = f"{values['time_step']!r} s"
        changes["run.allow_unstable"] = True
    if "cycles" in edited:
        cycles = int(values["cycles"])
        changes["run.cycles"] = cycles
        if case.apart:  # walkers that are independent of each other are measured once settled
            changes["run.settling_cycles"] = settling_of(cycles)
    return changes


def _keys_of_parameters(case: Case) -> dict[str, str]:
    """For each parameter of the deck of a case, the key of the case."""
    keys = dict(_KEYS)
    for pair in ("bead_bead", "bead_wall"):
        key = f"contact.friction.{pair}"
        if isinstance(case.contact.value_of(f"friction.{pair}"), FrictionLaw):
            keys[f"friction_{pair}"] = f"{key}.at_rest"
            keys[f"friction_rise_{pair}"] = f"{key}.rise"
            keys[f"friction_velocity_{pair}"] = f"{key}.half_rise_velocity"
    count = len(case.excitation.harmonics)
    for index, suffix in enumerate(suffixes(count)):
        table = "drive" if count == 1 else f"drive.harmonics[{index}]"
        for name in _HARMONIC_PARAMETERS:
            keys[f"{name}{suffix}"] = f"{table}.{name}"
    return keys


def _peak_accelerations(
    keys: Mapping[str, str], values: Mapping[str, float], edited: Mapping[str, float]
) -> dict[str, float]:
    """Peak accelerations (m/s²) of the harmonics of a sinusoidal drive, by their keys.

    All of them are given, edited or not: a deck has no Γ0, and the acceleration that it has is
    that of the density for which it was written. An edited amplitude implies another acceleration.
    """
    accelerations = {}
    for name, key in keys.items():
        if key.endswith("peak_acceleration"):
            suffix = name.removeprefix("peak_acceleration")
            amplitude = f"amplitude{suffix}"
            if amplitude in edited:
                angular_frequency = 2.0 * pi * values[f"frequency{suffix}"]
                accelerations[key] = values[amplitude] * angular_frequency**2
            else:
                accelerations[key] = values[name]
    return accelerations


def _edited_commands(written: str, current: str, parameters: Collection[str]) -> list[str]:
    """A text about edited commands that set no parameter, if there are any."""
    before = _commands(written, parameters)
    after = _commands(current, parameters)
    lines = [line for line in after if line not in before]
    if not lines:
        lines = [line for line in before if line not in after]
    if not lines:
        return []
    return [f"{len(lines)} other line(s), which are not part of the case, first: {lines[0]}"]


def _commands(deck: str, parameters: Collection[str]) -> list[str]:
    """The lines of a deck that set no parameter, without comments and superfluous spaces."""
    commands = []
    for line in deck.splitlines():
        match = _PARAMETER_LINE.match(line)
        sets_parameter = match is not None and match[1] in parameters
        command = " ".join(line.partition("#")[0].split())
        if command and not sets_parameter:
            commands.append(command)
    return commands


def _edited_files(written: Mapping[str, str], folder: Path) -> list[str]:
    """A text about files of the deck whose checksums are not those with which they were written."""
    edited = [name for name in sorted(written) if checksum(folder / name) != written[name]]
    if not edited:
        return []
    return [f"{', '.join(edited)}, of which the case knows nothing"]
