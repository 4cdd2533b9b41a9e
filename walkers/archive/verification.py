"""Whether a run, the runs of a sweep, or an archive are what they were.

Archives come from strangers: none is unpacked to be verified, and no file of one is read whole but its lists.
"""

from __future__ import annotations

import hashlib
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import IO
from urllib.parse import unquote

from walkers.archive.crate import METADATA_NAME, PREVIEW_NAME
from walkers.inputs.errors import refused
from walkers.runner.directory import Verification, compare, files_below, made_since, verify_run
from walkers.runner.files import json_object
from walkers.runner.manifest import MANIFEST_NAME
from walkers.sweeps.record import PARSL, RECORD_NAME, read_record, states

SUMS_NAME = "sha256sums.txt"
"""In an archive: as ``sha256sum -c`` reads it."""
_MOST_TIMES = 100
"""A zip file that unpacks to more than this many times its size is refused; those of runs to some five times."""
_MOST_ANYWAY = 1 << 28
"""Bytes: what unpacks to less is read in a second."""


def verify(path: Path) -> list[Verification]:
    """Compare files with what manifests, or the checksums of an archive, say of them.

    All that is listed must be there and unchanged, and nothing else be there. What was made from finished runs since,
    and is read by nobody, is named and no failure: pictures, films, pages, files for ParaView, exports and hidden files
    (`walkers.runner.directory.made_since`), but in a zip file, which is written whole. The lists of an archive
    (its checksums, its RO-Crate, the manifests of its runs) must agree. A sweep's directory is held to the same rule;
    its record has a checksum in archives only.

    Parameters
    ----------
    path
        A run directory, a sweep's directory, an archive (.zip), or a folder that one was unpacked into.

    Returns
    -------
    list of Verification
        One a run or archive; of a sweep that of its points and those of its finished runs.

    Raises
    ------
    InputError
        If it is none of these, cannot be read, or unpacks to far more than it has bytes.
    """
    if (path / RECORD_NAME).is_file():
        return _verify_sweep(path)
    if (path / SUMS_NAME).is_file():
        folder = path.resolve()
        there = files_below(folder)
        files = [name for name in there if (folder / name).is_file()]
        return [_verify_archive(folder, there, files, lambda name: (folder / name).open("rb"), made_since)]
    if (path / MANIFEST_NAME).is_file():
        return [verify_run(path)]
    if path.is_file():
        return [_verify_zip(path)]
    told = f"expected a run directory (with a {MANIFEST_NAME}), a sweep's ({RECORD_NAME}), or an archive ({SUMS_NAME})"
    raise refused(path, told)


def _verify_sweep(directory: Path) -> list[Verification]:
    record = read_record(directory)
    found = states(record)
    lacking = [
        f"{run} ({state.status}: point {number})"
        for number, (run, state) in enumerate(zip(record.runs, found, strict=True))
        if state.status not in ("finished", "not needed")
    ]
    runs = [state.directory for state in found if state.directory and state.status == "finished"]
    there = [name for name in files_below(directory) if name != RECORD_NAME and not name.startswith(f"{PARSL}/")]
    beside = (f"{record.name}.toml", "table.parquet")  # of an archive: nothing is read from them
    files = compare(record.name, {}, {}, there, added=lambda name: made_since(name) or name in beside)
    points = replace(files, intact=len(runs), told={**files.told, "missing": lacking}, of_points=True)
    return [points, *map(verify_run, dict.fromkeys(runs))]


def _verify_zip(path: Path) -> Verification:
    try:
        with zipfile.ZipFile(path) as archive:
            unpacked, size = sum(member.file_size for member in archive.infolist()), path.stat().st_size
            if unpacked > max(_MOST_TIMES * size, _MOST_ANYWAY):
                told = f"expected at most {_MOST_TIMES} times its {size / 1e6:.1f} MB"
                raise refused(path, f"unpacks to {unpacked / 1e6:.0f} MB, {told}")
            files = [name for name in archive.namelist() if not name.endswith("/")]
            folders = {f"{parent}/" for name in files for parent in Path(name).parents}
            there = [name for name in archive.namelist() if name not in folders]
            return _verify_archive(path, there, files, archive.open, lambda _: False)
    except (OSError, zipfile.BadZipFile, RuntimeError, ValueError) as error:
        raise refused(path, f"not a zip file that can be read ({error})") from error


def _verify_archive(
    path: Path,
    there: Sequence[str],
    files: Sequence[str],
    opened: Callable[[str], IO[bytes]],
    added: Callable[[str], bool],
) -> Verification:
    """Compare what is in an archive, of which some are files that can be opened, with its lists."""
    if SUMS_NAME not in files:
        raise refused(path, f"no archive of runs: it has no {SUMS_NAME}")
    listed = _listed(path, opened)
    now = {place: _checksum(opened, place) for place in files if place in listed}
    doubtful = [] if any(_is_manifest(place) for place in listed) else [f"{SUMS_NAME} (it lists no run)"]
    by_run: dict[str, set[str]] = {}
    for place in listed:
        by_run.setdefault("/".join(place.split("/")[:2]), set()).add(place)
    for place, checksum in now.items():
        if checksum != listed[place] or not (place == METADATA_NAME or _is_manifest(place)):
            continue
        try:
            with opened(place) as file:
                said, beside = _said(place, file.read())
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            doubtful.append(f"{place} (cannot be read: {error})")
            continue
        own = set(listed) if place == METADATA_NAME else by_run[place.removesuffix(f"/{MANIFEST_NAME}")]
        odd = [one for one in own.union(said).difference(beside) if said.get(one) != listed.get(one)]
        doubtful += [f"{one} ({SUMS_NAME} and {place} disagree)" for one in sorted(odd)]
    listed.setdefault(METADATA_NAME, "")  # which every archive has
    return compare(path.name, listed, now, set(there) - {SUMS_NAME}, added=added, doubtful=doubtful)


def _checksum(opened: Callable[[str], IO[bytes]], place: str) -> str:
    """SHA-256 of a file; none if what a zip file has of it is damaged."""
    try:
        with opened(place) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()  # type: ignore[arg-type]
    except (zipfile.BadZipFile, zlib.error, EOFError):
        return ""


def _is_manifest(place: str) -> bool:
    return place.count("/") == 2 and place.endswith(f"/{MANIFEST_NAME}")


def _said(place: str, contents: bytes) -> tuple[Mapping[str, str], tuple[str, str]]:
    """Checksums that another list of an archive has, by places, and the places of which it says nothing."""
    list_ = json_object(contents, place)
    if place == METADATA_NAME:
        files = [entity for entity in list_["@graph"] if entity.get("@type") == "File"]
        return {unquote(one["@id"]): one.get("sha256") for one in files}, (METADATA_NAME, PREVIEW_NAME)
    folder, left_out = place.removesuffix(MANIFEST_NAME), list_.get("left_out", ())
    said = {f"{folder}{name}": one for name, one in list_["sha256"].items() if name not in left_out}
    return said, (place, f"{folder}{list_['name']}.toml")


def _listed(path: Path, opened: Callable[[str], IO[bytes]]) -> dict[str, str]:
    """The checksums of an archive's list, by the places of the files."""
    with opened(SUMS_NAME) as file:
        text = file.read().decode("utf-8", "replace")
    listed: dict[str, str] = {}
    for line in text.removesuffix("\n").split("\n"):
        checksum, _, place = line.partition("  ")
        if len(checksum) != hashlib.sha256().digest_size * 2 or not place or place in listed:
            raise refused(path, f"{SUMS_NAME}: expected a checksum and a path, each path once, found {line[:80]!r}")
        listed[place] = checksum
    return listed
