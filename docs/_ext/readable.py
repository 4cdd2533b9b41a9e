"""Docstrings as they are written here made what Sphinx can read; formulas as MathML, by docutils' own converter.

No JavaScript, no fonts from elsewhere, nothing to install. Systems have a font for mathematics, but for bare Linux
ones: the STIX fonts that matplotlib brings stand in there.
"""

from __future__ import annotations

import inspect
import re
import types
from pathlib import Path
from typing import Any

import matplotlib
from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.fileutil import copy_asset

LOG = logging.getLogger(__name__)
_LITERAL = re.compile(r"(``.*?``)")
_AMBIGUOUS = re.compile(r"\\[dt]?frac\s*\d|[\^_]\d\d|\\sqrt\s*\d\d")
"""LaTeX takes 4 and 3 of ``\\frac43``, the converter 43 and what comes next."""
_FUNCTIONS = r"(\\(?:sin|cos|tan|ln|log|exp|operatorname\{\w+\})(?:\^\d)?)"
_SPACED = (
    (re.compile(rf"(?<=[\w)}}])\s*{_FUNCTIONS}"), r"\\,\1"),
    (re.compile(rf"{_FUNCTIONS}\s*(?=\\(?!left|,)|[A-Za-z\d])"), r"\1\\,"),
)
"""LaTeX sets spaces before a function and between it and its argument, the converter none."""


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
        parts = _LITERAL.split(line)
        escaped = "".join(part if part.startswith("``") else part.replace("|", "\\|") for part in parts)
        text.append(line if literal or ">>>" in line else escaped)
    lines[:] = text


def _is_foreign(_app: Sphinx, _what: str, _name: str, it: Any, _skip: bool, _options: Any) -> bool | None:
    """Leave out what a module has imported or named anew: its documentation is not ours, nor always readable."""
    named = inspect.isclass(it) or isinstance(it, types.GenericAlias)
    return True if named and not str(it.__module__).startswith("walkers") else None


def _mathml(node: nodes.Element, *, block: bool) -> str:
    if _AMBIGUOUS.search(node.astext()):
        LOG.warning("formula %r: write braces around the numbers", node.astext(), location=node)
    text = node.astext()
    for pattern, spaced in _SPACED:
        text = pattern.sub(spaced, text)
    try:
        return tex2mathml(text, as_block=block)
    except MathError as error:
        LOG.warning("formula %r: %s", node.astext(), error, location=node)
        return f"<code>{node.astext()}</code>"


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(_mathml(node, block=False))
    raise nodes.SkipNode


def _block(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(translator.starttag(node, "div", CLASS="math"))
    translator.body.append(_mathml(node, block=True) + "</div>\n")
    raise nodes.SkipNode


def _copy_fonts(app: Sphinx, error: Exception | None) -> None:
    for name in ("STIXGeneral.ttf", "STIXGeneralItalic.ttf", "STIXGeneralBol.ttf"):
        font = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name
        if error is None and app.builder.format == "html" and font.is_file():
            copy_asset(font, app.outdir / "_static")


def setup(app: Sphinx) -> dict[str, bool]:
    """Docstrings before numpydoc, which sorts the sections; the renderer is known as ``mathml``."""
    app.connect("autodoc-process-docstring", _readable, priority=400)
    app.connect("autodoc-skip-member", _is_foreign)
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("build-finished", _copy_fonts)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
