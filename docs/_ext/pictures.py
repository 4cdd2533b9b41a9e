"""Pictures that an example of the gallery writes to a file: a block assigns the path to ``picture``."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

_SHOWN = "picture"


def scraper(_block: Any, variables: dict[str, Any], configuration: dict[str, Any]) -> str:
    """Copy the PNG or GIF that a block has written beside the pages, and show it once."""
    picture = variables["example_globals"].pop(_SHOWN, None)
    if picture is None:
        return ""
    place = Path(next(variables["image_path_iterator"])).with_suffix(Path(picture).suffix)
    shutil.copy(picture, place)
    return str(figure_rst([str(place)], configuration["src_dir"], srcsetpaths=[{0: str(place)}]))
