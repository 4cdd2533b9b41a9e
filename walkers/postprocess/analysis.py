"""Analyses of runs. Each analysis states the cases to which it applies.

An analysis is a class in a module of `walkers.postprocess.analyses`. Tables, results, texts, reports and figures of
runs and columns of sweeps follow from what it declares.
"""

from __future__ import annotations

import errno
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from math import nan
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, ClassVar

from walkers.inputs.case import Case
from walkers.inputs.run import limits_of
from walkers.postprocess.caption import conditions
from walkers.postprocess.uncertainty import bands_text, lines_of_rest, not_known, rests_on, with_bands, wrapped_line
from walkers.rounding import SHOWN_UNITS, rounded
from walkers.runner.directory import SEGMENT_NAME, case_of, files_of_segments, segment_directories
from walkers.runner.files import read_json, write_json
from walkers.runner.manifest import MANIFEST_NAME, RESULT_NAME, FileChanged, check_unchanged, read_result, recomputed

if TYPE_CHECKING:  # the progress of a sweep needs no numpy
    from walkers.postprocess.motion import Bridges, Motion
    from walkers.postprocess.tables import Columns

Described = Mapping[str, tuple[str, str]]
"""Units and meanings of columns, by name."""


@dataclass(frozen=True)
class Quantity:
    """A number of a result. Rows of reports and columns of tables of sweeps follow from it.

    Attributes
    ----------
    path
        Dotted key of the number, such as ``surface.end``; that of a mean over copies also leads to scatter, smallest
        and largest.
    label
        Label of the row in reports; empty for none.
    unit
        SI unit; ``share`` for a number that is shown in per cent.
    column, meaning, of
        Column in the table of a sweep, empty for none; function that gives its value if this is not at the path.
    """

    path: str
    label: str = ""
    unit: str = ""
    column: str = ""
    meaning: str = ""
    of: Callable[[Mapping[str, Any]], Any] | None = None

    def value(self, result: Mapping[str, Any]) -> Any:
        """Value in the table of a sweep; NaN if the result has none."""
        if self.of is not None:
            return self.of(result)
        value: Any = result
        for part in self.path.split("."):
            value = None if value is None else value[part]
        value = value["mean"] if isinstance(value, dict) else value
        return nan if value is None else value

    def row(self, result: Mapping[str, Any]) -> Row:
        """Row of a report."""
        keys = [self.path]
        if number_of(result, f"{self.path}.n") is not None:
            keys = [f"{self.path}.{what}" for what in ("mean", "scatter", "smallest", "largest")]
        return Row(self.label, *(number_of(result, key, self.unit) for key in keys))


@dataclass(frozen=True)
class Number:
    """A number (SI) at a dotted key of a result, such as ``velocity.mean``; the displayed unit and its factor."""

    key: str
    value: float
    unit: str = ""
    factor: float = 1.0

    @property
    def text(self) -> str:
        """The number in the displayed unit, without the unit."""
        return rounded(self.value * self.factor, self.unit)


@dataclass(frozen=True)
class Row:
    """Label and number; for several copies also scatter (standard deviation), smallest and largest."""

    name: str
    value: Number | None
    scatter: Number | None = None
    smallest: Number | None = None
    largest: Number | None = None

    @property
    def unit(self) -> str:
        """Displayed unit of all numbers."""
        return next((one.unit for one in (self.value, self.smallest) if one is not None), "")

    @property
    def text(self) -> str:
        """The number and its unit."""
        return f"{'' if self.value is None else self.value.text} {self.unit}".rstrip()


def number_of(result: Mapping[str, Any], key: str, unit: str = "") -> Number | None:
    """The number at a dotted key of a result; None if it is missing."""
    value: Any = result
    for part in key.split("."):
        value = value[int(part)] if isinstance(value, list) else value.get(part) if isinstance(value, dict) else None
        if value is None:
            return None
    shown, factor = SHOWN_UNITS.get(unit, (unit, 1.0))
    return Number(key, value, shown, 1 if factor == 1.0 else factor)  # a whole number stays one


class Analysis(ABC):
    """An analysis of runs.

    Attributes
    ----------
    order
        Place in results, the smallest first; the first line of the first analysis is the headline.
    version
        Version of the method; results of other versions are recomputed.
    tables
        Names of the tables that the analysis writes; `walkers.postprocess.quantities` has their columns.
    derived, headlines
        Columns of a sweep's table that follow from the case; the main columns among `columns`.
    """

    order: ClassVar[int] = 9
    name: ClassVar[str]
    version: ClassVar[int] = 1
    tables: ClassVar[tuple[str, ...]]
    derived: ClassVar[Described] = {}
    headlines: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def applies(self, case: Case) -> bool:
        """Whether the analysis applies to a case."""

    @abstractmethod
    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Measure a motion: tables by name, and its part of the result (SI units).

        Raises
        ------
        postprocess.dump.DumpError
            If a dump of bridges cannot be read, or is too short.
        """

    @abstractmethod
    def quantities(self, result: Mapping[str, Any]) -> Iterable[Quantity]:
        """Quantities in the order of reports; for an empty result, all quantities with a column."""

    def lines(self, result: Mapping[str, Any]) -> list[str]:
        """The result as text; by default the numbers of reports in mm, mm/s, degrees."""
        rows = (one.row(result) for one in self.quantities(result) if one.label)
        parts = [f"{one.name} {one.text}" for one in rows if one.value is not None]
        return [f"  {self.name:10} {'; '.join(parts).removeprefix(f'{self.name} ') or '-'}"]

    def uncertainty(self, result: Mapping[str, Any]) -> list[str]:
        """Uncertainty of the main numbers in sentences; default: the band of a spread, or the uncertain parameters."""
        if not self.headlines:
            return []
        units = {name: self.columns[name][0] for name in self.headlines}
        sentence = bands_text(result, units, self.row(result))
        return [sentence] if sentence else not_known(result["rests_on"])

    @property
    def columns(self) -> Described:
        """Columns of the table of a sweep that come from the result of a run."""
        units = {"share": ""}
        return {one.column: (units.get(one.unit, one.unit), one.meaning) for one in self.quantities({}) if one.column}

    def row(self, result: Mapping[str, Any]) -> dict[str, Any]:
        """Values of `columns` of a result; NaN for missing ones."""
        return {one.column: one.value(result) for one in self.quantities({}) if one.column}

    def derived_of(self, case: Case) -> dict[str, float]:
        """The columns `derived` of a case."""
        del case
        return {}

    def warnings(self, result: Mapping[str, Any]) -> list[str]:
        """Warnings about the result."""
        del result
        return []

    def point_data(self, motion: Motion) -> Callable[[Bridges], Columns]:
        """A function that returns further arrays of the beads in a frame for ParaView; None if there are none."""
        del motion
        return lambda _: {}


@cache
def analyses() -> tuple[Analysis, ...]:
    """All analyses, in the order of results."""
    from walkers.postprocess.analyses import __name__ as package
    from walkers.postprocess.analyses import __path__ as place

    for module in iter_modules(place):
        import_module(f"{package}.{module.name}")
    return tuple(kind() for kind in sorted(Analysis.__subclasses__(), key=lambda kind: (kind.order, kind.name)))


def analyses_of(case: Case) -> list[Analysis]:
    """Analyses that apply to a case."""
    return [one for one in analyses() if one.applies(case)]


def analyses_in(result: Mapping[str, Any]) -> list[Analysis]:
    """Analyses that a result contains."""
    return [one for one in analyses() if one.name in result["analyses"]]


def tabulate(directory: str | Path) -> dict[str, Any]:
    """Write the tables and ``result.json`` of a run directory, finished or not, and return the result (SI units).

    Raises
    ------
    postprocess.dump.DumpError
        If a dump cannot be read.
    runner.manifest.FileChanged
        If a file of a finished run is not what it was.
    """
    directory = Path(directory)
    result, tables = _measured(directory)
    _write(directory, result, tables)
    return result


def _measured(directory: Path) -> tuple[dict[str, Any], dict[str, Columns]]:
    """Result and tables of a run directory, from its dumps."""
    from walkers.postprocess.motion import read_motion

    check_unchanged(directory, files_of_segments(directory))
    motion = read_motion(directory)
    case = motion.case
    result: dict[str, Any] = {
        "case": case.name,
        "units": "SI: m, s, m/s, rad",
        "analyses": {one.name: one.version for one in analyses_of(case)},
        "frequency": case.excitation.frequency,
        "peak_acceleration": case.excitation.peak_acceleration,
        "drive": conditions(case),
        "goes_uphill": case.goes_uphill,
        "truncated": motion.truncated,
        "rests_on": rests_on(case.origins),
    }
    if beyond := limits_of(case).exceeded_by(case.run.time_step):
        result["beyond_limits"] = beyond
    if notes := read_json(segment_directories(directory)[-1] / SEGMENT_NAME).get("by_hand"):
        result["by_hand"] = notes
    tables: dict[str, Columns] = {}
    for one in analyses_of(case):
        found, summary = one.of(motion)
        tables |= found
        result |= summary
    return result, tables


def _write(directory: Path, result: Mapping[str, Any], tables: Mapping[str, Columns]) -> None:
    from walkers.postprocess.tables import write_table

    names = [RESULT_NAME, *(f"{name}.parquet" for name in tables)]
    with recomputed(directory, names):
        for name, columns in tables.items():
            write_table(directory, name, columns)
        write_json(directory / RESULT_NAME, result)


def tables_of(directory: Path) -> dict[str, Columns]:
    """Tables of a run from its files; for an unfinished run, computed from its dumps.

    Its errors are those of `current_result`.
    """
    from walkers.postprocess.tables import intact, read_columns

    names = [name for one in analyses_of(case_of(directory)) for name in one.tables]
    if (directory / MANIFEST_NAME).exists():
        current_result(directory)
        if intact(directory, names):
            return {name: read_columns(directory, name) for name in names}
    return _measured(directory)[1]


def current_result(directory: str | Path) -> dict[str, Any]:
    """The result of a finished run; recomputed if files are missing, damaged or of an earlier version of an analysis.

    Damaged files give a warning. In a read-only directory nothing is written. Without dumps, a result of an earlier
    version is returned if it has all current quantities.

    Raises
    ------
    postprocess.dump.DumpError, OSError, ValueError
        If the result cannot be recomputed.
    runner.manifest.FileChanged
        If the result was edited.
    """
    from walkers.postprocess.tables import intact

    directory = Path(directory)
    wanted = analyses_of(case_of(directory))
    names = [name for one in wanted for name in one.tables]
    result: dict[str, Any] | None = None
    damaged = not intact(directory, [name for name in names if (directory / f"{name}.parquet").is_file()])
    try:
        result = {"rests_on": [], **read_result(directory)}  # none in old runs
        is_current = result.get("analyses") == {one.name: one.version for one in wanted}
        if is_current and intact(directory, names) and check_unchanged(directory, [RESULT_NAME]):
            return result
    except FileChanged:
        raise
    except (OSError, ValueError) as error:
        damaged |= isinstance(error, ValueError)
    if result and not any(name.endswith(".bin") for name in files_of_segments(directory)) and _has_all(result, wanted):
        return result
    if damaged:
        text = "the result or a table is incomplete or damaged; it is recomputed from the dumps"
        warnings.warn(f"{directory}: {text}", stacklevel=2)
    result, tables = _measured(directory)
    try:
        _write(directory, result, tables)
    except OSError as error:
        if error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise
    return result


def _has_all(result: Mapping[str, Any], wanted: Sequence[Analysis]) -> bool:
    """Whether a result of earlier versions contains all that analyses show."""
    try:
        lines_of_rest(result["rests_on"])
        for analysis in (present := analyses_in(result)):
            analysis.row(result)
            analysis.lines(result)
    except (KeyError, TypeError, ValueError):
        return False
    return bool(present) == bool(wanted)


def describe_result(directory: Path, result: Mapping[str, Any], *, cached: bool = False) -> str:
    """The result of a run (as `tabulate` returns it) in a few lines: mm, mm/s, degrees.

    ``cached`` results are marked as already run.
    """
    result = with_bands(directory, result)
    lines = [line for one in analyses_in(result) for line in one.lines(result)]
    lines = lines or [f"{result['case']}: {result['drive']}"]
    if cached and not result.get("by_hand"):  # it was never made by a command
        lines[0] += " (already run)"
    warnings = [f"  warning: {warning}" for warning in warnings_of(result)]
    return "\n".join(
        [*map(wrapped_line, lines), *lines_of_rest(result["rests_on"]), *warnings, f"  run        {directory}"]
    )


def warnings_of(result: Mapping[str, Any]) -> list[str]:
    """Warnings about a result."""
    warnings = [
        *result.get("by_hand", ()),
        *(warning for one in analyses_in(result) for warning in one.warnings(result)),
    ]
    if names := result.get("beyond_limits"):
        warnings.append(f"the time step is beyond a limit of stability ({', '.join(names)}): the results are wrong")
    return [*warnings, "the dump ends within a frame"] if result["truncated"] else warnings


def uncertainty_of(result: Mapping[str, Any]) -> list[str]:
    """Uncertainty of the main numbers of a result, in sentences."""
    return [sentence for one in analyses_in(result) for sentence in one.uncertainty(result)]


def quantities_of(result: Mapping[str, Any]) -> list[Row]:
    """The numbers of a result as rows of a table."""
    rows = (one.row(result) for found in analyses_in(result) for one in found.quantities(result) if one.label)
    return [row for row in rows if row.value is not None]
