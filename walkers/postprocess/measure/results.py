"""Results of runs: measured and written once, read by all.

A result is flat: a number of each name of `walkers.postprocess.measure.quantities.GROUPS`. The
modules of `MODULES` that apply to a case measure its runs. ``result.json`` contains their versions:
it is outdated if one of these modules, or what all results have in common, has another version now.
Runs without dumps, such as those of a spread, cannot be measured again, so a change of a module
must not outdate the results that other modules measured.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from walkers.errors import InputError, input_error, suggestion
from walkers.files import read_json, write_json
from walkers.inputs.resolving.length import limits_of
from walkers.inputs.resolving.loads import softness_warning
from walkers.inputs.resolving.plausibility import implausible
from walkers.postprocess.measure import meetings, piles, record_part, threshold, walking
from walkers.postprocess.measure.caption import conditions
from walkers.postprocess.measure.in_words import motion_in_words
from walkers.postprocess.measure.measuring_module import MeasuringModule
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.postprocess.measure.numbers import (
    AT_REST,
    MAIN_NUMBERS,
    Row,
    headline,
    important_rows,
    main_errors,
    rows,
    short_text,
    state,
    text_and_unit,
)
from walkers.postprocess.measure.sides import REST
from walkers.postprocess.measure.tables import Columns, read_columns, read_table, write_table
from walkers.postprocess.measure.uncertainty import (
    accuracy_of,
    bands_of,
    uncertain_value_lines,
    uncertain_values,
)
from walkers.rounding import counted, percent
from walkers.runner.manifest import RESULT_NAME, check_unchanged
from walkers.runner.run_directory import (
    SEGMENT_NAME,
    case_of,
    files_of_segments,
    recomputed,
    segment_directories,
)
from walkers.terminal import ASIDE, HEADING, WARNING, styled, text_width, wrapped, wrapped_after

if TYPE_CHECKING:
    import pandas as pd

    from walkers.inputs.origins import Origin
    from walkers.inputs.tables.case import Case

VERSION = 2
"""Version of what all results have in common.

That is the format of ``result.json``, and the numbers, tables and warnings that no module gives.
Results of another version are measured again, whatever modules measured them.
"""
MODULES: tuple[MeasuringModule, ...] = (walking, threshold, meetings, piles, record_part)
"""The modules that measure runs, in the order of their numbers in results."""
_BEFORE_MODULES = 2
"""Version of all modules in results that do not contain versions of modules."""
_ENTRIES = ("case", "drive", "rests_on", "by_hand", "tables", "warnings")
"""Entries of ``result.json`` other than the numbers."""
_INDENT = "    "
"""Start of the further lines of a text for a terminal."""
_HEAD_WIDTH = 13
"""Width of the head beside which wrapped lines stand, characters."""
_DRIVE_NUMBERS = ("frequency", "peak_acceleration", "peak_velocity", "amplitude")
"""Numbers of all results that follow from the drive."""


class Results(dict[str, Any]):
    """The result of a run: numbers in SI units by name; NaN if one is not defined.

    It contains both ends of bands (``velocity_low``, ``velocity_high``) and numerical errors if
    these exist. A name that it lacks raises a `KeyError` with a suggestion.

    Attributes
    ----------
    directory : Path
        The run directory.
    warnings : list of str
        Reasons to doubt the numbers.
    about : dict
        What the numbers belong to:

        ``case``
            Name of the case.
        ``drive``
            The drive in a few words, such as ``80 Hz, a0 = 39.2 m/s²``.
        ``rests_on``
            The values of the case that nobody has measured for it, a dictionary each
            (`walkers.postprocess.measure.uncertainty.uncertain_values`).
        ``by_hand``
            Notes on a deck that was run by hand; empty for other runs.
        ``deck_edited``
            Whether parameters or commands of such a deck are not those of the program.
        ``tables``
            Names of the tables that `table` reads.
    """

    def __init__(
        self,
        directory: Path,
        numbers: Mapping[str, Any],
        warnings: Sequence[str],
        about: Mapping[str, Any],
    ) -> None:
        super().__init__(numbers)
        self.directory = directory
        self.warnings = warnings
        self.about = about

    def __missing__(self, name: object) -> NoReturn:
        """Refuse the name of a number that the result does not have."""
        raise KeyError(f"the result has no number {name}{suggestion(str(name), self)}")

    def columns(self, table: str) -> Columns:
        """A table as arrays."""
        return read_columns(self.directory, table)

    def table(self, table: str) -> pd.DataFrame:
        """A table as a data frame."""
        return read_table(self.directory, table)

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types: the numbers, None for NaN, and ``about``."""
        return {**self.about, **json_numbers(self), "warnings": list(self.warnings)}


def modules_of(case: Case) -> list[MeasuringModule]:
    """The modules that measure a case, in the order of their numbers in results."""
    return [module for module in MODULES if module.applies(case)]


def derived(case: Case) -> dict[str, Any]:
    """Compute the numbers of a result that follow from the case alone.

    Parameters
    ----------
    case
        The case.

    Returns
    -------
    dict of str to number
        Numbers of the drive and of the modules that measure the case, SI units.
    """
    numbers = {name: getattr(case.excitation, name) for name in _DRIVE_NUMBERS}
    for module in modules_of(case):
        numbers |= module.derived(case)
    return numbers


def measure(directory: Path) -> None:
    """Measure a run, finished or not; write its tables and, last, ``result.json``.

    Parameters
    ----------
    directory
        The run directory.

    Raises
    ------
    walkers.postprocess.measure.dump.DumpError
        If a dump cannot be read.
    walkers.runner.manifest.FileChanged
        If a dump has changed.
    """
    check_unchanged(directory, files_of_segments(directory))
    motion = read_motion(directory)
    case = motion.case
    numbers = derived(case)
    numbers["goes_uphill"] = case.goes_uphill
    numbers["truncated"] = motion.truncated
    tables: dict[str, Columns] = {}
    versions: dict[str, int] = {}
    # Only decks that were run by hand have notes; they have a single segment.
    segment = read_json(segment_directories(directory)[-1] / SEGMENT_NAME)
    notes = segment.get("by_hand") or []
    warnings = list(notes)
    for module in modules_of(case):
        measurement = module.measure(motion)
        tables |= measurement.tables
        numbers |= measurement.numbers
        warnings += measurement.warnings
        versions[module.NAME] = module.VERSION
    warnings += _general_warnings(motion)
    contents = {
        "version": VERSION,
        "modules": versions,
        "case": case.name,
        "drive": conditions(case, in_given_unit=False),
        "rests_on": uncertain_values(case.origins),
        "by_hand": notes,
        "deck_edited": segment.get("deck_edited", False),
        "tables": list(tables),
        "numbers": json_numbers(numbers),
        "warnings": warnings,
    }
    files = [f"{name}.parquet" for name in tables]
    files.append(RESULT_NAME)
    with recomputed(directory, files):  # also notes their new checksums
        for name, columns in tables.items():
            write_table(directory, name, columns)
        write_json(directory / RESULT_NAME, contents)


def _general_warnings(motion: Motion) -> list[str]:
    """Reasons to doubt a result that do not depend on what is measured."""
    case = motion.case
    warnings = []
    exceeded_limits = limits_of(case).exceeded_by(case.run.time_step)
    if exceeded_limits:
        warnings.append(
            "the time step is beyond a limit of stability "
            f"({', '.join(exceeded_limits)}): the results are wrong"
        )
    softness = softness_warning(case)
    if softness is not None:
        warnings.append(softness)
    warnings += implausible(case)
    if motion.truncated:
        warnings.append("the dump ends within a frame")
    return warnings


def read_results(directory: str | Path, origins: Sequence[Origin] | None = None) -> Results:
    """Read the result of a run, with the bands of a spread beside it and its numerical errors.

    Nothing is written.

    Parameters
    ----------
    directory
        The run directory.
    origins
        Sources of the values of the case, if they are not those of the case that made the run.

    Raises
    ------
    InputError
        If the result is missing, damaged or of another version.
    """
    directory = Path(directory)
    about = recorded(directory)
    numbers = about.pop("numbers")
    warnings = list(about.pop("warnings"))
    if origins is not None:
        about["rests_on"] = uncertain_values(origins)
    numbers |= bands_of(directory, about["rests_on"], numbers)
    accuracy = accuracy_of(directory)
    for name, error in accuracy.get("errors", {}).items():
        numbers[f"{name}_error"] = error["total"]
    main_error = f"{headline(numbers)}_error"
    if main_error in numbers:
        numbers["numerical_error"] = numbers[main_error]
    if not accuracy.get("reached", True):
        change = percent(float(f"{accuracy['change']:.2g}"))
        warnings.append(
            f"the numerical error is not converged: the hardest beads still change {change}"
        )
    if accuracy.get("times") == 1.0:
        warnings.append(
            "the beads cannot be harder: the numerical error is that of the time step alone"
        )
    return Results(directory, numbers, warnings, about)


def recorded(directory: Path) -> dict[str, Any]:
    """Read ``result.json`` of a run, without bands and numerical errors.

    Parameters
    ----------
    directory
        The run directory.

    Returns
    -------
    dict
        The numbers as ``numbers``, NaN if one is not defined, and the other entries of the file
        except the versions of the measuring modules.

    Raises
    ------
    InputError
        If the file is missing, cannot be read or is outdated.
    """
    again = f"walkers run {directory} measures it again"
    try:
        contents = read_json(directory / RESULT_NAME)
        version = contents.pop("version")
        versions_of_modules = contents.pop("modules", None)
        if versions_of_modules is not None:
            versions_of_modules = dict(versions_of_modules)  # raises an error for a damaged entry
        _check_names(contents, _ENTRIES)
        numbers = {}
        for name, number in contents["numbers"].items():
            numbers[name] = nan if number is None else number
        contents["numbers"] = numbers
        if version == VERSION:  # what readers of results ask for in any case
            _check_names(numbers, ["goes_uphill"])
            if "velocity" in numbers:
                _check_names(numbers, ["facings_differ"])
    except FileNotFoundError as error:
        raise input_error(directory, f"has no {RESULT_NAME}; {again}") from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise input_error(
            directory, f"its {RESULT_NAME} cannot be read ({error}); {again}"
        ) from error
    contents.setdefault("deck_edited", False)  # earlier results lack it
    try:
        outdated = version != VERSION or _is_outdated(directory, versions_of_modules)
    except (OSError, ValueError) as error:
        raise input_error(directory, f"its case cannot be read ({error})") from error
    if outdated:
        raise input_error(directory, f"was measured by another version of the program; {again}")
    return contents


def _check_names(entries: Mapping[str, Any], names: Iterable[str]) -> None:
    """Raise `KeyError` for the first name that is missing; every reader needs these entries."""
    for name in names:
        if name not in entries:
            raise KeyError(name)


def _is_outdated(directory: Path, versions: Mapping[str, Any] | None) -> bool:
    """Tell whether a module that measured a result has another version now.

    Results without ``versions`` were written before modules had versions of their own. They count
    as measured by modules of the version `_BEFORE_MODULES`; which ones follows from the case.
    """
    if versions is None:
        changed = [module for module in MODULES if module.VERSION != _BEFORE_MODULES]
        if not changed:
            return False
        case = case_of(directory)
        return any(module.applies(case) for module in changed)
    current_versions = {module.NAME: module.VERSION for module in MODULES}
    return any(current_versions.get(name) != version for name, version in versions.items())


def ensure_measured(directory: Path) -> None:
    """Measure a finished run again if a file of its result is missing, damaged or outdated.

    Parameters
    ----------
    directory
        The run directory. A file of its result that was edited counts as damaged; `measure` raises
        the errors.
    """
    try:
        names = [RESULT_NAME]
        names += [f"{name}.parquet" for name in recorded(directory)["tables"]]
        if check_unchanged(directory, names):
            return
    except (InputError, OSError, ValueError):
        pass  # `measure` says what is wrong, if it cannot mend it
    measure(directory)


def json_numbers(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Convert numbers to JSON types: None for those that are not finite."""
    return {name: _json_number(number) for name, number in numbers.items()}


def _json_number(number: Any) -> Any:
    """A number as JSON type."""
    python_number = number.item() if hasattr(number, "item") else number
    if isinstance(python_number, float) and not isfinite(python_number):
        return None
    return python_number


def text(results: Results, *, cached: bool = False, verbose: bool = False) -> str:
    """Write a result as lines for a terminal, the most important first.

    Parameters
    ----------
    results
        The result.
    cached
        Whether the run had been made before, which the first line then says.
    verbose
        Whether to write all numbers, and all values that have not been measured.

    Returns
    -------
    str
        The main number with its band and numerical error, or that these are not computed; what the
        beads do; warnings; the drive; the most important numbers; guessed values; the directory.
    """
    lines = _main_lines(results, cached=cached)
    missing = not_computed(results)
    if missing:
        lines += wrapped(f"  uncertainty not computed: {missing.text}", _INDENT)
    motion = motion_in_words(results)
    if motion:
        lines += wrapped(f"  {motion}", "  ")
    for warning in results.warnings:
        lines += wrapped_after("  warning:", f" {warning}", WARNING, _INDENT)
    lines += wrapped(f"  drive      {drive_text(results)}", " " * _HEAD_WIDTH)
    lines += _lines_of_numbers(rows(results) if verbose else important_rows(results))
    values = results.about["rests_on"]
    if not verbose:
        values = [value for value in values if value["guessed"]]
    lines += uncertain_value_lines(values, text_width())
    if has_band(results):
        lines += wrapped(f"  band       {BAND_NOTE}", " " * _HEAD_WIDTH)
    lines.append(f"  run        {results.directory}")
    if not verbose:
        lines.append(styled("             all numbers: -v, or walkers report", ASIDE))
    return "\n".join(lines)


def main_parts(results: Results) -> list[str]:
    """The main number of a result or its state, and the errors of this number if there are any.

    Such as ``velocity 1.981 mm/s``, and ``5 to 95 %: 1.2 to 2.4 mm/s``.
    """
    heading = short_text(results)
    if heading == "-":  # neither walkers nor a pile
        heading = counted(results.get("beads", 0), "bead")
    if headline(results) == "velocity" and not state(results):
        heading = f"velocity {heading}"
    if heading == AT_REST:  # beside numbers that are small, but not zero
        limit, unit = text_and_unit(REST, "m/s")
        heading += f" (below {limit} {unit})"
    errors = main_errors(results)
    return [heading, errors] if errors else [heading]


def _main_lines(results: Results, *, cached: bool) -> list[str]:
    """The case with its main number or state and the errors, in the style of a heading."""
    parts = main_parts(results)
    line = f"{results.about['case']}: {', '.join(parts)}"
    if cached and not results.about["by_hand"]:  # it was never made by a command
        line += " (already run)"
    return [styled(part, HEADING) for part in wrapped(line, _INDENT)]


def _lines_of_numbers(listed: Sequence[Row]) -> list[str]:
    """Numbers as lines with aligned labels, values, units and errors.

    Errors that do not fit into the line stand in the next one.
    """
    label_width = 0
    value_width = 0
    unit_width = 0
    for row in listed:
        label_width = max(label_width, len(row.label))
        value_width = max(value_width, len(row.text))
        unit_width = max(unit_width, len(row.unit))
    lines = []
    for row in listed:
        value = f"{row.text:>{value_width}} {row.unit:{unit_width}}"
        line = f"  {row.label:{label_width}}  {value}"
        if len(line) + 2 + len(row.error) <= text_width():
            lines.append(f"{line}  {row.error}".rstrip())
            continue
        lines.append(line.rstrip())
        lines += wrapped(f"{_INDENT}  {row.error}", f"{_INDENT}  ")
    return lines


@dataclass(frozen=True)
class NotComputed:
    """Uncertainties of a result that nobody has computed; false if there are none.

    Attributes
    ----------
    uncertain_values
        Number of uncertain values over whose ranges there is no band; 0 if there is a band.
    numerical_error
        Whether the numerical error is missing.
    """

    uncertain_values: int = 0
    numerical_error: bool = False

    def __bool__(self) -> bool:
        return self.uncertain_values > 0 or self.numerical_error

    @property
    def text(self) -> str:
        """What is missing, each with the option that computes it."""
        parts = []
        if self.uncertain_values:
            parts.append(f"{counted(self.uncertain_values, 'uncertain value')} (--spread)")
        if self.numerical_error:
            parts.append("numerical error (--accuracy)")
        return ", ".join(parts)


def not_computed(results: Results) -> NotComputed:
    """Find the uncertainties of the main number of a result that have not been computed."""
    main = headline(results)
    if not main or results.get("came_apart"):
        return NotComputed()
    uncertain = 0
    if f"{main}_low" not in results:
        uncertain = len([value for value in results.about["rests_on"] if value["range"]])
    # A threshold has a resolution instead of a numerical error.
    has_error = "numerical_error" in results or "stops_at" in results
    return NotComputed(uncertain, "velocity" in results and not has_error)


BAND_NOTE = (
    "5 to 95 % over the ranges of uncertain values only; the error of the model is not in it"
)
"""What a band is, below a result and in reports."""


def has_band(results: Mapping[str, Any]) -> bool:
    """Tell whether a main number of a result has a band."""
    return any(f"{name}_low" in results for name in MAIN_NUMBERS)


def headlines(results: Results) -> list[str]:
    """The case, its drive, and the state of its walkers."""
    case = results.about["case"]
    drive = drive_text(results)
    state_of_walkers = state(results)
    if state_of_walkers:
        return [f"{case}: {state_of_walkers}", drive]
    return [f"{case}: {drive}"]


def drive_text(results: Results) -> str:
    """The drive of a result as its case gives it, with Γ0 and sin δ of dimers."""
    try:
        drive = conditions(case_of(results.directory))
    except (OSError, ValueError, KeyError, TypeError):  # the case cannot be read
        drive = results.about["drive"]
    gamma0 = results.get("gamma0", nan)
    sin_delta = results.get("sin_delta", nan)
    if isfinite(gamma0) and isfinite(sin_delta):
        drive += f", Γ0 = {gamma0:.3g}, sin δ = {sin_delta:.3g}"
    return drive
