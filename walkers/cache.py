"""The program's folder in the user's cache."""

from __future__ import annotations

from pathlib import Path

from platformdirs import user_cache_path

_NOWHERE = Path("/proc/no-home")
"""A folder that nobody can make."""


def cache_folder() -> Path:
    """Path of the folder, without symbolic links; it may not exist, or be impossible to make."""
    try:
        return user_cache_path("granular-walkers").resolve()
    except RuntimeError:  # neither XDG_CACHE_HOME nor HOME, and a user whom the system does not know
        return _NOWHERE


def make_cache_folder(name: str = "") -> Path:
    """Make the folder, which nobody but the user can enter, or a folder in it; `OSError` if that is not possible."""
    folder = cache_folder()
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    (folder / name).mkdir(exist_ok=True)
    return folder / name
