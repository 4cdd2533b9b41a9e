"""A `Case` from the tables of its file, from what was stored, or from another case with changes.

Files are found and read by `walkers.inputs.reading`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from pydantic import ValidationError

from walkers.errors import InputError, Problem, apply_all, input_error, key_error
from walkers.inputs.axes import NotARange, range_of
from walkers.inputs.config_table import ConfigTable, alternatives, changed, contradictions
from walkers.inputs.keys import flatten, value_at
from walkers.inputs.messages import attributed_to, check_key, validated
from walkers.inputs.resolving.from_library import NAMES, SUPPLIED, supplied
from walkers.inputs.resolving.library import library_of
from walkers.inputs.resolving.steps import resolve
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.toml import with_files

_ROUNDING = 1e-9
"""Share of a range by which a value may lie beyond its ends: it may be rounded."""


def build_case(
    document: Mapping[str, Any],
    *,
    source: str = "<case>",
    name: str = "case",
    changes: Mapping[str, Any] | None = None,
    check_ranges: bool = False,
) -> Case:
    """Resolve a case that is given as the tables of a case file.

    Parameters
    ----------
    document
        The tables; quantities are strings with units.
    source
        What messages call the document.
    name
        Name of the case, with which the names of its run directories begin.
    changes
        Values that replace those of the document, by dotted keys, written as in a case file.
    check_ranges
        Whether ranges of uncertain values must contain the values of the case. Points of a sweep
        may leave them.

    Returns
    -------
    Case
        All values in SI units; its ``document`` has the tables with the changes and the contents of
        the files that they name.

    Raises
    ------
    InputError
        If the document or a change is invalid, with all problems of the step that fails first.
    """
    if changes:
        with attributed_to(source):
            apply_all(partial(check_key, CaseFile), changes)
            document = changed(CaseFile, document, changes)
    with attributed_to(source, document):
        document = _with_record(with_files(document))
        tables, sources, of_library = supplied(document, library_of(document, source))
        file = _validated(tables, of_library, source)
        try:
            case = resolve(file, name=name, document=document, sources=sources)
        except ArithmeticError as error:
            raise input_error(source, f"inconsistent values: {error}") from error
        _check_uncertain(case, tables, source, check_ranges=check_ranges)
    return case


def changed_case(case: Case, changes: Mapping[str, Any]) -> Case:
    """The case with other values in its file, resolved anew.

    Parameters
    ----------
    case
        A case with the document from which it was built.
    changes
        Values by dotted keys, written as in a case file.

    Returns
    -------
    Case
        Under the same name; the same case if there are no changes.

    Raises
    ------
    InputError
        If a change is invalid.

    Examples
    --------
    >>> from walkers import load_case
    >>> case = load_case("fig1b")
    >>> changed_case(case, {"drive.frequency": "70 Hz", "dimers.radii[1]": "0.25 mm"}).dimers.radii
    (0.0003, 0.00025)
    """
    if not changes:
        return case
    return build_case(case.document, source=case.name, name=case.name, changes=changes)


def stored_case(values: Mapping[str, Any]) -> Case:
    """Read a case from what `Case.as_dict` returns; keys of earlier versions are left out.

    Raises
    ------
    ValueError
        If the values are not those of a case.
    """
    try:
        return Case.model_validate(values, extra="ignore")
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ValueError(f"{place}: {first['msg']}") from error


def _with_record(document: Mapping[str, Any]) -> dict[str, Any]:
    """The tables with the contents of the record in the place of the name of its file."""
    tables = dict(document)
    records = tables.pop("records", {})
    file = value_at(tables, ("drive", "record"))
    if isinstance(file, str):
        tables["drive"] = {**tables["drive"], "record": {"file": file, **records[file]}}
    return tables


def _validated(tables: Mapping[str, Any], of_library: list[Problem], source: str) -> CaseFile:
    """The tables as a case file; ``of_library`` are problems of what the library was to give."""
    further = [*of_library, *contradictions(CaseFile, tables)]
    unknown = [problem for problem in of_library if problem.key not in SUPPLIED]
    try:
        return validated(CaseFile, tables, source, further=further)
    except InputError as error:
        problems = list(error.problems)
        if unknown or any(problem.key in NAMES and problem.value for problem in problems):
            # A name is wrong: what the library would have given under another one is not missing.
            problems = [
                problem for problem in problems if problem.value or problem.key not in SUPPLIED
            ]
        raise InputError(source, problems) from error


def _check_uncertain(
    case: Case, tables: Mapping[str, Any], source: str, *, check_ranges: bool
) -> None:
    """Refuse uncertain values that are no keys, or whose ranges the case could not have.

    Parameters
    ----------
    case
        The resolved case.
    tables
        The tables of its file, in which the ends of ranges are tried as values.
    source
        What messages call the case.
    check_ranges
        Whether the ranges must contain the values of the case.
    """
    written = flatten(tables.get("uncertain", {}))

    def check(name: str) -> None:
        place = f"uncertain.{name}"
        try:
            low, high = _ends_of_range(name, case.uncertain[name], tables, source)
            _check_has_value(case, name)
            if check_ranges:
                _check_contains_value(case, name, low, high)
        except NotARange as error:
            message = "expected [low, high] or { loguniform = [low, high] }"
            raise key_error(place, message, written[name]) from error
        except InputError as error:  # its key is that of the case, and its value may be an end
            raise key_error(place, error.problems[0].expected, written[name]) from error

    apply_all(check, case.uncertain)


def _check_has_value(case: Case, name: str) -> None:
    """Refuse an uncertain key for which the case has another one, or a table."""
    value = case.value_of(name)
    if isinstance(value, ConfigTable):
        keys = " or ".join(key for key, _, _ in value.leaves(f"{name}."))
        raise key_error(name, f"is a table in the case; expected {keys}")
    if value is not None:
        return
    instead = sorted(key for key in alternatives(CaseFile, name) if case.value_of(key))
    if instead:
        raise key_error(name, f"expected {' or '.join(instead)}, which the case has instead")


def _check_contains_value(case: Case, name: str, low: Any, high: Any) -> None:
    """Refuse a range of an uncertain key, in SI units, that does not contain its number."""
    value = case.value_of(name)
    slack = _ROUNDING * (high - low)
    if isinstance(value, (int, float)) and not low - slack <= value <= high + slack:
        texts = {origin.key: origin.text for origin in case.origins}
        text = texts.get(name, str(value))
        raise key_error(name, f"expected a range that holds the case's own value, {text}")


def _ends_of_range(
    name: str,
    given: Mapping[str, Any],
    tables: Mapping[str, Any],
    source: str,
) -> tuple[Any, Any]:
    """The ends of the range of an uncertain key, in SI units; each must be a value for the case."""
    check_key(CaseFile, name)
    if range_of(name, given).median is not None:
        raise key_error(name, "expected [low, high]: the case's own value is the median")
    (ends,) = given.values()  # of the one distribution, which `range_of` has checked
    values = []
    for end in ends:
        file = validated(CaseFile, changed(CaseFile, tables, {name: end}), source)
        values.append(file.value_of(name))
    low, high = values
    return low, high
