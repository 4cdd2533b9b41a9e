"""Whether the files of a finished run are what they were when it was finished."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.inputs.errors import InputError, Problem
from walkers.runner.files import read_json
from walkers.runner.manifest import MANIFEST_NAME, checksums


@dataclass(frozen=True)
class Verification:
    """What has become of the files of something.

    Attributes
    ----------
    name
        Of the run, the ensemble or the archive.
    intact
        How many files are what they were.
    changed, missing
        Names of those that differ and that are gone.
    left_out
        How many were left out of an archive on purpose.
    by_size
        Whether only sizes could be compared, the run being older than checksums are.
    of_points
        Whether it is a sweep's: of its points rather than of files.
    """

    name: str
    intact: int
    changed: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    left_out: int = 0
    by_size: bool = False
    of_points: bool = False

    @property
    def passed(self) -> bool:
        """Whether nothing has changed and nothing is missing."""
        return not (self.changed or self.missing)

    def describe(self) -> str:
        """The outcome, and a line for each file that is not what it was."""
        told = f"{self.name}: {self.intact} {'points have their run' if self.of_points else 'files are what they were'}"
        if self.by_size:
            told += " by their sizes (the run is older than checksums)"
        if self.left_out:
            told += f", {self.left_out} left out of the archive"
        return "\n".join(
            [
                told,
                *(f"  changed    {name}" for name in self.changed),
                *(f"  missing    {name}" for name in self.missing),
            ]
        )


def verify_run(directory: Path, *, own: bool = False) -> Verification:
    """Compare the files of a run directory, or of an ensemble's, with its manifest.

    Parameters
    ----------
    directory
        With a manifest.
    own
        Of an ensemble: leave out its runs, which have manifests of their own.

    Raises
    ------
    InputError
        If there is no manifest, or it cannot be read.
    """
    try:
        manifest = read_json(directory / MANIFEST_NAME)
        sizes, sums = manifest["files"], manifest.get("sha256")
        left_out = set(manifest.get("left_out", ()))
        names = [name for name in (sizes if sums is None else sums) if not (own and "/" in name)]
        there = [name for name in names if name not in left_out and (directory / name).is_file()]
        now: Mapping[str, Any] = (
            {name: (directory / name).stat().st_size for name in there} if sums is None else checksums(directory, there)
        )
        wanted: Mapping[str, Any] = sizes if sums is None else sums
        changed = tuple(name for name in there if now[name] != wanted[name])
    except FileNotFoundError as error:
        told = f"not a finished run: expected a folder with a {MANIFEST_NAME}"
        raise InputError(str(directory), [Problem("", None, told)]) from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        told = f"the run's {MANIFEST_NAME}, or what it names, cannot be read ({error})"
        raise InputError(str(directory), [Problem("", None, told)]) from error
    return Verification(
        name=directory.resolve().name,
        intact=len(there) - len(changed),
        changed=changed,
        missing=tuple(name for name in names if name not in there and name not in left_out),
        left_out=len(left_out.intersection(names)),
        by_size=sums is None,
    )
