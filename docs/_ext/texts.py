"""The texts of all pages in a script of the search page.

The search shows them below its results. A browser may not read other pages from disk, which is how
Sphinx gets them.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

_FILE = "texts.js"
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


def _load(
    app: Sphinx, page: str, _template: str, _context: dict[str, Any], _doctree: object
) -> None:
    """Let the search page load the script."""
    if page == "search":
        app.add_js_file(_FILE)


def _write(app: Sphinx, error: Exception | None) -> None:
    """Write the script once a site is built."""
    if error is not None or app.builder.format != "html":
        return
    texts = {}
    for page in app.env.found_docs:
        text = _COMMENT.sub("", app.env.get_doctree(page).astext())
        texts[page] = " ".join(text.split())
    script = Path(app.outdir) / "_static" / _FILE
    script.write_text(f"const TEXTS = {json.dumps(texts)};\n", "utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect the extension to Sphinx."""
    app.connect("html-page-context", _load)
    app.connect("build-finished", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
