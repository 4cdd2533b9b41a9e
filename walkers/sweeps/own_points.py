"""Points of the user's own, such as measured ones, for the figure of a sweep.

They are in a text file: a header that names the columns with their units, and rows of numbers. The
columns are heads by their names, which are those of the axes of the figure.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import InputError, input_error, suggestion
from walkers.files import read_limited
from walkers.inputs.units import unit_factor
from walkers.sweeps.factors import Factor
from walkers.sweeps.left_out import warn_left_out
from walkers.text import with_unit

if TYPE_CHECKING:
    import pandas as pd

_MOST_BYTES = 16 << 20
"""Largest size of a file, bytes."""
_NAME_AND_UNIT = re.compile(r"(?P<name>.*?)\s*[(\[](?P<unit>[^()\[\]]*[^\W\d][^()\[\]]*|%|°)[)\]]")
"""A head with its unit in brackets; those of ``radii[0]`` hold none."""
_ERROR_NAME = re.compile(r"(.+) (error|uncertainty|standard deviation|std)")
"""Plain name of a column with the errors of another one."""


@dataclass(frozen=True)
class OwnPoints:
    """N points in the units of the axes of a panel.

    Attributes
    ----------
    x, y
        Their places, shape (N,).
    x_error, y_error
        Half lengths of their error bars, shape (N,), NaN for none; None without such a column.
    """

    x: FloatArray
    y: FloatArray
    x_error: FloatArray | None
    y_error: FloatArray | None


@dataclass(frozen=True)
class PointsFile:
    """A file of points.

    Attributes
    ----------
    label
        Its entry in the legend.
    path
        The file.
    columns
        Texts of the cells, shape (N,), by the heads of their columns.
    """

    label: str
    path: Path
    columns: Mapping[str, pd.Series]

    def points_of(self, x: Factor, y: Factor) -> OwnPoints | None:
        """The points along the axes of a panel; None if the file has no column of the x axis.

        Parameters
        ----------
        x, y
            What is on the axes.

        Raises
        ------
        InputError
            If the file has no column of the y axis, or a unit or a cell is not understood.
        """
        x_head = self._head_of(x, "x")
        if x_head is None:
            return None
        y_head = self._head_of(y, "y")
        if y_head is None:
            raise self._missing([x], y)
        if x.is_number:
            places, x_error = self._numbers_and_errors(x_head, x.unit)
        else:
            places = self._categories(x_head, x)
            x_error = None
        values, y_error = self._numbers_and_errors(y_head, y.unit)
        return OwnPoints(places, values, x_error, y_error)

    def check_columns(self, x_factors: Sequence[Factor], y: Factor) -> None:
        """Refuse a file without the columns of any panel, and warn about columns left out.

        One of these may be the misspelt name of an error.

        Parameters
        ----------
        x_factors
            What is on the x axes of the panels.
        y
            What is on their y axis.
        """
        heads: list[str] = []
        for x in x_factors:
            x_head = self._head_of(x, "x")
            if x_head is not None:
                heads.append(x_head)
        y_head = self._head_of(y, "y")
        if not heads or y_head is None:
            raise self._missing(x_factors, y)
        heads.append(y_head)
        error_heads = []
        for head in heads:
            name, _ = _name_and_unit(head)
            error_heads.append(self._error_head(name))
        drawn = {*heads, *error_heads}
        left_out = [f'"{head}"' for head in self.columns if head not in drawn]
        if left_out:
            warn_left_out(f"{self.path}: not drawn: {', '.join(left_out)}")

    def _missing(self, x_factors: Sequence[Factor], y: Factor) -> InputError:
        """The error of a file that does not have the columns of the axes."""
        x_heads = " or ".join([_expected_head(x) for x in x_factors])
        heads = ", ".join([f'"{head}"' for head in self.columns])
        expected = f"expected a header with {x_heads}, and {_expected_head(y)}"
        return input_error(self.path, f"{expected}; it has {heads}")

    def _head_of(self, factor: Factor, axis: str) -> str | None:
        """The head of the column of a factor, by any of its names or that of the axis."""
        key = factor.keys[0]
        names = {_plain(name) for name in (key, key.rpartition(".")[2], factor.name, axis)}
        for head in self.columns:
            if _plain(_name_and_unit(head)[0]) in names:
                return head
        return None

    def _numbers_and_errors(self, head: str, unit: str) -> tuple[FloatArray, FloatArray | None]:
        """The numbers of a column and their errors, in the unit of an axis."""
        name, own_unit = _name_and_unit(head)
        factor = self._factor(head, own_unit, unit)
        numbers = factor * self._numbers(head)
        error_head = self._error_head(name)
        if error_head is None:
            return numbers, None
        _, unit_of_error = _name_and_unit(error_head)
        if unit_of_error:
            factor = self._factor(error_head, unit_of_error, unit)
        errors = factor * self._numbers(error_head, may_be_empty=True)
        if (errors < 0.0).any():
            raise input_error(self.path, f'column "{error_head}": expected errors of zero or more')
        return numbers, errors

    def _error_head(self, name: str) -> str | None:
        """The head of the column with the errors of a column."""
        for head in self.columns:
            match = _ERROR_NAME.fullmatch(_plain(_name_and_unit(head)[0]))
            if match and match[1] == _plain(name):
                return head
        return None

    def _factor(self, head: str, unit: str, target: str) -> float:
        """How many units of an axis the unit of a column is."""
        if target and not unit:
            expected = f"expected its unit in brackets, such as {with_unit(head, target)}"
            raise input_error(self.path, f'column "{head}": {expected}')
        try:
            return unit_factor(unit, target)
        except ValueError as error:
            raise input_error(self.path, f'column "{head}": {error}') from error

    def _numbers(self, head: str, *, may_be_empty: bool = False) -> FloatArray:
        """The numbers of a column, shape (N,); NaN where it is empty."""
        import pandas as pd

        texts = self.columns[head].str.strip()
        numbers = pd.to_numeric(texts.str.replace(",", "."), errors="coerce")
        is_wrong = ~np.isfinite(numbers)
        if may_be_empty:
            is_wrong &= texts != ""
        if is_wrong.any():
            row = int(np.flatnonzero(is_wrong)[0])
            problem = f'row {row + 1}: column "{head}" is "{texts.iloc[row]}"'
            raise input_error(self.path, f"{problem}; expected a number")
        return numbers.to_numpy(dtype=float)

    def _categories(self, head: str, x: Factor) -> FloatArray:
        """The places of the categories that a column names, shape (N,)."""
        places = []
        for row, text in enumerate(self.columns[head].str.strip(), 1):
            if text not in x.levels:
                expected = f"expected one of {', '.join(x.levels)}{suggestion(text, x.levels)}"
                raise input_error(self.path, f'row {row}: column "{head}" is "{text}"; {expected}')
            places.append(x.levels.index(text))
        return np.array(places, dtype=float)


def read_points(argument: str | Path) -> PointsFile:
    """Read a file of points.

    The first line that does not begin with ``#`` is the header. Columns are separated by commas,
    semicolons or tabs; with semicolons and tabs, numbers may have decimal commas.

    Parameters
    ----------
    argument
        The file, or ``LABEL=FILE``; without a label, the legend has the name of the file.

    Raises
    ------
    InputError
        If the file cannot be read, or has no header or no rows.
    """
    import pandas as pd
    from pandas.errors import ParserError, ParserWarning

    label, path = _label_and_path(argument)
    try:
        text = read_limited(path, _MOST_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise input_error(path, "expected UTF-8 text: save the file as UTF-8") from error
    except OSError as error:
        raise input_error(path, f"cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise input_error(path, str(error)) from error
    lines = [line for line in text.splitlines() if line.strip() and line.lstrip()[0] != "#"]
    if len(lines) < 2:
        expected = 'expected a header, such as "velocity (mm/s)" for each column, and rows'
        raise input_error(path, f"{expected}; it has {len(lines)} lines")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", ParserWarning)  # of rows that are too long
            columns = pd.read_csv(
                io.StringIO("\n".join(lines)),
                sep=_separator_of(lines[0]),
                dtype=str,
                keep_default_na=False,
                skipinitialspace=True,
                index_col=False,
            )
    except (ParserError, ParserWarning, ValueError) as error:
        message = "expected rows with a value for each name of the header: decimal commas? "
        raise input_error(path, f"{message}Then separate the columns by semicolons") from error
    cells = {str(head).strip(): texts.fillna("") for head, texts in columns.items()}
    return PointsFile(label, path, cells)


def _label_and_path(argument: str | Path) -> tuple[str, Path]:
    """The label in the legend and the file of an argument."""
    path = Path(argument)
    label, equals, name = str(argument).rpartition("=")
    if not equals or path.exists():
        return path.stem, path
    return label, Path(name)


def _separator_of(header: str) -> str:
    """What separates the columns of a file with this header."""
    for separator in ("\t", ";"):
        if separator in header:
            return separator
    return ","


def _name_and_unit(head: str) -> tuple[str, str]:
    """The name in a head, and its unit; an empty text without a unit."""
    match = _NAME_AND_UNIT.fullmatch(head.strip())
    if match is None:
        return head.strip(), ""
    return match["name"], match["unit"].strip()


def _expected_head(factor: Factor) -> str:
    """The head of a column of a factor, as a message quotes it."""
    _, _, name = factor.keys[0].rpartition(".")
    if not factor.is_number:
        name = factor.name  # "liquid", where the key is liquid.name
    return f'"{with_unit(name, factor.unit)}"'


def _plain(name: str) -> str:
    """A name in lower case, with spaces for underscores."""
    return " ".join(name.replace("_", " ").lower().split())
