"""Formulas as MathML, by docutils' own converter: no JavaScript, no fonts from elsewhere, nothing to install.

Systems have a font for mathematics, but for bare Linux ones: the STIX fonts that matplotlib brings stand in there.
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


# LaTeX takes 4 and 3 of \frac43, the converter 43 and what comes next.
_AMBIGUOUS = re.compile(r"\\[dt]?frac\s*\d|[\^_]\d\d|\\sqrt\s*\d\d")


def _mathml(node: nodes.Element, *, block: bool) -> str:
    if _AMBIGUOUS.search(node.astext()):
        LOG.warning("formula %r: write braces around the numbers", node.astext(), location=node)
    try:
        return tex2mathml(node.astext(), as_block=block)
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
    """Make the renderer known as ``mathml``."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("build-finished", _copy_fonts)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
