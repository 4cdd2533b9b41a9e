"""Whether the files of a finished run are what they were when it was finished."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, NoReturn

from walkers.runner.directory import CASE_NAME, SEGMENTS
from walkers.runner.files import read_json
from walkers.runner.manifest import MANIFEST_NAME, checksums

_SHOWN = (
    *(".png", ".pdf", ".svg", ".gif", ".mp4", ".html", ".htm"),
    *(".vtp", ".vtu", ".pvd", ".py", ".xyz", ".lammpstrj", ".csv"),
)
"""Suffixes of pictures, films, pages, files for ParaView (with their script) and exports: the program writes them on
demand and never reads them again."""
_MOST_LINES = 1000
_LONGEST_NAME = 300


@dataclass(frozen=True)
class Verification:
    """What has become of the files of something.

    Attributes
    ----------
    name
        Of the run or the archive.
    intact
        How many files are what they were.
    changed, missing
        Names of those that differ and that are gone.
    unlisted
        Names of those that are there, that no list has, and that are not of the kinds of ``since``.
    doubtful
        Names of those that cannot be compared, or on which the lists disagree, each with the reason in brackets.
    since
        Names of what was made from the run since (`made_since`): no result rests on it.
    unread
        Lists that are what they were, and too large to be compared with the others, each with the reason in brackets.
    left_out
        How many were left out of an archive on purpose.
    of_points
        Whether it is a sweep's: of its points rather than of files.
    """

    name: str
    intact: int
    changed: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    unlisted: tuple[str, ...] = ()
    doubtful: tuple[str, ...] = ()
    since: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()
    left_out: int = 0
    of_points: bool = False

    @property
    def passed(self) -> bool:
        """Whether all that is listed is what it was, and nothing else is there that a result could rest on."""
        return not (self.changed or self.missing or self.unlisted or self.doubtful)

    def describe(self) -> str:
        """The outcome, and a line for each file that is not what it was, or is not listed."""
        told = f"{self.name}: {self.intact} {'points have their run' if self.of_points else 'files are what they were'}"
        if self.left_out:
            told += f", {self.left_out} left out of the archive"
        kinds = {
            **{"changed": self.changed, "missing": self.missing, "not listed": self.unlisted},
            **{"doubtful": self.doubtful, "not read": self.unread, "made since": _by_folder(self.since)},
        }
        return "\n".join([told, *(line for word, names in kinds.items() for line in _lines(word, names))])


def _lines(word: str, names: Collection[str]) -> list[str]:
    lines = [f"  {word:<10} {_shown(name)}" for name in list(names)[:_MOST_LINES]]
    return [*lines, f"  {word:<10} {len(names) - _MOST_LINES} more"] if len(names) > _MOST_LINES else lines


def _shown(name: str) -> str:
    """A name as it may be printed: whoever made an archive chose it, and may have put escape sequences into it."""
    short = name if len(name) <= _LONGEST_NAME else f"{name[:_LONGEST_NAME]}…"
    return short if short.isprintable() else ascii(short)


def _by_folder(names: Iterable[str]) -> list[str]:
    """Files of the same folder as one, but those of the topmost: ``vtk`` holds one a frame."""
    folders = {name: name.rpartition("/")[0] for name in names}
    count = Counter(folders.values())
    told = (f"{one}/ ({count[one]} files)" if one and count[one] > 1 else name for name, one in folders.items())
    return list(dict.fromkeys(told))


def made_since(name: str) -> bool:
    """Whether a file that no list has counts as made from a run: by its name it is nothing that a result rests on.

    These are pictures, films, pages, files for ParaView, exports (by their suffixes), and hidden files. Nothing in
    ``segments`` is among them: each folder there is taken for a part of the run.

    Parameters
    ----------
    name
        Path relative to the run, or to what the run is in.
    """
    path = PurePosixPath(name)
    hidden = any(part.startswith(".") and part != ".." for part in path.parts)
    return SEGMENTS not in path.parts and (hidden or path.suffix.lower() in _SHOWN)


def is_within(name: object) -> bool:
    """Whether a name of a list is a plain path to something below the folder that the list is for."""
    return (
        isinstance(name, str)
        and name not in ("", ".")
        and not name.startswith("/")
        and ".." not in name.split("/")
        and PurePosixPath(name).as_posix() == name
    )


def files_below(folder: Path, without: Collection[str] = ()) -> list[str]:
    """Relative paths of all that is in a folder: files, folders that are empty (with a slash), links to folders.

    Parameters
    ----------
    folder
        Links to folders in it are not followed.
    without
        Names of folders in it that are not looked into.

    Raises
    ------
    OSError
        If a folder cannot be read.
    """
    found: list[str] = []

    def fail(error: OSError) -> NoReturn:
        raise error

    for place, folders, names in os.walk(folder, onerror=fail):
        here = Path(place)
        if here == folder:
            folders[:] = [name for name in folders if name not in without]
        links = [name for name in folders if (here / name).is_symlink()]
        found += [(here / name).relative_to(folder).as_posix() for name in (*names, *links)]
        if here != folder and not names and not folders:
            found.append(f"{here.relative_to(folder).as_posix()}/")
    return sorted(found)


@dataclass(frozen=True)
class Listed:
    """What a manifest says of the files beside it.

    Attributes
    ----------
    sizes
        Of the files, bytes.
    sums
        Their SHA-256.
    left_out
        Those that an archive was made without.
    case_file
        What an archive calls the case as it was given, beside the manifest.
    """

    sizes: Mapping[str, Any]
    sums: Mapping[str, Any]
    left_out: frozenset[str]
    case_file: str

    @property
    def names(self) -> list[str]:
        """Of all files that it lists."""
        return list(dict.fromkeys([*self.sizes, *self.sums]))


def listed_by(manifest: Mapping[str, Any]) -> Listed:
    """Read what a manifest says of files.

    Raises
    ------
    ValueError, TypeError, AttributeError
        If it is no manifest, or names what is not below its folder.
    """
    lacking = [key for key in ("name", "files", "sha256") if key not in manifest]
    if lacking:
        raise ValueError(f"expected the key {lacking[0]}")
    listed = Listed(
        {**manifest["files"]},
        {**manifest["sha256"]},
        frozenset(manifest.get("left_out", ())),
        f"{manifest['name']}.toml",
    )
    outside = [name for name in listed.names if not is_within(name)]
    if outside:
        raise ValueError(f"expected paths below it, found {_shown(outside[0])!r}")
    return listed


def verify_run(directory: Path) -> Verification:
    """Compare the files of a run directory with its manifest.

    Passed is what has all files of the manifest as they were, and none else but what was made from them since
    (`made_since`) and the case file that an archive puts beside it.

    Parameters
    ----------
    directory
        With a manifest; what has none, or one that cannot be read, does not pass.
    """
    name = directory.resolve().name
    try:
        listed = listed_by(read_json(directory / MANIFEST_NAME))
        return _verified(name, directory, listed)
    except FileNotFoundError as error:
        return Verification(name, 0, missing=(Path(error.filename or MANIFEST_NAME).name,))
    except (OSError, ValueError, TypeError, AttributeError) as error:
        return Verification(name, 0, doubtful=(f"{MANIFEST_NAME} (it, or what it names, cannot be read: {error})",))


def _verified(run: str, directory: Path, listed: Listed) -> Verification:
    names, sizes, sums = listed.names, listed.sizes, listed.sums
    there = {name: (directory / name).stat().st_size for name in names if (directory / name).is_file()}
    # What has another size is not read: it may be of any size by now.
    whole = [name for name, size in there.items() if size == sizes.get(name, size)]
    now = checksums(directory, [name for name in whole if name in sums])
    changed = {name for name in there if name not in whole or (name in now and now[name] != sums[name])}
    odd = [name for name in names if (name in sizes) != (name in sums)]
    gone = [name for name in names if name not in there and name not in listed.left_out]
    if CASE_NAME not in names and not (directory / CASE_NAME).is_file():
        gone.append(CASE_NAME)
    known = {*names, MANIFEST_NAME}
    others = [name for name in files_below(directory) if name not in known]
    since = [name for name in others if made_since(name) or name == listed.case_file]
    return Verification(
        name=run,
        intact=len(there.keys() - changed - set(odd)),
        changed=tuple(name for name in there if name in changed),
        missing=tuple(gone),
        unlisted=tuple(name for name in others if name not in since),
        doubtful=tuple(f"{name} ({MANIFEST_NAME} has its size or its checksum, not both)" for name in odd),
        since=tuple(since),
        left_out=len(listed.left_out.intersection(names) - there.keys()),
    )
