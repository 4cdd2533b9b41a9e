"""Warnings that point to the line of the user that caused them."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from types import FrameType

_PACKAGE = Path(__file__).parent


def warn_user(message: str, category: type[Warning] = UserWarning) -> None:
    """Warn as from the line that called this package, however deep the call is.

    Parameters
    ----------
    message
        What the user should know.
    category
        Class of the warning.
    """
    level = 2  # of the caller of this function, as `warnings.warn` counts
    level_of_user = level
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        if _PACKAGE in Path(frame.f_code.co_filename).parents:
            level_of_user = level + 1
        frame = frame.f_back
        level += 1
    warnings.warn(message, category, stacklevel=level_of_user)
