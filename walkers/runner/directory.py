"""Run directories: one a run, named by the case and by the hash of all that determines the run.

A run is made in ``<name>-<hash>.incomplete`` and renamed to ``<name>-<hash>`` when its manifest has been written, last:
a directory without a manifest is not a run, and a run that is made anew replaces the old one only when it has finished.
What the engine was given and wrote is in ``segments/0000``, ``segments/0001``, …; walkers have one unless their case
asks for more.
While it is made, the file ``<name>-<hash>.lock`` is locked, also by the engine itself (see `walkers.runner.locks`).
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import shutil
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from walkers.inputs.case import Case
from walkers.inputs.errors import shortened
from walkers.inputs.text import printable
from walkers.physics.laws import source_sha256
from walkers.runner.binary import Engine
from walkers.runner.failures import DiskFull, OutputGone
from walkers.runner.files import fsync_path, read_json, write_json
from walkers.runner.launch import EngineReport
from walkers.runner.manifest import FORMAT, MANIFEST_NAME, check_unchanged, checksums
from walkers.templates.deck import CONTENT_VERSION, DECK_NAME, LAYOUT_NAME, Deck, Segment
from walkers.templates.layout import Layout

CASE_NAME = "case.json"
FAILURE_NAME = "failure.json"
SEGMENTS = "segments"
FIRST_SEGMENT = Path(SEGMENTS) / "0000"
SEGMENT_NAME = "segment.json"
UNFINISHED = ".incomplete"
REPLACED = ".replaced"
_LONGEST_NAME = 80
_SHOWN = (
    *(".png", ".pdf", ".svg", ".gif", ".mp4", ".html", ".htm"),
    *(".vtp", ".vtu", ".pvd", ".py", ".xyz", ".lammpstrj", ".csv"),
)
"""Suffixes of pictures, films, pages, files for ParaView (with their script) and exports: the program writes them on
demand and never reads them again."""
_LONGEST_SHOWN = 300


# --- names ------------------------------------------------------------------------------------------------------------


def run_name(case: Case, engine: Engine) -> str:
    """Name of a run's directory: the case's name and 12 hex digits over resolved case, engine and the decks' version.

    The wording of a deck is not among it: a comment in a template leaves the runs that are there. The file of a law of
    the user's own is.
    """
    determinants = {"case": case.determinants(), "deck": CONTENT_VERSION, "engine": engine.sha256, "format": FORMAT}
    if own := source_sha256(case.liquid.law):
        determinants["law"] = own
    text = json.dumps(determinants, sort_keys=True, separators=(",", ":"))
    return f"{name_of(case.name)}-{hashlib.sha256(text.encode('utf-8', 'surrogateescape')).hexdigest()[:12]}"


def name_of(case_name: str) -> str:
    """A case's name as a run's begins with it."""
    return re.sub(r"[^\w.+-]+", "_", case_name)[:_LONGEST_NAME]


def is_run_name(name: str) -> bool:
    """Whether a directory may be a run's by its name: twelve hex digits at the end."""
    return re.fullmatch(r".+-[0-9a-f]{12}", name) is not None


def run_place(case: Case, engine: Engine, out: Path) -> Path:
    """Where the run of a case belongs."""
    return out / run_name(case, engine)


def unfinished(place: Path) -> Path:
    """Where the run of a place is made."""
    return place.with_name(place.name + UNFINISHED)


def holds_unfinished(directory: Path) -> bool:
    """Whether a directory has what that of an unfinished run has: its case, or nothing but what is there before it."""
    try:
        names = {path.name for path in directory.iterdir()}
    except OSError:  # not ours to read
        return False
    return CASE_NAME in names or all(name in (SEGMENTS, FAILURE_NAME) or name.startswith(".case.") for name in names)


# --- reading ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FinishedRun:
    """A run that has its manifest: its directory, and what that holds."""

    directory: Path

    @property
    def manifest(self) -> dict[str, Any]:
        """The manifest."""
        return read_json(self.directory / MANIFEST_NAME)

    @property
    def case(self) -> Case:
        """The resolved case."""
        return case_of(self.directory)

    @property
    def segments(self) -> list[Path]:
        """Directories of the segments, in their order."""
        return segment_directories(self.directory)

    @property
    def layout(self) -> Layout:
        """What the dumps of the first segment hold."""
        return layout_of(self.directory / FIRST_SEGMENT)


def case_of(directory: Path) -> Case:
    """The resolved case of a run directory.

    Raises
    ------
    OSError, ValueError
        If its ``case.json`` cannot be read, or of a finished run is not what it was.
    """
    check_unchanged(directory, [CASE_NAME])
    return Case.from_dict(read_json(directory / CASE_NAME))


def layout_of(segment: Path) -> Layout:
    """What the dumps of a segment hold.

    Raises
    ------
    OSError, ValueError, KeyError, TypeError
        If its ``layout.json`` cannot be read.
    """
    return Layout.from_dict(read_json(segment / LAYOUT_NAME))


def segment_directories(directory: Path) -> list[Path]:
    """The whole segments of a run, in their order."""
    return sorted(path for path in (directory / SEGMENTS).glob("[0-9]*") if not path.suffix)


def finished_run(directory: Path) -> FinishedRun | None:
    """The run in a directory, or None if it has no manifest."""
    return FinishedRun(directory) if (directory / MANIFEST_NAME).is_file() else None


def finished_places(out: Path) -> dict[str, Path]:
    """All finished runs of a folder: from their names to their directories."""
    places = [path.parent for path in sorted(out.glob(f"*/{MANIFEST_NAME}"))]
    return {place.name: place for place in places if not place.name.endswith((UNFINISHED, REPLACED))}


# --- writing ----------------------------------------------------------------------------------------------------------


def write_deck(deck: Deck, directory: Path, before: Path | None = None) -> None:
    """Write a deck, its files and its layout into a directory.

    A file that is the same in that of the segment ``before`` is linked to: the tables of a pile's bridges are larger
    than what a segment of it computes.
    """
    for name, text in {DECK_NAME: deck.text, **deck.files}.items():
        contents = text.encode("utf-8", "surrogateescape")
        if before is not None and (before / name).is_file() and (before / name).read_bytes() == contents:
            with suppress(OSError):  # a file system without links
                os.link(before / name, directory / name)
                continue
        (directory / name).write_bytes(contents)
    write_json(directory / LAYOUT_NAME, deck.layout.as_dict(), at_once=False)


def write_segment_record(
    directory: Path, segment: Segment, report: EngineReport, rms_velocity: float | None = None
) -> dict[str, Any]:
    """Write what a segment is and what it took into its directory, and return it."""
    record = {**vars(segment), **vars(report), "root_mean_square_velocity": rms_velocity}
    write_json(directory / SEGMENT_NAME, record, at_once=False)
    return record


def record_failure(incomplete: Path, failure: Exception) -> None:
    """Leave word of a failure in the directory of an unfinished run."""
    said = {"reason": type(failure).__name__, "message": str(failure), "lost": getattr(failure, "lost", 0)}
    with suppress(OSError):  # a full disk: the message reaches the user all the same
        write_json(incomplete / FAILURE_NAME, said)


@contextmanager
def room_on_disk(incomplete: Path, needed: int | None = None) -> Iterator[None]:
    """Turn the system's word for a full disk, to which so many bytes are still to be written, into a `DiskFull`.

    And that for a directory that was removed into an `OutputGone`.
    """
    try:
        yield
    except OSError as error:
        if error.errno == errno.ENOENT and not incomplete.exists():
            raise OutputGone(incomplete) from error
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise DiskFull(needed, shutil.disk_usage(incomplete.parent).free, incomplete) from error


def move_into_place(made: Path, place: Path) -> None:
    """Give a directory that has been made, and is safe on disk, its name, in exchange for one that has it already."""
    recover(place)
    replaced = place.with_name(place.name + REPLACED)
    if place.exists():
        place.rename(replaced)
    made.rename(place)
    fsync_path(place.parent)
    shutil.rmtree(replaced, ignore_errors=True)


def recover(place: Path) -> None:
    """Undo a replacement that was interrupted between its two renames; end one that was interrupted after them."""
    replaced = place.with_name(place.name + REPLACED)
    if not place.exists() and replaced.exists():
        replaced.rename(place)
    elif replaced.exists():
        shutil.rmtree(replaced)


# --- checking ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Verification:
    """What has become of the files of a run or an archive, or of the points of a sweep: how many are ``intact``.

    ``told`` are names of the others: ``changed`` and ``missing`` ones; those ``not listed``; what is ``doubtful``, with
    the reason in brackets; and what was ``made since`` from the run (`made_since`): no result rests on it.
    ``left_out`` is how many were left out of an archive on purpose.
    """

    name: str
    intact: int
    told: Mapping[str, Sequence[str]]
    left_out: int = 0
    of_points: bool = False

    @property
    def passed(self) -> bool:
        """Whether all that is listed is what it was, and nothing else is there that a result could rest on."""
        return not any(names for kind, names in self.told.items() if kind != "made since")

    def describe(self) -> str:
        """The outcome, and a line for each file that is not what it was, or is not listed."""
        told = f"{self.name}: {self.intact} {'points have their run' if self.of_points else 'files are what they were'}"
        left_out = f", {self.left_out} left out of the archive" if self.left_out else ""
        # Whoever made an archive chose its names, and may have put escape sequences into them.
        lines = [
            f"  {kind:<10} {printable(shortened(name, _LONGEST_SHOWN))}"
            for kind, names in self.told.items()
            for name in names
        ]
        return "\n".join([told + left_out, *lines])


def compare(
    name: str,
    listed: Mapping[str, str],
    now: Mapping[str, str],
    there: Iterable[str],
    *,
    added: Callable[[str], bool],
    left_out: Collection[str] = (),
    doubtful: Sequence[str] = (),
) -> Verification:
    """Compare the files of something with a list.

    Parameters
    ----------
    name, there
        Of what holds them, and of all that is there.
    listed, now
        SHA-256 of files, as the list has them and, of those of them that can be read, as they are.
    added
        Whether a name that is not listed may have been added since.
    left_out, doubtful
        Names on the list that need not be there; what else is wrong, each with its reason.
    """
    changed = [one for one, checksum in now.items() if checksum != listed[one]]
    others = sorted(set(there).difference(listed))
    told = {
        "changed": changed,
        "missing": [one for one in listed if one not in now and one not in left_out],
        "not listed": [one for one in others if not added(one)],
        "doubtful": doubtful,
        "made since": _by_folder(one for one in others if added(one)),
    }
    absent = sum(one in listed and one not in now for one in left_out)
    return Verification(name, len(now) - len(changed), told, left_out=absent)


def _by_folder(names: Iterable[str]) -> list[str]:
    """Files of the same folder as one, but those of the topmost: ``vtk`` holds one a frame."""
    folders = {name: name.rpartition("/")[0] for name in names}
    count = Counter(folders.values())
    told = (f"{one}/ ({count[one]} files)" if one and count[one] > 1 else name for name, one in folders.items())
    return list(dict.fromkeys(told))


def made_since(name: str) -> bool:
    """Whether what no list has counts as made from a run: by its relative path it is nothing that a result rests on.

    These are pictures, films, pages, files for ParaView, exports (by their suffixes), and hidden files. Nothing in
    ``segments`` is among them: each folder there is taken for a part of the run.
    """
    path = PurePosixPath(name)
    hidden = any(part.startswith(".") and part != ".." for part in path.parts)
    return SEGMENTS not in path.parts and (hidden or path.suffix.lower() in _SHOWN)


def files_below(folder: Path) -> list[str]:
    """Relative paths of all that is in a folder: files, folders that are empty (with a slash), links to folders."""
    found = []
    for path in folder.rglob("*"):
        name = path.relative_to(folder).as_posix()
        if path.is_symlink() or not path.is_dir():
            found.append(name)
        elif not any(path.iterdir()):
            found.append(f"{name}/")
    return sorted(found)


def verify_run(directory: Path) -> Verification:
    """Compare the files of a run directory with its manifest; what has none that can be read does not pass.

    The case file that an archive puts beside it may be there too.
    """
    name = directory.resolve().name
    try:
        contents = read_json(directory / MANIFEST_NAME)
        listed = {CASE_NAME: "", **contents["sha256"]}  # which every run has
        beside, left_out = f"{contents['name']}.toml", set(contents.get("left_out", ()))
        there = files_below(directory)
        now = checksums(directory, [one for one in there if one in listed and (directory / one).is_file()])
    except FileNotFoundError:
        return Verification(name, 0, {"missing": [MANIFEST_NAME]})
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        return Verification(name, 0, {"doubtful": [f"{MANIFEST_NAME} (it, or what it names, cannot be read: {error})"]})
    there.remove(MANIFEST_NAME)
    return compare(name, listed, now, there, added=lambda one: made_since(one) or one == beside, left_out=left_out)
