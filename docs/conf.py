"""Configuration of the site that ``make docs`` builds.

Its pages come from docs/, from the docstrings, and from the declarations of the program.
"""

from __future__ import annotations

import sys
import warnings
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE / "_ext")]

from walkers.runner.failures import UnauditedEngineWarning  # noqa: E402

# The engine that runs the examples may never have been audited.
warnings.simplefilter("ignore", UnauditedEngineWarning)

project = "granular-walkers"
author = "the authors of granular-walkers"
version = release = metadata.version("granular-walkers")
project_copyright = f"{author}. Version {version.split('+')[0]}, BSD-3-Clause"

extensions = [
    "numpydoc",
    "sphinx.ext.autodoc",
    "myst_parser",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "sphinxcontrib.bibtex",
    # The rest is in docs/_ext.
    "mathml",
    "generated",
    "texts",
]
exclude_patterns = ["_ext", "_templates", "examples", "gallery/**.ipynb", "joss"]
# Tables that pages include.
for _table in sorted((HERE / "figures").glob("*.md")):
    if _table.stem != "comparison":
        exclude_patterns.append(f"figures/{_table.name}")
default_role = "py:obj"
nitpicky = False

# GitHub shows the pages too: they are Markdown, links name files, and formulas stand in dollars.
myst_enable_extensions = ["dollarmath", "colon_fence", "attrs_block", "deflist"]
myst_heading_anchors = 4
myst_links_external_new_tab = False

# Nothing comes from the network: formulas become MathML, which browsers draw by themselves.
html_math_renderer = "mathml"
html_theme = "pydata_sphinx_theme"
html_title = "granular-walkers"
html_context = {"default_mode": "auto"}
html_static_path = ["_static"]
templates_path = ["_templates"]
html_css_files = ["walkers.css"]
html_show_sourcelink = False
html_copy_source = False
# A browser may not read other pages from disk; docs/_ext/texts.py gives the search their texts.
html_show_search_summary = False
html_search_scorer = str(HERE / "_static" / "scorer.js")
html_favicon = "_static/walker.svg"
html_theme_options = {
    "logo": {
        "text": "granular-walkers",
        "image_light": "_static/walker.svg",
        "image_dark": "_static/walker.svg",
    },
    "navbar_align": "left",
    "navbar_end": ["theme-switcher"],
    "header_links_before_dropdown": 6,
    "show_nav_level": 1,
    "show_toc_level": 2,
    "navigation_depth": 3,
    "footer_start": ["copyright"],
    "footer_end": ["project-links"],
    "secondary_sidebar_items": ["page-toc"],
}
# Pages without a section of their own need no list of its pages.
html_sidebars = {"index": [], "tutorial": [], "article": []}

autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_default_options = {"exclude-members": "model_config"}
numpydoc_show_class_members = False
copybutton_exclude = ".linenos, .gp, .go"

bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "unsrt"

sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "show_memory": False,
    "min_reported_time": 1000,
    "write_computation_times": False,  # its table of times would load scripts from the network
    "plot_gallery": True,
    "image_scrapers": ("pictures.scraper", "matplotlib"),  # docs/_ext
    "image_srcset": ["2x"],
    "reset_modules": ("pictures.use_style",),
}
# Annotations name classes that have no page of their own.
suppress_warnings = ["ref.python"]
