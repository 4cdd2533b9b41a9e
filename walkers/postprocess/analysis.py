"""What is measured of a run, and by what: a list of analyses, each of which says for which cases it means something.

To add one, write a class like `walkers.postprocess.walking.Walking` and name it in `analyses`. What runs have of
tables, results, text and figures, and sweeps of columns, follows.
"""

from __future__ import annotations

import errno
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

from walkers.inputs.case import Case
from walkers.inputs.library import unmeasured
from walkers.inputs.origins import Origin
from walkers.postprocess.drawing import check_formats, save_figure
from walkers.runner.directory import SEGMENTS, case_of
from walkers.runner.files import read_json, write_json
from walkers.runner.manifest import FileChanged, check_unchanged, forget_tables, record_tables

if TYPE_CHECKING:  # how far a sweep is can be told without numpy
    import numpy.typing as npt
    from matplotlib.figure import Figure

    from walkers.postprocess.motion import Bridges, Motion
    from walkers.postprocess.quantities import Quantity

RESULT_NAME = "result.json"
_WIDTH = 110
Columns: TypeAlias = "dict[str, npt.NDArray[Any]]"
Described = Mapping[str, tuple[str, str]]
"""From the names of columns to their units and meanings."""


class Analysis(ABC):
    """Something that is measured of runs.

    Attributes
    ----------
    name
        Of the analysis.
    version
        Of its method: results of another one are made anew.
    tables
        Names of the tables that it writes.
    derived, columns
        Columns of a sweep's table: what follows from a point's case, and what its run gives.
    places
        Where the result has those of `columns` that it has not by their names, such as ``velocity.mean``.
    headlines
        Those of `columns` that count first.
    rows
        Of the table of a result: what `walkers.postprocess.quantities.quantity` takes after the result.
    """

    name: ClassVar[str]
    version: ClassVar[int]
    tables: ClassVar[tuple[str, ...]]
    derived: ClassVar[Described] = {}
    columns: ClassVar[Described] = {}
    places: ClassVar[Mapping[str, str]] = {}
    headlines: ClassVar[tuple[str, ...]] = ()
    rows: ClassVar[tuple[tuple[str, ...], ...]] = ()

    def can_show(self, result: Mapping[str, Any]) -> bool:
        """Whether a result has all that it gives."""
        try:
            self.row(result)
            self.lines(result)
        except (KeyError, TypeError, ValueError):
            return False
        return True

    @abstractmethod
    def applies(self, case: Case) -> bool:
        """Whether it means something for a case."""

    @abstractmethod
    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Measure a motion: tables by name, and its part of the result (SI units).

        Raises
        ------
        postprocess.dump.DumpError
            If a dump of bridges cannot be read, or is too short.
        """

    def derived_of(self, case: Case) -> dict[str, float]:
        """The columns `derived` of a case."""
        del case
        return {}

    def row(self, result: Mapping[str, Any]) -> dict[str, Any]:
        """The columns `columns` of a result; NaN for what it has not."""
        return {name: _at(result, self.places.get(name, name)) for name in self.columns}

    @abstractmethod
    def lines(self, result: Mapping[str, Any]) -> list[str]:
        """What it found, as text: mm, mm/s, degrees."""

    def rows_of(self, result: Mapping[str, Any]) -> Iterable[tuple[str, ...]]:
        """Its numbers as rows of a table, as `rows` are."""
        del result
        return self.rows

    def warnings(self, result: Mapping[str, Any]) -> list[str]:
        """What a reader of the result should know."""
        del result
        return []

    def point_data(self, motion: Motion) -> Callable[[Bridges], Columns]:
        """What gives, for a frame, further arrays of its beads for ParaView."""
        del motion
        return lambda _: {}

    def figures(self, directory: Path) -> Mapping[str, Figure]:
        """Its figures of a run, by the names of their files."""
        del directory
        return {}


def _at(result: Mapping[str, Any], place: str) -> Any:
    """What a result has at a place; NaN where it says that there is none."""
    value: Any = result
    for part in place.split("."):
        value = None if value is None else value[part]
    return nan if value is None else value


@cache
def analyses() -> tuple[Analysis, ...]:
    """All analyses."""
    from walkers.postprocess.meetings import Meetings
    from walkers.postprocess.piles import Pile
    from walkers.postprocess.walking import Walking

    return (Walking(), Meetings(), Pile())


def analyses_of(case: Case) -> list[Analysis]:
    """Those that mean something for a case."""
    return [one for one in analyses() if one.applies(case)]


def analyses_in(result: Mapping[str, Any]) -> list[Analysis]:
    """Those that a result is of."""
    return [one for one in analyses() if one.name in result["analyses"]]


def tabulate(directory: str | Path) -> dict[str, Any]:
    """Write the tables and ``result.json`` of a run directory.

    Parameters
    ----------
    directory
        A run directory with its segments, finished or not.

    Returns
    -------
    dict
        The result, as in ``result.json``: SI units.

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
    """The result of a run directory and its tables, from its dumps."""
    from walkers.postprocess.motion import read_motion

    files = (path.relative_to(directory) for path in (directory / SEGMENTS).rglob("*"))
    check_unchanged(directory, [path.as_posix() for path in files])
    motion = read_motion(directory)
    case = motion.case
    result: dict[str, Any] = {
        "case": case.name,
        "units": "SI: m, s, m/s, rad",
        "analyses": {one.name: one.version for one in analyses_of(case)},
        "frequency": case.drive.frequency,
        "peak_acceleration": case.drive.peak_acceleration,
        "drive": case.drive.described(),
        "goes_uphill": case.goes_uphill,
        "truncated": motion.truncated,
        "rests_on": rests_on(case.origins),
    }
    tables: dict[str, Columns] = {}
    for one in analyses_of(case):
        found, summary = one.of(motion)
        tables |= found
        result |= summary
    return result, tables


def _write(directory: Path, result: Mapping[str, Any], tables: Mapping[str, Columns]) -> None:
    from walkers.postprocess.tables import write_table

    names = [RESULT_NAME, *(f"{name}.parquet" for name in tables)]
    forget_tables(directory, names)
    for name, columns in tables.items():
        write_table(directory, name, columns)
    write_json(directory / RESULT_NAME, result)
    record_tables(directory, names)


def read_result(directory: str | Path) -> dict[str, Any]:
    """The result of a run, as `tabulate` wrote it.

    Raises
    ------
    OSError, ValueError
        If it cannot be read.
    runner.manifest.FileChanged
        If it is not what it was when the run was finished.
    """
    result = read_json(Path(directory) / RESULT_NAME)
    check_unchanged(Path(directory), [RESULT_NAME])
    return result


def current_result(directory: str | Path) -> dict[str, Any]:
    """The result of a finished run; tabulated anew if it or a table is gone or damaged, or of an earlier method.

    What cannot be written, as where all is read-only, is not. Without dumps a result of an earlier method stays what it
    is, if it has all that is told of one today.

    Raises
    ------
    postprocess.dump.DumpError, OSError, ValueError
        If it cannot be made anew.
    runner.manifest.FileChanged
        If it was edited.
    """
    from walkers.postprocess.tables import intact

    directory = Path(directory)
    kept: dict[str, Any] | None = None
    try:
        result = read_result(directory)
        wanted = analyses_of(case_of(directory))
        result.setdefault("rests_on", [])  # of runs that did not say it
        lines_of_rest(result["rests_on"])
        versions = {one.name: one.version for one in wanted}
        whole = intact(directory, [name for one in wanted for name in one.tables])
        if whole and result["analyses"].keys() == versions.keys() and all(one.can_show(result) for one in wanted):
            kept = result
        if kept and check_unchanged(directory, [RESULT_NAME]) and result["analyses"] == versions:
            return result
    except FileChanged:
        raise
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        pass
    if kept is not None and not any((directory / SEGMENTS).rglob("*.bin")):
        return kept
    result, tables = _measured(directory)
    try:
        _write(directory, result, tables)
    except OSError as error:
        if error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise
    return result


def rests_on(origins: Sequence[Origin]) -> list[dict[str, Any]]:
    """What a result rests on that nobody measured, and what the case calls uncertain.

    Returns
    -------
    list of dict
        ``key``, ``value`` (as a case file would say it), ``origin`` (``given``, ``library``, ``calibrated`` or
        ``default``), ``range`` (both ends, or None), ``logarithmic``, and whether it is ``guessed``.
    """
    return [
        {
            "key": one.key,
            "value": one.text,
            "origin": one.origin,
            "range": list(one.range) if one.range else None,  # as it is read from a file
            "logarithmic": one.logarithmic,
            "guessed": one.guessed,
        }
        for one in origins
        if one.key in unmeasured() or one.range is not None
    ]


def lines_of_rest(rests: Sequence[Mapping[str, Any]]) -> list[str]:
    """What a result rests on (`rests_on`) as text: guessed, only said by the case, calibrated."""
    guessed = [one for one in rests if one["guessed"]]
    known = [one for one in rests if not one["guessed"]]
    lines = _listed("guessed", guessed)
    if guessed:
        lines.append("             the result is worth what these are; a band instead: walkers run CASE --spread")
    lines += _listed("as given", [one for one in known if one["origin"] == "given"])
    return lines + _listed("calibrated", [one for one in known if one["origin"] == "calibrated"])


def _listed(head: str, chosen: Sequence[Mapping[str, Any]]) -> list[str]:
    told = ", ".join(f"{one['key'].partition('.')[2]} {one['value']}" for one in chosen)
    indent = {"initial_indent": f"  {head:10} ", "subsequent_indent": " " * 13}
    return textwrap.wrap(told, _WIDTH, **indent, break_on_hyphens=False) if told else []  # type: ignore[arg-type]


def describe_result(directory: Path, result: Mapping[str, Any], *, cached: bool = False) -> str:
    """The result of a run in a few lines: mm, mm/s, degrees.

    Parameters
    ----------
    directory
        The run directory.
    result
        As `tabulate` returns it.
    cached
        Whether the run was there before.
    """
    found = analyses_in(result)
    lines = [line for one in found for line in one.lines(result)] or [f"{result['case']}: {result['drive']}"]
    if cached:
        lines[0] += " (already run)"
    warnings = [f"  warning: {warning}" for warning in warnings_of(result)]
    return "\n".join([*lines, *lines_of_rest(result["rests_on"]), *warnings, f"  run        {directory}"])


def warnings_of(result: Mapping[str, Any]) -> list[str]:
    """What a reader of a result should know."""
    warnings = [warning for one in analyses_in(result) for warning in one.warnings(result)]
    return [*warnings, "the dump ends within a frame"] if result["truncated"] else warnings


def quantities_of(result: Mapping[str, Any]) -> list[Quantity]:
    """The numbers that a result has, as rows of a table."""
    from walkers.postprocess.quantities import quantity

    found = (quantity(result, *row) for one in analyses_in(result) for row in one.rows_of(result))
    return [row for row in found if row.value is not None]


def plot_run(directory: Path, destination: Path | None = None, formats: Sequence[str] = ("png",)) -> list[Path]:
    """Draw the figures of a run.

    Parameters
    ----------
    directory
        A run directory.
    destination
        Folder for the pictures; the run directory itself if None.
    formats
        Of `walkers.postprocess.drawing.FORMATS`.

    Returns
    -------
    list of Path
        Of walkers ``walk`` and, if the run was sampled at least eight times a cycle, ``gait``; of piles ``climb``; each
        in all formats.

    Raises
    ------
    InputError
        If there is no such format.
    """
    check_formats(formats)
    destination = destination or directory
    destination.mkdir(parents=True, exist_ok=True)
    case = case_of(directory)
    figures = (pair for one in analyses_of(case) for pair in one.figures(directory).items())
    return [
        path for name, figure in figures for path in save_figure(figure, destination / name, [directory.name], formats)
    ]
