"""A `Case` from the tables of its file, from what was stored, or from another case with changes.

Files are found and read by `walkers.inputs.reading`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from walkers.errors import InputError, Problem, apply_all, input_error, key_error
from walkers.inputs.axes import NotARange, range_of
from walkers.inputs.config_table import alternatives, changed, contradictions
from walkers.inputs.keys import flatten, value_at
from walkers.inputs.messages import attributed_to, check_key, validated
from walkers.inputs.resolving.from_library import NAMES, SUPPLIED, supplied
from walkers.inputs.resolving.library import library_of
from walkers.inputs.resolving.steps import resolve
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.toml import with_files


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
        Whether uncertain ranges must contain the values of the case. Points of a sweep may leave
        them.

    Returns
    -------
    Case
        All values in SI units; its ``document`` has the tables with the changes and the contents of
        the files that they name.

    Raises
    ------
    InputError
        If the document or a change is invalid, with all problems of the step that detects the first.
    """
    if changes:
        with attributed_to(source):
            apply_all(lambda key: check_key(CaseFile, key), changes)
            document = changed(CaseFile, document, changes)
    with attributed_to(source, document):
        document = _with_record(with_files(document))
        tables, sources, unknown = supplied(document, library_of(document, source))
        file = _validated(tables, unknown, source)
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
    """Read a case from what `Case.as_dict` returns, without keys of earlier versions of the program.

    Raises
    ------
    ValueError
        If the values are not those of a case.
    """
    try:
        return Case.model_validate(values, extra="ignore")
    except ValidationError as error:
        first = error.errors()[0]
        raise ValueError(f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from error


def _with_record(document: dict[str, Any]) -> dict[str, Any]:
    """The tables with the rows of the recorded shaking in the place of the name of its file."""
    records = document.pop("records", {})
    file = value_at(document, ("drive", "record"))
    if isinstance(file, str):
        document["drive"] = {**document["drive"], "record": {"file": file, **records[file]}}
    return document


def _validated(tables: Mapping[str, Any], unknown: list[Problem], source: str) -> CaseFile:
    """The tables as a case file; ``unknown`` are problems of names that the library lacks."""
    try:
        return validated(
            CaseFile, tables, source, further=[*unknown, *contradictions(CaseFile, tables)]
        )
    except InputError as error:
        # What the library would have given under another name is not missing too.
        misnamed = unknown or any(
            problem.key in NAMES and problem.value for problem in error.problems
        )
        hidden = SUPPLIED if misnamed else ()
        kept = [problem for problem in error.problems if problem.value or problem.key not in hidden]
        raise InputError(source, kept) from error


def _check_uncertain(
    case: Case, tables: Mapping[str, Any], source: str, *, check_ranges: bool
) -> None:
    """Refuse uncertain values that are no keys, or whose ends the case could not have."""
    written = flatten(tables.get("uncertain", {}))

    def check(name: str) -> None:
        place = f"uncertain.{name}"
        try:
            low, high = _ends_of_range(name, case.uncertain[name], tables, source)
        except NotARange as error:
            message = "expected [low, high] or { loguniform = [low, high] }"
            raise key_error(place, message, written[name]) from error
        except InputError as error:  # of the key or of an end of its range
            raise key_error(place, error.problems[0].expected, written[name]) from error
        value = case.value_of(name)
        if value is None:
            instead = sorted(key for key in alternatives(CaseFile, name) if case.value_of(key))
            if instead:
                message = f"expected {' or '.join(instead)}, which the case has instead"
                raise key_error(place, message, written[name])
        slack = 1e-9 * (high - low)
        if (
            check_ranges
            and isinstance(value, (int, float))
            and not low - slack <= value <= high + slack
        ):
            text = next((origin.text for origin in case.origins if origin.key == name), str(value))
            message = f"expected a range that holds the case's own value, {text}"
            raise key_error(place, message, written[name])

    apply_all(check, case.uncertain)


def _ends_of_range(
    name: str,
    given: Mapping[str, Any],
    tables: Mapping[str, Any],
    source: str,
) -> tuple[Any, Any]:
    """The ends of the range of an uncertain key, in SI units."""
    check_key(CaseFile, name)
    if range_of(name, given).median is not None:
        raise key_error(name, "expected [low, high]: the case's own value is the median")
    (ends,) = given.values()
    documents = (changed(CaseFile, tables, {name: end}) for end in ends)
    low, high = (validated(CaseFile, document, source) for document in documents)
    return low.value_of(name), high.value_of(name)
