"""Conditions on runs, such as ``frequency=80 Hz`` or ``velocity>1mm/s``.

A condition is about a value of the case, or about a number of the result. What a user writes is
compared in SI units.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isclose
from typing import Any

from walkers.errors import input_error
from walkers.inputs.units import QuantityKind, parse_quantity
from walkers.postprocess.measure.quantities import declared, is_declared, unit_shown
from walkers.runs.case_text import quantity_kind, readable

_CONDITION = re.compile(
    r"(?P<key>[^<>=!]*?)\s*(?P<comparison><=|>=|!=|<|>|=)\s*(?P<value>[^<>=!].*)"
)
_SAME_VALUE = 1e-6
"""Relative difference up to which a value in a condition equals that of a case."""
_EXPECTED = 'expected KEY=VALUE, such as "drive.frequency=80 Hz", or "velocity>1mm/s"'
"""What a condition is, for messages."""


def _is_close(value: float, number: float) -> bool:
    return isclose(value, number, rel_tol=_SAME_VALUE)


def _is_not_close(value: float, number: float) -> bool:
    return not _is_close(value, number)


_COMPARISONS: Mapping[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
    "=": _is_close,
    "!=": _is_not_close,
}
"""Comparisons of a value of a run with the number of a condition."""


@dataclass(frozen=True)
class Condition:
    """A condition on runs.

    Attributes
    ----------
    text
        What the user wrote.
    key
        The end of a dotted key of the case, or the name of a number of the result.
    comparison
        ``=``, ``!=``, ``<``, ``>``, ``<=`` or ``>=``.
    value
        The value as text, with its unit.
    """

    text: str
    key: str
    comparison: str
    value: str

    @classmethod
    def read(cls, text: str) -> Condition:
        """Read a condition; `InputError` if it is none."""
        match = _CONDITION.fullmatch(text.strip())
        if match is None or not match["key"]:
            raise input_error("where", f'"{text}": {_EXPECTED}')
        value = match["value"].strip().strip('"')
        return cls(text, match["key"], match["comparison"], value)

    def holds(self, case: Mapping[str, Any], numbers: Mapping[str, Any] | None) -> bool | None:
        """Tell whether the condition holds for a run.

        Parameters
        ----------
        case
            The values of its case (`walkers.runs.case_text.flattened`). The condition holds if it
            holds for one of the keys that end in its key.
        numbers
            The numbers of its result, SI units; None if it has no result.

        Returns
        -------
        bool or None
            None if the run has neither such a key nor such a number.

        Raises
        ------
        InputError
            If the value is not one of the key or number.
        """
        answer = None
        for name, value in case.items():
            if f".{name}".endswith(f".{self.key}"):
                if self._holds_for(name, value):
                    return True
                answer = False
        if answer is None and numbers and self.key in numbers:
            return self._holds_for_number(numbers[self.key])
        return answer

    def _holds_for(self, name: str, value: Any) -> bool:
        """Whether the condition holds for a value of the case."""
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            is_in_si_units = self.value == str(value)
            return self._compare(value, None if is_in_si_units else quantity_kind(name))
        return self._holds_for_words([readable(name, value), str(value)])

    def _holds_for_number(self, number: Any) -> bool:
        """Whether the condition holds for a number of the result; False if it is not defined."""
        if number is None:
            return False
        if isinstance(number, (bool, str)):
            return self._holds_for_words([str(number)])
        return self._compare(number, _kind_of_number(self.key))

    def _holds_for_words(self, words: Sequence[str]) -> bool:
        """Whether the condition holds for a value that may be written in several ways."""
        if self.comparison not in ("=", "!="):
            message = f'"{self.text}": {words[0]} is no number: expected = or !='
            raise input_error("where", message)
        is_same = self.value.lower() in [word.lower() for word in words]
        return is_same == (self.comparison == "=")

    def _compare(self, value: float, kind: QuantityKind | None) -> bool:
        """Compare a value in SI units; `InputError` if that of the condition has another unit."""
        try:
            number = parse_quantity(self.value, kind) if kind else _plain_number(self.value)
        except ValueError as error:
            raise input_error("where", f'"{self.text}": {error}') from error
        return _COMPARISONS[self.comparison](value, number)


def _kind_of_number(name: str) -> QuantityKind | None:
    """The kind of quantity of a number of a result; None for numbers without a unit."""
    if not is_declared(name):
        return None
    quantity = declared(name)
    if quantity.unit in ("", "share"):
        return None
    unit, _ = unit_shown(quantity.unit)
    return QuantityKind("number", quantity.unit, f"1 {unit}", largest=inf)


def _plain_number(text: str) -> float:
    """A number without a unit; a number in per cent is a share."""
    digits = text.removesuffix("%").strip()
    try:
        number = float(digits)
    except ValueError as error:
        raise ValueError("expected a number without a unit") from error
    return number / 100.0 if text.endswith("%") else number
