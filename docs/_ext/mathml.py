"""Formulas as MathML, by the converter of docutils, without JavaScript and fonts from the network.

On systems without a font for mathematics, such as bare Linux, the STIX fonts of matplotlib are
used.
"""

from __future__ import annotations

import re
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
_AMBIGUOUS = re.compile(r"\\[dt]?frac\s*\d|[\^_]\d\d|\\sqrt\s*\d\d")
"""LaTeX reads ``\\frac43`` as 4/3, the converter as 43 over what follows."""

_FUNCTIONS = r"(\\(?:sin|cos|tan|ln|log|exp|operatorname\{\w+\})(?:\^\d)?)"
_SPACED = (
    (re.compile(rf"(?<=[\w)}}])\s*{_FUNCTIONS}"), r"\\,\1"),
    (re.compile(rf"{_FUNCTIONS}\s*(?=\\(?!left|,)|[A-Za-z\d])"), r"\1\\,"),
)
"""Where LaTeX sets spaces, before a function and after it, but the converter none."""


def _mathml(node: nodes.Element, *, block: bool) -> str:
    """A formula as MathML, as a block or within a line; warns if the converter misreads it."""
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
    """Write a formula within a line."""
    translator.body.append(_mathml(node, block=False))
    raise nodes.SkipNode


def _block(translator: Any, node: nodes.math_block) -> None:
    """Write a formula in a line of its own."""
    translator.body.append(translator.starttag(node, "div", CLASS="math"))
    translator.body.append(_mathml(node, block=True) + "</div>\n")
    raise nodes.SkipNode


def _copy_fonts(app: Sphinx, error: Exception | None) -> None:
    """Copy the STIX fonts into a site that has been built."""
    if error is not None or app.builder.format != "html":
        return
    for name in ("STIXGeneral.ttf", "STIXGeneralItalic.ttf", "STIXGeneralBol.ttf"):
        font = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name
        if font.is_file():
            copy_asset(font, app.outdir / "_static")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer ``mathml``."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("build-finished", _copy_fonts)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
