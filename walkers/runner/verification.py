"""Whether files are what a list of their checksums says: those of a finished run, or of an archive."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from walkers.inputs.errors import shortened
from walkers.inputs.text import printable
from walkers.runner.directory import CASE_NAME, SEGMENTS
from walkers.runner.files import read_json
from walkers.runner.manifest import MANIFEST_NAME, checksums

_SHOWN = (
    *(".png", ".pdf", ".svg", ".gif", ".mp4", ".html", ".htm"),
    *(".vtp", ".vtu", ".pvd", ".py", ".xyz", ".lammpstrj", ".csv"),
)
"""Suffixes of pictures, films, pages, files for ParaView (with their script) and exports: the program writes them on
demand and never reads them again."""
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
    told
        Names of the others: ``changed`` and ``missing`` ones; those ``not listed``; what is ``doubtful``, with the
        reason in brackets; and what was ``made since`` from the run (`made_since`): no result rests on it.
    left_out
        How many were left out of an archive on purpose.
    of_points
        Whether it is a sweep's: of its points rather than of files.
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
            f"  {kind:<10} {printable(shortened(name, _LONGEST_NAME))}"
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
    """Compare files with a list.

    Parameters
    ----------
    name
        Of what holds them.
    listed, now
        SHA-256 of files, as the list has them and, of those of them that can be read, as they are.
    there
        Names of all that is there.
    added
        Whether a name that is not listed may have been added since.
    left_out
        Names on the list that need not be there.
    doubtful
        What else is wrong, each with its reason.
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
