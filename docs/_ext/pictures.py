"""Pictures in the gallery whose files a block of an example leaves as its last value, as a notebook shows them."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

from walkers.api import Pictures


def scraper(_block: Any, variables: dict[str, Any], configuration: dict[str, Any]) -> str:
    """Copy the pictures of `walkers`, or an image of IPython, beside the pages; show them once."""
    last = variables["example_globals"].get("___")  # of sphinx-gallery
    files = last if isinstance(last, Pictures) else [getattr(last, "filename", None)]
    places = []
    for file in filter(None, files):
        place = Path(next(variables["image_path_iterator"])).with_suffix(Path(file).suffix)
        places.append(str(shutil.copy(file, place)))
        variables["example_globals"]["___"] = None  # not as text too
    return str(
        figure_rst(places, configuration["src_dir"], srcsetpaths=[{0: place} for place in places])
    )
