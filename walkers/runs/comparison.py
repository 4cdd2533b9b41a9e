"""Comparison of two runs, or of two cases that were not run: parameters and results.

The *main number* of a run is the most important of its results, such as the velocity. The *band* of
a number contains the middle 90 % of its values as the uncertain values of the case vary within
their ranges (`walkers.postprocess.measure.uncertainty`).

The significance of a difference over many runs is not computed here; see `walkers.sweeps`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from html import escape
from math import hypot, isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.keys import is_below
from walkers.inputs.units import with_symbols
from walkers.physics.laws import LAWS
from walkers.postprocess.measure.numbers import (
    NOT_SHOWN_ALONE,
    band_of,
    error_text,
    headline,
    leaves_out_facing_down,
    meaningless_numbers,
)
from walkers.postprocess.measure.quantities import (
    declared,
    described_columns,
    is_error,
    scatter_of,
    unit_shown,
)
from walkers.postprocess.measure.results import Results, json_numbers, not_computed, read_results
from walkers.rounding import counted, rounded
from walkers.runner.manifest import read_manifest
from walkers.runs.case_text import differing, flattened, value_text, without_parts
from walkers.runs.draws import ComparedDraws, Draws, compare_draws
from walkers.runs.draws_text import compared_draws_text
from walkers.templates.deck import bridge_tables_digest
from walkers.terminal import fitted_lines, table_width
from walkers.text import aligned_blocks, with_unit

if TYPE_CHECKING:
    from walkers.inputs.origins import Origin
    from walkers.inputs.tables.case import Case

_VELOCITIES = ("velocity", "right_facing", "left_facing")
"""Numbers whose scatter is in the result."""
_HIDDEN_CHANGE = 2e-3
"""Relative difference below which printed values may be rounded to a difference of their own."""
_DASH = "-"
"""A cell without a number."""
_OTHER_BRIDGE_TABLES = (
    "its bridge tables are not those of this program: made by another version, "
    "or on another kind of machine"
)
"""Remark on a run whose forces differ from those that this program would compute."""


@dataclass(frozen=True)
class ComparedRun:
    """One of the two runs or cases that are compared.

    Attributes
    ----------
    name
        Heading of its column.
    case
        Its case.
    directory
        The directory of its finished run; None if there is none.
    draws
        The draws of the spread of the run; None if it has no spread.
    origins
        Sources of the values of the case that was asked for, whose ranges may be newer than those
        of the run; None: the case of the run.
    """

    name: str
    case: Case
    directory: Path | None
    draws: Draws | None = None
    origins: Sequence[Origin] | None = None


@dataclass(frozen=True, repr=False)
class Comparison:
    """Differences of two runs or cases; printed, it is the table.

    Attributes
    ----------
    contents
        As JSON, in SI units.
    text
        As text, in displayed units.
    """

    contents: Mapping[str, Any]
    text: str

    def __repr__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        """The table in a notebook."""
        return f"<pre>{escape(self.text)}</pre>"


@dataclass(frozen=True)
class _Parameter:
    """A key whose values differ between the cases, with the values and where each is from.

    The values are in SI units; the texts are those of the table.
    """

    key: str
    values: Sequence[Any]
    texts: Sequence[str]
    origin_words: Sequence[str | None]


@dataclass(frozen=True)
class _FinishedRun:
    """The name of a side, the results of its run, and the draws of its spread if it has one."""

    name: str
    results: Results
    draws: Draws | None


@dataclass(frozen=True)
class _ComparedNumber:
    """A number of both results in SI units, as it is in the JSON; NaN where a run does not have it.

    The difference is that of the second run from the first; the numerical error is that of the
    difference. The scatter is None where a result has none.
    """

    quantity: str
    unit: str
    first: float
    second: float
    first_scatter: float | None
    second_scatter: float | None
    difference: float
    numerical_error: float

    @property
    def differs(self) -> bool:
        """Whether the values differ, or only one run has the number."""
        return self.first != self.second


def compare_runs(first: ComparedRun, second: ComparedRun) -> Comparison:
    """Compare two runs, or cases that were not run.

    Results are compared if both sides have a finished run.
    """
    parameters = _differing_parameters(first.case, second.case)
    parameters_text = _parameters_text(parameters, [first.name, second.name])
    results_text: list[str] = []
    numbers: list[_ComparedNumber] = []
    draws: ComparedDraws | None = None
    if first.directory and second.directory:
        runs = (
            _FinishedRun(first.name, read_results(first.directory, first.origins), first.draws),
            _FinishedRun(second.name, read_results(second.directory, second.origins), second.draws),
        )
        numbers = _compared_numbers(runs[0].results, runs[1].results)
        draws = _compared_draws(numbers, runs)
        results_text = _results_text(numbers, runs, draws)
        if not parameters:
            parameters_text += _cycles_text(numbers, runs)
    paragraphs = [parameters_text, *results_text]
    not_run = []
    for side in (first, second):
        if _has_other_bridge_tables(side):
            paragraphs.append(f"{side.name}: {_OTHER_BRIDGE_TABLES}")
        if side.directory is None:
            paragraphs.append(f"{side.name}: no finished run; only the parameters are compared")
            not_run.append(side.name)
    values = {}
    sources = {}
    for parameter in parameters:
        values[parameter.key] = parameter.values
        sources[parameter.key] = parameter.origin_words
    contents = {
        "first": first.name,
        "second": second.name,
        "parameters": values,
        "sources": sources,
        "not_run": not_run,
        "results": [json_numbers(asdict(number)) for number in numbers],
        "draws": asdict(draws) if draws else None,
    }
    return Comparison(contents, "\n\n".join(paragraphs))


def _differing_parameters(first: Case, second: Case) -> list[_Parameter]:
    """The keys whose values differ: those that a case gives, then those that follow from others."""
    first_values = flattened(first)
    second_values = flattened(second)
    given, implied = differing([first_values, second_values])
    parameters = []
    for key in [*given, *implied]:
        parameter = _Parameter(
            key,
            values=[first_values.get(key), second_values.get(key)],
            texts=[value_text(first_values, key), value_text(second_values, key)],
            origin_words=[
                first_values.origin_words.get(key),
                second_values.origin_words.get(key),
            ],
        )
        parameters.append(parameter)
    return parameters


def _parameters_text(parameters: Sequence[_Parameter], names: Sequence[str]) -> str:
    """A table of the parameters with the names of both sides as headings.

    A friction that grows with the velocity in one case alone has one row, with the sources of its
    numbers.
    """
    if not parameters:
        return "the cases are the same"
    rows = [["parameter", *names, "source"]]
    by_key = {parameter.key: parameter for parameter in parameters}
    for key in without_parts(list(by_key)):
        texts = map(with_symbols, by_key[key].texts)
        rows.append([key, *texts, _sources_text(key, parameters)])
    return aligned_blocks(rows, table_width())


def _sources_text(key: str, parameters: Sequence[_Parameter]) -> str:
    """Where the values of a key and of its parts are from, those of the first case first."""
    words: list[str] = []
    for side in range(2):
        for parameter in parameters:
            word = parameter.origin_words[side]
            is_of_key = parameter.key == key or is_below(parameter.key, key)
            if is_of_key and word and word not in words:
                words.append(word)
    return " / ".join(words)


def _has_other_bridge_tables(side: ComparedRun) -> bool:
    """Whether a finished run has other bridge tables than this program computes for its case."""
    if side.directory is None or side.case.liquid.law not in LAWS:
        return False
    try:
        manifest = read_manifest(side.directory)
    except (OSError, ValueError):  # reading the result reports this
        return False
    tables = manifest.get("bridge_tables")
    if manifest.get("by_hand") or tables is None:
        return False
    return bool(tables != bridge_tables_digest(side.case))


# --- numbers --------------------------------------------------------------------------------------


def _compared_numbers(first: Results, second: Results) -> list[_ComparedNumber]:
    """The numbers of two results that are worth comparing, in the order of their declarations.

    Errors, values of the case and conditions are left out, and so are means over both facings
    if these differ. A level run and a slope have the velocity in common; if walkers turned over or
    lean, only the velocity up the slope. Runs whose walkers came apart have no velocity in common.
    """
    left_out = _not_compared(first, second)
    names = set()
    for name in {*first, *second} - left_out:
        if not is_error(name):
            names.add(name)
    numbers = []
    for name, (unit, _) in described_columns(names).items():
        number = _compared_number(name, unit, first, second)
        if isfinite(number.first) or isfinite(number.second):
            numbers.append(number)
    return numbers


def _not_compared(first: Results, second: Results) -> set[str]:
    """Names of numbers that say nothing about the difference of two results."""
    left_out = {*NOT_SHOWN_ALONE, "coverage"}
    main_numbers = {headline(first), headline(second)}
    if "axial_velocity" in main_numbers:
        left_out |= {*_VELOCITIES}
    elif "velocity" not in main_numbers:
        left_out.add("velocity")
    for results in (first, second):
        if results.get("facings_differ") and not results.get("goes_uphill"):
            left_out.add("velocity")
        left_out |= meaningless_numbers(results)
    return left_out


def _compared_number(name: str, unit: str, first: Results, second: Results) -> _ComparedNumber:
    """A number of two results, with its errors; NaN in a result that does not have it."""
    value_of_first = _number(first.get(name))
    value_of_second = _number(second.get(name))
    scatter = scatter_of(name)
    error = f"{name}_error"
    return _ComparedNumber(
        quantity=name,
        unit=unit,
        first=value_of_first,
        second=value_of_second,
        first_scatter=first.get(scatter),
        second_scatter=second.get(scatter),
        difference=value_of_second - value_of_first,
        numerical_error=hypot(first.get(error, nan), second.get(error, nan)),
    )


def _compared_draws(
    numbers: Sequence[_ComparedNumber], runs: Sequence[_FinishedRun]
) -> ComparedDraws | None:
    """The main number of both runs over the draws of their spreads.

    None if the runs have different main numbers or the same value, or one has no band of it.
    """
    first, second = runs
    main = headline(first.results)
    if main != headline(second.results) or first.draws is None or second.draws is None:
        return None
    for number in numbers:
        if number.quantity == main and number.differs:
            quantity = declared(main)
            if all(band_of(run.results, quantity) for run in runs):
                return compare_draws(first.draws, second.draws, main, quantity.si_unit)
    return None


def _number(value: Any) -> float:
    """A value of a result as a number; NaN if there is none, or if it is text."""
    if value is None or isinstance(value, str):
        return nan
    return float(value)


# --- text of results ------------------------------------------------------------------------------


def _results_text(
    numbers: Sequence[_ComparedNumber],
    runs: Sequence[_FinishedRun],
    draws: ComparedDraws | None,
) -> list[str]:
    """Paragraphs: numbers that differ, their errors, draws, warnings, numbers that do not differ.

    The draws are those of the main number over both spreads; None if there are none.
    """
    differing_numbers = []
    same = []
    for number in numbers:
        if number.differs:
            differing_numbers.append(number)
        else:
            same.append(number.quantity)
    paragraphs = []
    if differing_numbers:
        paragraphs += _table_of_numbers(differing_numbers, runs)
    errors = _error_lines(differing_numbers, runs, draws)
    if errors:
        paragraphs.append(fitted_lines(errors))
    if draws is not None:
        paragraphs.append(compared_draws_text(draws, runs[0].name, runs[1].name))
    warnings = []
    for run in runs:
        warnings += [f"{run.name}: warning: {warning}" for warning in run.results.warnings]
    if warnings:
        paragraphs.append(fitted_lines(warnings))
    if same and differing_numbers:
        paragraphs.append(fitted_lines([f"the same in both: {', '.join(same)}"]))
    elif same:
        paragraphs.append("all results are the same")
    return paragraphs


def _cycles_text(numbers: Sequence[_ComparedNumber], runs: Sequence[_FinishedRun]) -> str:
    """``, but ran 20 and 40 cycles`` if the numbers of cycles differ; else an empty text."""
    for number in numbers:
        if number.quantity == "cycles" and number.differs:
            first, second = _printed_values(number, runs)
            return f", but ran {first} and {second} cycles"
    return ""


def _table_of_numbers(
    numbers: Sequence[_ComparedNumber], runs: Sequence[_FinishedRun]
) -> list[str]:
    """A table of numbers without empty columns, and what its scatter means if it has one."""
    names = [run.name for run in runs]
    heads = ["result", *names, "difference", "scatter of copies", "numerical error"]
    rows = [_cells(number, runs) for number in numbers]
    columns = []
    has_scatter = False
    for head, *cells in zip(heads, *rows, strict=True):
        if set(cells) != {_DASH}:
            columns.append((head, *cells))
            has_scatter |= head == "scatter of copies"
    paragraphs = [aligned_blocks(list(zip(*columns, strict=True)), table_width())]
    if has_scatter:
        meaning = (
            "scatter of copies: how much copies differ by their start; "
            "it is not an error of the difference"
        )
        paragraphs.append(fitted_lines([meaning]))
    return paragraphs


def _cells(number: _ComparedNumber, runs: Sequence[_FinishedRun]) -> list[str]:
    """A row of the table: label with unit, both values, difference, scatters, numerical error."""
    unit, _ = unit_shown(number.unit)
    return [
        with_unit(number.quantity, unit),
        *_printed_values(number, runs),
        _signed_difference(number),
        _scatters_text(number),
        error_text(number.numerical_error, number.unit),
    ]


def _scatters_text(number: _ComparedNumber) -> str:
    """The scatters that the two results have, in the displayed unit; a dash if none has one."""
    scatters = []
    for scatter in (number.first_scatter, number.second_scatter):
        text = error_text(_number(scatter), number.unit)
        if text != _DASH:
            scatters.append(text)
    if not scatters:
        return _DASH
    return " and ".join(scatters)


def _printed_values(number: _ComparedNumber, runs: Sequence[_FinishedRun]) -> list[str]:
    """Both values in the displayed unit.

    If only one of them is a mean over the walkers that face up, the value says so.
    """
    unit, factor = unit_shown(number.unit)
    facing_up = [leaves_out_facing_down(declared(number.quantity), run.results) for run in runs]
    texts = []
    for value, is_facing_up in zip((number.first, number.second), facing_up, strict=True):
        text = rounded(factor * value, unit)
        if is_facing_up and not all(facing_up) and text != _DASH:
            text += " facing up"
        texts.append(text)
    return texts


def _signed_difference(number: _ComparedNumber) -> str:
    """The difference in the displayed unit with its sign."""
    unit, factor = unit_shown(number.unit)
    first = factor * number.first
    second = factor * number.second
    difference = factor * number.difference
    if abs(difference) < _HIDDEN_CHANGE * abs(first):
        # Digits that are not printed would contradict the printed ones.
        difference = float(rounded(second, unit)) - float(rounded(first, unit))
    text = rounded(difference, unit)
    if text == "0" or text.startswith("-"):
        return text
    return f"+{text}"


def _error_lines(
    differing_numbers: Sequence[_ComparedNumber],
    runs: Sequence[_FinishedRun],
    draws: ComparedDraws | None,
) -> list[str]:
    """Lines on how certain the differences are; none if no velocity or main number differs.

    They have the ratio of each velocity's difference to its numerical error, the bands of both runs
    if their main numbers differ, and the command that measures numerical errors that are missing.
    """
    number_by_name = {number.quantity: number for number in differing_numbers}
    velocities = [number_by_name[name] for name in _VELOCITIES if name in number_by_name]
    lines = []
    for number in velocities:
        if isfinite(number.numerical_error) and number.numerical_error > 0.0:
            times = error_text(abs(number.difference) / number.numerical_error, "")
            lines.append(f"{number.quantity}: differs by {times} times its numerical error")
    if any(headline(run.results) in number_by_name for run in runs):
        lines += _band_lines(runs, draws)
    # The field of `not_computed` tells whether the numerical error is missing.
    unmeasured = [run for run in runs if not_computed(run.results).numerical_error]
    if velocities and unmeasured:
        directories = " ".join(str(run.results.directory) for run in unmeasured)
        lines.append(f"to measure numerical errors: walkers run {directories} --accuracy")
    return lines


def _band_lines(runs: Sequence[_FinishedRun], draws: ComparedDraws | None) -> list[str]:
    """The band of each run, and the number of uncertain values that both runs have in common.

    Compared draws, which have a paragraph of their own, say more than this number.
    """
    lines = []
    for run in runs:
        band = _band_text(run.results)
        if band:
            lines.append(f"{run.name}: {band}")
    first, second = runs
    shared = _uncertain_keys(first.results) & _uncertain_keys(second.results)
    if shared and draws is None:
        values = f"the runs have {counted(len(shared), 'uncertain value')} in common"
        lines.append(
            f"{values}, which may shift both results alike: "
            "the difference can be certain even if the bands overlap"
        )
    return lines


def _uncertain_keys(results: Results) -> set[str]:
    """Keys of the uncertain values on which a result rests."""
    return {value["key"] for value in _uncertain_values(results)}


def _uncertain_values(results: Results) -> list[dict[str, Any]]:
    """The values with a range on which a result rests."""
    return [value for value in results.about["rests_on"] if value["range"]]


def _band_text(results: Results) -> str:
    """The band of the main number of a run, or on how many uncertain values the number rests.

    Empty if there is no band and no uncertain value.
    """
    main = headline(results)
    if main:
        quantity = declared(main)
        band = band_of(results, quantity)
        if band:
            unit, _ = unit_shown(quantity.unit)
            return f"{with_unit(main, unit)}, {band}"
    if not not_computed(results).uncertain_values:
        return ""
    origins = [value["origin"] for value in _uncertain_values(results)]
    rests = f"{main} rests on {counted(len(origins), 'uncertain value')}"
    guessed = f"{origins.count('default')} guessed"
    return f"{rests}, {guessed}; the band over the ranges is not computed (--spread)"
