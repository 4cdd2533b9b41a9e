"""What a study gives: a chapter of docs/explanation/validation.md."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Chapter:
    """A chapter of docs/explanation/validation.md.

    Attributes
    ----------
    name
        For ``walkers validate``.
    title
        Its heading.
    text
        Markdown below the heading: what was compared, with citations and DOIs, tables, what agrees, and each
        disagreement explained or left open. A picture is referred to as ``![…](figures/validation-NAME.png)``.
    figures
        The pictures by the NAME of their file.
    numbers
        What the text states, for ``--json``.
    failed
        Statements that were expected to hold and do not; empty where all is as it was expected to be.
    """

    name: str
    title: str
    text: str
    figures: Mapping[str, Figure] = field(default_factory=dict)
    numbers: Mapping[str, Any] = field(default_factory=dict)
    failed: tuple[str, ...] = ()
