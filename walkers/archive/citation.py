"""Who made runs, under which licence they are given away, and the paper that they go back to."""

from __future__ import annotations

from dataclasses import dataclass

PAPER = "https://doi.org/10.48550/arXiv.1003.1623"
PAPER_PROPERTIES = {
    "@type": "ScholarlyArticle",
    "name": "Self-assembled granular walkers",
    "author": "Z. S. Khan, A. Steinberger, R. Seemann, S. Herminghaus",
    "datePublished": "2010",
    "identifier": PAPER,
    "url": "https://arxiv.org/abs/1003.1623",
}
LICENCES = {
    "CC-BY-4.0": ("https://creativecommons.org/licenses/by/4.0/", "Creative Commons Attribution 4.0 International"),
    "CC0-1.0": ("https://creativecommons.org/publicdomain/zero/1.0/", "Creative Commons Zero 1.0 Universal"),
    "CC-BY-SA-4.0": (
        "https://creativecommons.org/licenses/by-sa/4.0/",
        "Creative Commons Attribution Share Alike 4.0 International",
    ),
    "BSD-3-Clause": ("https://opensource.org/license/bsd-3-clause", 'BSD 3-Clause "New" or "Revised" License'),
}
"""By their SPDX identifiers: addresses and names."""


@dataclass(frozen=True)
class Author:
    """Somebody who made the runs: name, and ORCID (``0000-0002-1825-0097``) or None."""

    name: str
    orcid: str | None = None
