"""Folders that an export fills: a new one, an empty one, or that of an earlier export."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from walkers.errors import input_error
from walkers.files import scratch_folder


def files_of_earlier_export(place: Path, names: Collection[str]) -> list[Path]:
    """Files of an earlier export in a folder.

    Parameters
    ----------
    place
        The folder, which need not exist.
    names
        Names of all files that an export has there.

    Raises
    ------
    InputError
        If there is anything else in the folder, or it is a file or a symbolic link.
    """
    expected = "expected a new or empty folder, or a folder that walkers export has written"
    if place.is_symlink():
        raise input_error(place, f"{expected}; it is a symbolic link")
    if place.is_file():
        raise input_error(place, f"{expected}; it is a file")
    if not place.is_dir():
        return []
    files = sorted(place.iterdir())
    for path in files:
        if path.name not in names:
            raise input_error(place, f"{expected}; it holds {path.name}")
    return files


@contextmanager
def filled_folder(destination: Path, earlier_files: Iterable[Path], prefix: str) -> Iterator[Path]:
    """Yield a folder to be filled, which takes the place of the destination at the end.

    Parameters
    ----------
    destination
        The final folder. Missing folders above it are made.
    earlier_files
        Its files, which are removed (`files_of_earlier_export`).
    prefix
        Start of the name of the folder until then (`walkers.files.scratch_folder`).

    Raises
    ------
    OSError
        If a file cannot be written; it names a file, or the destination.
    """
    place = destination.absolute()
    place.parent.mkdir(parents=True, exist_ok=True)
    try:
        with scratch_folder(place.parent, prefix) as new:
            yield new
            for path in earlier_files:
                path.unlink()
            new.rename(place)  # refused by the system if the folder is not empty
    except OSError as error:
        # If a disk is full, the error does not name the file.
        error.filename = error.filename or str(destination)
        raise
