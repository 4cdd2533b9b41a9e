"""The texts of all pages in a script of the search page, because a browser may not read other pages from disk."""

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
    if page == "search":
        app.add_js_file(_FILE)


def _write(app: Sphinx, error: Exception | None) -> None:
    if error is None and app.builder.format == "html":
        texts = (
            (name, _COMMENT.sub("", app.env.get_doctree(name).astext()))
            for name in app.env.found_docs
        )
        pages = {name: " ".join(text.split()) for name, text in texts}
        (Path(app.outdir) / "_static" / _FILE).write_text(
            f"const TEXTS = {json.dumps(pages)};\n", "utf-8"
        )


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("html-page-context", _load)
    app.connect("build-finished", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
