"""Cases in physical units, read from TOML and validated.

They stand on the laws alone (`walkers.physics`) and know nothing of the engine's language.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

chosen_library: Path | None = None
"""The library file of ``--library``; None: ``library.toml`` beside the case."""
