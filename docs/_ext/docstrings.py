"""Docstrings as they are written here, made what Sphinx can read: formulas and tables set by indentation, |x|."""

from __future__ import annotations

import inspect
import re
import types
from typing import Any

from sphinx.application import Sphinx

_LITERAL = re.compile(r"(``.*?``)")


def _readable(_app: Sphinx, what: str, _name: str, _it: Any, _options: Any, lines: list[str]) -> None:
    """Show indented lines before the first section as they stand, and take no |x| for a substitution."""
    sections = (number - 1 for number, line in enumerate(lines) if set(line.strip()) == {"-"})
    head = next(sections, len(lines))
    if what == "module" and head < len(lines):  # a heading would take all that the module has below itself
        references = [f"| {line}" if line.strip() else "" for line in lines[head + 2 :]]
        lines[head:] = [f".. rubric:: {lines[head]}", "", *references]
        head = len(lines)
    text: list[str] = []
    literal = False
    for number, line in enumerate(lines):
        indented = line.startswith("    ") and number < head
        if indented and not literal and number and not lines[number - 1].strip():
            text += ["::", ""]
            literal = True
        elif line.strip() and not indented:
            literal = False
        text.append(line if literal or ">>>" in line else _escaped(line))
    lines[:] = text


def _escaped(line: str) -> str:
    parts = _LITERAL.split(line)
    return "".join(part if part.startswith("``") else part.replace("|", "\\|") for part in parts)


def _is_foreign(_app: Sphinx, _what: str, _name: str, it: Any, _skip: bool, _options: Any) -> bool | None:
    """Leave out what a module has imported or named anew: its documentation is not ours, nor always readable."""
    named = inspect.isclass(it) or isinstance(it, types.GenericAlias)
    return True if named and not str(it.__module__).startswith("walkers") else None


def setup(app: Sphinx) -> dict[str, bool]:
    """Before numpydoc, which sorts the sections."""
    app.connect("autodoc-process-docstring", _readable, priority=400)
    app.connect("autodoc-skip-member", _is_foreign)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
