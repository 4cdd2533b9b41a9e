"""Width, size of texts and title of the figure of a sweep, as a journal wants them."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from walkers.errors import check_limits, input_error
from walkers.inputs.units import LENGTH, parse_quantity
from walkers.postprocess.show.drawing import TWO_COLUMNS
from walkers.sweeps.figure_options import FigureOptions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_TITLE = "none"
"""Value of the option ``title`` that leaves it out."""
_METRES_PER_INCH = 0.0254
_NARROWEST = 0.03
"""Smallest width, m."""
_WIDEST = 0.5
"""Largest width, m."""
_SMALLEST_TEXT = 4.0
"""Smallest size of texts, points."""
_LARGEST_TEXT = 24.0
"""Largest size of texts, points."""
_USUAL_TEXT = 8.0
"""Usual size of titles and labels, points; tick labels and legends have 7."""
_NARROWEST_PANEL = 2.2
"""Smallest width of a panel with its labels, inches."""
_LEAST_ASPECT = 0.62
"""Least height of axes over their width in a figure whose width is chosen."""
_STEPS = 3
"""Number of layouts in which a figure gets its height."""
_TEXTS = (
    "font.size",
    "axes.titlesize",
    "axes.labelsize",
    "xtick.labelsize",
    "ytick.labelsize",
    "legend.fontsize",
    "legend.title_fontsize",
    "figure.titlesize",
)
"""Matplotlib's names of the sizes of texts."""


@dataclass(frozen=True)
class FigureFormat:
    """Width, size of texts and title of a figure.

    Attributes
    ----------
    width
        Width, inches.
    is_chosen
        Whether the user has chosen the width.
    font_size
        Size of all texts, points; None: those of the project's style.
    title
        Title of the user; None: that of the sweep. An empty text: no title.
    """

    width: float = TWO_COLUMNS
    is_chosen: bool = False
    font_size: float | None = None
    title: str | None = None

    @classmethod
    def of_options(cls, options: FigureOptions) -> FigureFormat:
        """The format that options ask for; `InputError` if a size is beyond its limits."""
        check_limits("font_size", options.font_size, _SMALLEST_TEXT, _LARGEST_TEXT)
        width = TWO_COLUMNS
        if options.width is not None:
            width = _width_of(options.width) / _METRES_PER_INCH
        title = "" if options.title == NO_TITLE else options.title
        return cls(width, options.width is not None, options.font_size, title)

    def in_style(self) -> AbstractContextManager[None]:
        """A context in which the texts that are drawn have their size."""
        from matplotlib import rc_context

        sizes: dict[Any, float] = {}
        if self.font_size is not None:
            sizes = dict.fromkeys(_TEXTS, self.font_size)
        return rc_context(sizes)

    def letters(self, per_inch: float) -> int:
        """Letters of a line as wide as the figure, of which so many take an inch as usual."""
        size = self.font_size or _USUAL_TEXT
        return round(per_inch * self.width * _USUAL_TEXT / size)

    def most_columns(self, usual: int) -> int:
        """Largest number of panels side by side, as usual or fewer."""
        return max(1, min(usual, int(self.width / _NARROWEST_PANEL)))

    def finish(self, figure: Figure) -> None:
        """Give tick labels their size, and a figure of a chosen width its height.

        The axes are at least `_LEAST_ASPECT` as high as wide, however many lines title and legend
        have.
        """
        if self.font_size is not None:
            for axes in figure.axes:
                axes.tick_params(which="both", labelsize=self.font_size)
        if not self.is_chosen:
            return
        for _ in range(_STEPS):
            figure.draw_without_rendering()
            panels = [axes for axes in figure.axes if axes.axison]
            rows = max(axes.get_subplotspec().rowspan.stop for axes in panels)  # type: ignore[union-attr]
            missing = max(_missing_height(axes.get_position(), figure) for axes in panels)
            figure.set_figheight(figure.get_figheight() + rows * missing)


def _missing_height(box: Any, figure: Figure) -> float:
    """Height that axes with these bounds (of 1) lack, inches; negative if they are too high."""
    width, height = figure.get_size_inches()
    return float(_LEAST_ASPECT * box.width * width - box.height * height)


def _width_of(text: str) -> float:
    """The width in m; `InputError` if it is not a length within its limits."""
    expected = f'"{text}": expected a width of 30mm to 500mm, such as 85mm'
    try:
        width = parse_quantity(text, LENGTH)
    except ValueError as error:
        raise input_error("width", expected) from error
    if not _NARROWEST <= width <= _WIDEST:
        raise input_error("width", expected)
    return width
