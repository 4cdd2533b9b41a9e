"""Files of recorded shaking, as data loggers write them: a header, and rows of numbers.

This module reads a file. Whether its rows are a motion that can be run is a matter of
`walkers.inputs.records.record`.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import TypedDict

from walkers.files import read_limited
from walkers.inputs.units import ACCELERATION, TIME, QuantityKind, parse_quantity

_MOST_BYTES = 64 << 20
"""Largest size of a file, bytes."""
_EXAMPLE = '"time (ms), x (g), z (m/s^2)"'
_EXPECTED_HEADER = (
    f"expected a header that names the time and accelerations along x, y or z, such as {_EXAMPLE}"
)
_LONGEST_QUOTATION = 60
"""Longest quotation of a line of the file in a message, in letters."""
_NAME_AND_UNIT = re.compile(r"(?P<name>[^\[\]()]*)[\[(](?P<unit>[^\[\]()]*)[\])]\s*")
"""A name in the header with its unit in brackets."""
_TIME_NAMES = frozenset({"t", "time", "timestamp"})
"""Names of the column of the time."""
_AXIS_NAME = re.compile(
    r"(linear )?(a|acc|accel|acceleration)? ?(?P<axis>[xyz])"
    r"|(?P<first>[xyz]) (acc|acceleration)"
)
"""Names of columns of accelerations, such as "acc x", "ax", "x" or "x acc"."""
_QUANTITIES = ("time", "acceleration along x", "acceleration along y", "acceleration along z")
"""Quantities of a row of a record, in their order."""
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE)
_METRE_PER_SECOND_SQUARED = frozenset(
    ("m/s2", "m/s^2", "m/s²", "m/s**2", "m/s/s", "m s-2", "m s^-2", "m·s⁻²", "ms^-2")
)
"""How loggers write m/s²."""


class RecordContents(TypedDict):
    """What a file of recorded shaking contains.

    Attributes
    ----------
    rows
        Time, s, and acceleration along x, y and z, m/s².
    ignored_columns
        Names of the columns that are neither.
    """

    rows: list[list[float]]
    ignored_columns: list[str]


@dataclass(frozen=True)
class _Column:
    """A column that is read.

    Attributes
    ----------
    index
        Its place in a row of the file.
    place
        Its place in a row of the record: 0 for the time, 1 to 3 for x, y and z.
    factor
        Its unit in SI units.
    head
        Its name and unit in the header.
    """

    index: int
    place: int
    factor: float
    head: str


def read_record(path: Path) -> RecordContents:
    """Read a file of recorded shaking.

    The header is the first line that is not empty and does not begin with ``#``. If that line
    already has numbers, the header is the last ``#`` line above it. All other ``#`` lines are left
    out. Columns are separated by commas, semicolons or tabs, as in the header. With semicolons and
    tabs, numbers may have decimal commas. The time and the accelerations are found by their names,
    whatever their case, and have their units in brackets. Other columns are left out.

    Parameters
    ----------
    path
        A text file in UTF-8.

    Returns
    -------
    RecordContents
        Its rows in SI units, and the names of the columns that were left out.

    Raises
    ------
    ValueError
        If the file cannot be read, or its header or a row is not understood. The message names the
        line or row.
    """
    lines = _lines_of(_text_of(path))
    separator = _separator_of(lines[0])
    try:
        header, *rows = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    except csv.Error as error:
        raise ValueError(f"expected rows of numbers below a header: {error}") from error
    heads = _without_empty_end(header)
    columns, ignored_columns = _columns_of(heads)
    _check_columns(columns, lines[0])
    rows_of_record = []
    for number, fields in enumerate(rows, 1):
        _check_length(fields, number, heads, separator)
        rows_of_record.append(_row_of(fields, number, columns))
    _check_decimal_commas(rows, columns)
    return {"rows": rows_of_record, "ignored_columns": ignored_columns}


def _text_of(path: Path) -> str:
    """The text of a file in UTF-8.

    Raises `ValueError` if it cannot be read, is larger than `_MOST_BYTES` or is not UTF-8.
    """
    try:
        contents = read_limited(path, _MOST_BYTES)
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from error
    try:
        text = contents.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = contents.count(b"\n", 0, error.start) + 1
        byte = f"byte {contents[error.start]:#04x} in line {line}"
        raise ValueError(f"expected UTF-8 text, found {byte}: save the file as UTF-8") from error
    if "\0" in text:  # as in UTF-16
        raise ValueError("expected UTF-8 text, found zero bytes: save the file as UTF-8")
    return text


def _lines_of(text: str) -> list[str]:
    """The header and the rows of a file, without comments."""
    comments_above: list[str] = []
    lines: list[str] = []
    for line in text.splitlines():
        if line.lstrip().startswith("#"):
            if not lines:
                comments_above.append(line.lstrip("# "))
        elif line.strip():
            lines.append(line)
    if comments_above and (not lines or _is_of_numbers(lines[0])):
        lines.insert(0, comments_above[-1])
    if not lines:
        raise ValueError(f"is empty; {_EXPECTED_HEADER}")
    return lines


def _separator_of(header: str) -> str:
    """What separates the columns of a file with this header."""
    for separator in ("\t", ";"):
        if separator in header:
            return separator
    return ","


def _is_of_numbers(line: str) -> bool:
    """Whether a line begins with a number."""
    first = line.split(_separator_of(line), maxsplit=1)[0].strip().replace(",", ".")
    return _NUMBER.fullmatch(first) is not None


def _without_empty_end(fields: Sequence[str]) -> list[str]:
    """The fields of a line without empty ones at its end: loggers end lines with a separator."""
    number = len(fields)
    while number and not fields[number - 1].strip():
        number -= 1
    return list(fields[:number])


def _columns_of(heads: Sequence[str]) -> tuple[list[_Column], list[str]]:
    """The columns of the time and of accelerations, and the names of the others."""
    columns: list[_Column] = []
    ignored: list[str] = []
    for number, field in enumerate(heads):
        head = field.strip()
        match = _NAME_AND_UNIT.fullmatch(head)
        name = head
        unit = ""
        if match:
            name = match["name"]
            unit = match["unit"].strip()
        place = _place_of(name)
        if place is None:
            ignored.append(head or f"number {number + 1}")
            continue
        factor = _factor_of(head, unit, TIME if place == 0 else ACCELERATION)
        columns.append(_Column(index=number, place=place, factor=factor, head=head))
    return columns, ignored


def _check_columns(columns: Sequence[_Column], header: str) -> None:
    """Raise `ValueError` unless there is one time, one acceleration or more, and each once."""
    for place, quantity in enumerate(_QUANTITIES):
        heads = [f'"{column.head}"' for column in columns if column.place == place]
        if len(heads) > 1:
            both = " and ".join(heads)
            raise ValueError(f"columns {both} are both the {quantity}; expected one of them")
    places = {column.place for column in columns}
    if 0 in places and len(places) > 1:
        return
    quotation = header.strip()
    if len(quotation) > _LONGEST_QUOTATION:
        quotation = f"{quotation[:_LONGEST_QUOTATION]}..."
    if not places:
        cure = "replace all lines above the numbers by a header"
        raise ValueError(f'{_EXPECTED_HEADER}, found "{quotation}": {cure}')
    missing = "names no time"
    if 0 in places:
        missing = "names no acceleration along x, y or z"
    raise ValueError(f'{_EXPECTED_HEADER}; "{quotation}" {missing}')


def _place_of(name: str) -> int | None:
    """Place of a column in the rows of a record: 0 for the time, 1 to 3 for x, y and z, or None."""
    plain = re.sub(r"[\s_.\-]+", " ", name).strip().lower()
    if plain in _TIME_NAMES:
        return 0
    match = _AXIS_NAME.fullmatch(plain)
    if match is None:
        return None
    return 1 + "xyz".index(match["axis"] or match["first"])


def _factor_of(head: str, unit: str, kind: QuantityKind) -> float:
    """The value of a unit of time or acceleration in SI units, in any of the spellings of loggers.

    Raises `ValueError`, with the head of the column, for a unit of another kind.
    """
    if kind is ACCELERATION:
        if unit in _METRE_PER_SECOND_SQUARED:
            unit = "m/s^2"
        elif unit in ("mg", "mG"):  # of an acceleration, never milligrams
            return 1e-3 * parse_quantity("1 g", kind)
        elif unit == "G":
            unit = "g"
    try:
        return parse_quantity(f"1 {unit}", kind)
    except ValueError as error:
        raise ValueError(f'column "{head}": {error}, in brackets behind the name') from error


def _check_length(fields: Sequence[str], number: int, heads: Sequence[str], separator: str) -> None:
    """Raise `ValueError` for a row of the file with more values than the header has names."""
    values = len(_without_empty_end(fields))
    if values <= len(heads):
        return
    problem = f"row {number} has {values} values, the header {len(heads)} names"
    if separator == ",":
        raise ValueError(f"{problem}: decimal commas? Then separate the columns by semicolons")
    raise ValueError(f"{problem}; expected a name for each column")


def _row_of(fields: Sequence[str], number: int, columns: Sequence[_Column]) -> list[float]:
    """The row of the record (time in s, accelerations in m/s²) that a row of the file gives.

    Axes that the file does not have are 0.

    Parameters
    ----------
    fields
        Texts of the row of the file.
    number
        Number of the row in the file, for messages.
    columns
        The columns that are read.

    Raises
    ------
    ValueError
        If a field is not a finite number.
    """
    row = [0.0, 0.0, 0.0, 0.0]
    for column in columns:
        text = ""
        if column.index < len(fields):
            text = fields[column.index].strip()
        value = _number_of(text)
        if not isfinite(value):
            problem = f'row {number}: column "{column.head}" is "{text[:_LONGEST_QUOTATION]}"'
            raise ValueError(f"{problem}; expected a number")
        row[column.place] = value * column.factor
    return row


def _number_of(text: str) -> float:
    """The number of a text, which may have a decimal comma; NaN if it is not a number."""
    if text.count(",") == 1 and "." not in text:
        text = text.replace(",", ".")
    if _NUMBER.fullmatch(text) is None:
        return nan
    return float(text)


def _check_decimal_commas(rows: Sequence[Sequence[str]], columns: Sequence[_Column]) -> None:
    """Refuse a file whose numbers have commas and points: the commas may separate thousands."""
    with_comma = ""
    with_point = ""
    for row in rows:
        for column in columns:
            text = row[column.index]
            if not with_comma and "," in text:
                with_comma = text.strip()
            if not with_point and "." in text:
                with_point = text.strip()
    if with_comma and with_point:
        comma = f'numbers with a comma, "{with_comma}"'
        point = f'with a point, "{with_point}"'
        raise ValueError(
            f"has {comma}, and {point}; expected either decimal commas or decimal points"
        )
