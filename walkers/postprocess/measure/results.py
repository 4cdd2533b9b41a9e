"""Results of runs: measured and written once, read by all.

A result is flat: a number of each name of `walkers.postprocess.measure.quantities.GROUPS`. The modules
of `MODULES` that apply to a case measure its runs. ``result.json`` contains their versions: it is
outdated if one of these modules, or what all results have in common, has another version now. Runs
without dumps, such as those of a spread, cannot be measured again, and a change of a module that did
not measure them must not cost them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.errors import InputError, input_error
from walkers.files import read_json, write_json
from walkers.inputs.resolving.length import limits_of
from walkers.inputs.resolving.loads import gravity_warnings, softness_warning
from walkers.postprocess.measure import meetings, piles, record_part, threshold, walking
from walkers.postprocess.measure.caption import conditions
from walkers.postprocess.measure.measuring_module import MeasuringModule
from walkers.postprocess.measure.motion import read_motion
from walkers.postprocess.measure.numbers import MAIN_NUMBERS, headline, rows, state
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

if TYPE_CHECKING:
    import pandas as pd

    from walkers.inputs.origins import Origin
    from walkers.inputs.tables.case import Case

VERSION = 2
"""Version of what all results have in common: the format of ``result.json`` and the numbers, tables and warnings that
no module gives. Results of another version are measured again, whatever modules measured them.
"""
MODULES: tuple[MeasuringModule, ...] = (walking, threshold, meetings, piles, record_part)
"""The modules that measure runs, in the order of their numbers in results."""
_BEFORE_MODULES = 2
"""Version of all modules in results that do not contain versions of modules."""
_BESIDE = ("case", "drive", "rests_on", "by_hand", "tables", "warnings")
"""Entries of ``result.json`` beside the numbers."""
_DRIVE = ("frequency", "peak_acceleration", "peak_velocity", "amplitude")


class Results(dict[str, Any]):
    """The result of a run: numbers in SI units by name; NaN if one is not defined.

    With both ends of bands (``velocity_low``, ``velocity_high``) and numerical errors if these exist.

    Attributes
    ----------
    directory
        The run directory.
    warnings
        Reasons to doubt the numbers.
    about
        ``case``, ``drive``, ``rests_on`` (`walkers.postprocess.measure.uncertainty.uncertain_values`),
        ``by_hand`` (notes on a deck that was run by hand), ``deck_edited`` (whether its parameters or
        commands are not those of the program), ``tables`` (their names).
    """

    def __init__(
        self,
        directory: Path,
        numbers: Mapping[str, Any],
        warnings: Sequence[str],
        about: Mapping[str, Any],
    ) -> None:
        super().__init__(numbers)
        self.directory, self.warnings, self.about = directory, warnings, about

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
    """Numbers of a result that follow from the case alone."""
    numbers = {name: getattr(case.excitation, name) for name in _DRIVE}
    for module in modules_of(case):
        numbers |= module.derived(case)
    return numbers


def measure(directory: Path) -> None:
    """Measure a run, finished or not; write its tables and, last, ``result.json``.

    `walkers.postprocess.measure.dump.DumpError` if a dump cannot be read,
    `walkers.runner.manifest.FileChanged` if it changed.
    """
    check_unchanged(directory, files_of_segments(directory))
    motion = read_motion(directory)
    case = motion.case
    modules = modules_of(case)
    parts = [module.measure(motion) for module in modules]
    tables = {name: columns for part in parts for name, columns in part.tables.items()}
    numbers = derived(case) | {"goes_uphill": case.goes_uphill, "truncated": motion.truncated}
    for part in parts:
        numbers |= part.numbers
    segment = read_json(segment_directories(directory)[-1] / SEGMENT_NAME)
    notes = segment.get("by_hand") or []
    warnings = [*notes, *(warning for part in parts for warning in part.warnings)]
    if names := limits_of(case).exceeded_by(case.run.time_step):
        warnings.append(
            f"the time step is beyond a limit of stability ({', '.join(names)}): the results are wrong"
        )
    if (softness := softness_warning(case)) is not None:
        warnings.append(softness)
    warnings += gravity_warnings(case)
    if motion.truncated:
        warnings.append("the dump ends within a frame")
    contents = {
        "version": VERSION,
        "modules": {module.NAME: module.VERSION for module in modules},
        "case": case.name,
        "drive": conditions(case),
        "rests_on": uncertain_values(case.origins),
        "by_hand": notes,
        "deck_edited": segment.get("deck_edited", False),
        "tables": list(tables),
        "numbers": json_numbers(numbers),
        "warnings": warnings,
    }
    with recomputed(directory, [*(f"{name}.parquet" for name in tables), RESULT_NAME]):
        for name, columns in tables.items():
            write_table(directory, name, columns)
        write_json(directory / RESULT_NAME, contents)


def read_results(directory: str | Path, origins: Sequence[Origin] | None = None) -> Results:
    """The result of a run, with the bands of a spread beside it and its numerical errors; nothing is written.

    ``origins`` are the sources of the values of the case, if they are not those of the case that made the run.
    `InputError` if the result is missing, damaged or of another version.
    """
    directory = Path(directory)
    about = recorded(directory)
    numbers, warnings = about.pop("numbers"), about.pop("warnings")
    if origins is not None:
        about["rests_on"] = uncertain_values(origins)
    numbers |= bands_of(directory, about["rests_on"], numbers)
    accuracy = accuracy_of(directory)
    numbers |= {
        f"{name}_error": error["total"] for name, error in accuracy.get("errors", {}).items()
    }
    if (main := f"{headline(numbers)}_error") in numbers:
        numbers["numerical_error"] = numbers[main]
    if not accuracy.get("reached", True):
        change = percent(float(f"{accuracy['change']:.2g}"))
        warnings = [
            *warnings,
            f"the numerical error is not converged: the hardest beads still change {change}",
        ]
    if accuracy.get("times") == 1.0:
        warnings = [
            *warnings,
            "the beads cannot be harder: the numerical error is that of the time step alone",
        ]
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
        The numbers as ``numbers``, NaN if one is not defined, and the entries beside them.

    Raises
    ------
    InputError
        If the file is missing, cannot be read or is outdated.
    """
    again = f"walkers run {directory} measures it again"
    try:
        contents = read_json(directory / RESULT_NAME)
        version = contents.pop("version")
        versions = contents.pop("modules", None)
        if versions is not None:
            versions = dict(versions)
        _ = [contents[name] for name in _BESIDE]
        numbers = {
            name: nan if number is None else number for name, number in contents["numbers"].items()
        }
        if version == VERSION:  # every reader needs these numbers
            _ = numbers["goes_uphill"], "velocity" in numbers and numbers["facings_differ"]
        contents["numbers"] = numbers
    except FileNotFoundError as error:
        raise input_error(directory, f"has no {RESULT_NAME}; {again}") from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise input_error(
            directory, f"its {RESULT_NAME} cannot be read ({error}); {again}"
        ) from error
    contents.setdefault("deck_edited", False)  # earlier results lack it
    try:
        outdated = version != VERSION or _is_outdated(directory, versions)
    except (OSError, ValueError) as error:
        raise input_error(directory, f"its case cannot be read ({error})") from error
    if outdated:
        raise input_error(directory, f"was measured by another version of the program; {again}")
    return contents


def _is_outdated(directory: Path, versions: Mapping[str, Any] | None) -> bool:
    """Tell whether a module that measured a result has another version now.

    Results without ``versions`` were written before modules had any. Versions of modules began at
    the version of these results; which modules measured them follows from the case.
    """
    if versions is None:
        changed = [module for module in MODULES if module.VERSION != _BEFORE_MODULES]
        return bool(changed) and any(module.applies(case_of(directory)) for module in changed)
    present = {module.NAME: module.VERSION for module in MODULES}
    return any(present.get(name) != version for name, version in versions.items())


def ensure_measured(directory: Path) -> None:
    """Measure (`measure`) a finished run again if a file of its result is missing, damaged, edited or outdated."""
    try:
        names = [RESULT_NAME, *(f"{name}.parquet" for name in recorded(directory)["tables"])]
        if check_unchanged(directory, names):
            return
    except (InputError, OSError, ValueError):
        pass
    measure(directory)


def json_numbers(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers as JSON types: None for those that are not finite."""
    json_numbers = {
        name: number.item() if hasattr(number, "item") else number
        for name, number in numbers.items()
    }
    return {
        name: None if isinstance(value, float) and not isfinite(value) else value
        for name, value in json_numbers.items()
    }


def text(results: Results, *, cached: bool = False) -> str:
    """A result in lines: state or drive, what is not computed, numbers, warnings, origins of values, directory."""
    first, *rest = headlines(results)
    if cached and not results.about["by_hand"]:  # it was never made by a command
        first += " (already run)"
    table = [(row.label, row.text, row.unit, row.error) for row in rows(results)]
    label, value, unit = (max((len(row[place]) for row in table), default=0) for place in range(3))
    missing = []
    if lacks := not_computed(results):
        missing.append(f"  uncertainty not computed: {lacks.text}")
    banded = []
    if has_band(results):
        banded.append(f"  band       {BAND_NOTE}")
    return "\n".join(
        [
            first,
            *(f"  {line}" for line in rest),
            *missing,
            *(
                f"  {row[0]:{label}}  {row[1]:>{value}} {row[2]:{unit}}  {row[3]}".rstrip()
                for row in table
            ),
            *(f"  warning: {warning}" for warning in results.warnings),
            *uncertain_value_lines(results.about["rests_on"]),
            *banded,
            f"  run        {results.directory}",
        ]
    )


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
    """The uncertainties of the main number of a result that have not been computed."""
    main = headline(results)
    if not main or results.get("came_apart"):
        return NotComputed()
    values = 0
    if f"{main}_low" not in results:
        values = sum(1 for entry in results.about["rests_on"] if entry["range"])
    has_error = not {"numerical_error", "stops_at"}.isdisjoint(results)
    return NotComputed(values, "velocity" in results and not has_error)


BAND_NOTE = (
    "5 to 95 % over the ranges of uncertain values only; the error of the model is not in it"
)
"""What a band is, below a result and in reports."""


def has_band(results: Mapping[str, Any]) -> bool:
    """Whether a main number of a result has a band."""
    return any(f"{name}_low" in results for name in MAIN_NUMBERS)


def headlines(results: Results) -> list[str]:
    """The case, its drive, and the state of its walkers."""
    drive = results.about["drive"]
    if all(isfinite(results.get(name, nan)) for name in ("gamma0", "sin_delta")):
        drive += f", Γ0 = {results['gamma0']:.3g}, sin δ = {results['sin_delta']:.3g}"
    if does := state(results):
        return [f"{results.about['case']}: {does}", drive]
    return [f"{results.about['case']}: {drive}"]
