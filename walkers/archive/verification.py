"""Check whether the files of a run, a sweep or an archive are unchanged."""

from __future__ import annotations

import hashlib
import zipfile
import zlib
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from walkers.archive.contents import RECORD_FILE, SUMS_NAME
from walkers.errors import input_error
from walkers.runner.manifest import MANIFEST_NAME, checksums, read_manifest
from walkers.runner.run_directory import CASE_NAME, SEGMENTS
from walkers.sweeps.record import RECORD_NAME, read_sweep_record, states
from walkers.text import printable

_READ = (".json", ".parquet", ".txt", ".lig", ".bin")
"""Suffixes of the files of a run that are read again."""
_HARMLESS = ("made since", "left out")
_UNREADABLE = (OSError, EOFError, RuntimeError, ValueError, zipfile.BadZipFile, zlib.error)
"""Errors of reading a zip file that is damaged, encrypted or compressed in an unknown way."""


@dataclass(frozen=True)
class Verification:
    """Files of a run or an archive, or points of a sweep: a summary, and names by kind, such as ``changed``."""

    name: str
    summary: str
    findings: Mapping[str, Sequence[str]]

    @property
    def passed(self) -> bool:
        """Whether all listed files are unchanged and no unlisted file could influence a result."""
        return not any(names for kind, names in self.findings.items() if kind not in _HARMLESS)

    def describe(self) -> str:
        """The outcome, and one line for each file that has changed or is not listed."""
        lines = [f"{self.name}: {self.summary}"]
        for kind, names in self.findings.items():  # names in archives may contain escape sequences
            lines += [f"  {kind:<10} {printable(name)}" for name in names]
        return "\n".join(lines)


def verify(path: Path) -> list[Verification]:
    """Compare a run, the runs of a sweep, or an archive with the checksums in manifests or in the archive.

    Parameters
    ----------
    path
        The directory of a run or a sweep, an archive, or the folder of an unpacked archive.

    Returns
    -------
    list of Verification
        One of a run or an archive. Of a sweep, one of its points, and one of each finished run.

    Raises
    ------
    InputError
        If the path is none of these, or the list of checksums of the archive cannot be read.
    """
    if (path / RECORD_NAME).is_file():
        record = read_sweep_record(path)
        points = states(record)
        missing = [
            f"{run} ({state.status}: point {number})"
            for number, (run, state) in enumerate(zip(record.runs, points, strict=True))
            if state.status != "finished"
        ]
        runs = [
            state.directory for state in points if state.directory and state.status == "finished"
        ]
        whole = Verification(
            record.sweep.name, f"{len(runs)} points have a run", {"missing": missing}
        )
        return [whole, *map(_of_run, dict.fromkeys(runs))]
    if (path / SUMS_NAME).is_file():
        return [_compared(path, _listed(path, (path / SUMS_NAME).read_bytes()))]
    if (path / MANIFEST_NAME).is_file():
        return [_of_run(path)]
    if path.is_file():
        return [_of_zip(path)]
    kinds = f"a run directory (with a {MANIFEST_NAME}), a sweep's ({RECORD_NAME}), or an archive ({SUMS_NAME})"
    raise input_error(path, f"expected {kinds}")


def _of_run(directory: Path) -> Verification:
    """Compare a run with its manifest; a run without a readable manifest does not pass."""
    try:
        manifest = read_manifest(directory)
        listed = {CASE_NAME: "", **manifest["sha256"]}  # every run has a case
        return _compared(directory, listed, manifest.get("left_out", ()))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        doubt = f"{MANIFEST_NAME} (it, or a file in its list, cannot be read: {error})"
        return Verification(
            directory.resolve().name, "files are not compared", {"doubtful": [doubt]}
        )


def _listed(path: Path, text: bytes) -> dict[str, str]:
    """The checksums in the list of an archive, by the paths of the files; every archive has a record."""
    listed = {RECORD_FILE: ""}
    for line in text.decode("utf-8", "replace").splitlines():
        checksum, _, place = line.partition("  ")
        if len(checksum) != 64 or not place:
            raise input_error(
                path, f"{SUMS_NAME}: expected a checksum and a path, found {line[:80]!r}"
            )
        listed[place] = checksum
    return listed


def _of_zip(path: Path) -> Verification:
    """Compare the files of an archive that is not unpacked with the checksums in it."""
    try:
        with zipfile.ZipFile(path) as archive:
            if SUMS_NAME not in archive.namelist():
                raise input_error(path, f"expected an archive, which has a {SUMS_NAME}")
            listed = _listed(path, archive.read(SUMS_NAME))
            entries = Counter(archive.namelist())
            changed = [
                name
                for name, checksum in listed.items()
                if name in entries and _checksum_in(archive, name) != checksum
            ]
    except _UNREADABLE as error:
        raise input_error(path, f"expected an archive, a zip file ({error})") from error
    unlisted = [name for name in entries if name not in listed and name != SUMS_NAME]
    # Of two files of a name, programs that unpack take one or the other.
    unlisted += [name for name, number in entries.items() if number > 1]
    findings = {
        "changed": changed,
        "missing": [name for name in listed if name not in entries],
        "not listed": unlisted,
    }
    unchanged = len(listed) - len(changed) - len(findings["missing"])
    return Verification(path.name, f"{unchanged} files are unchanged", findings)


def _checksum_in(archive: zipfile.ZipFile, name: str) -> str | None:
    """SHA-256 of a file in an archive; None if it cannot be read."""
    try:
        with archive.open(name) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()  # type: ignore[arg-type]
    except _UNREADABLE:
        return None


def _compared(
    folder: Path, listed: Mapping[str, str], left_out: Collection[str] = ()
) -> Verification:
    """Compare the files of a folder with their listed checksums, by relative path."""
    files = _files_in(folder)
    readable = [name for name, path in files.items() if name in listed and path.is_file()]
    sums = checksums(folder, readable)
    changed = [name for name, checksum in sums.items() if checksum != listed[name]]
    doubted, new = [], []
    for name in files:
        if name in listed or name in (MANIFEST_NAME, SUMS_NAME):
            continue
        if _may_be_read(name):
            doubted.append(name)
        else:
            new.append(name)
    findings = {
        "changed": changed,
        "missing": [name for name in listed if name not in sums and name not in left_out],
        "not listed": doubted,
        "made since": _with_new_folders(new, listed),
        "left out": [name for name in left_out if name not in sums],
    }
    return Verification(
        folder.resolve().name, f"{len(sums) - len(changed)} files are unchanged", findings
    )


def _files_in(folder: Path) -> dict[str, Path]:
    """Files, links and empty folders below a folder, by their relative paths in order."""
    files = {}
    for path in sorted(folder.rglob("*")):
        is_folder = path.is_dir() and not path.is_symlink()
        if not is_folder or not any(path.iterdir()):
            files[path.relative_to(folder).as_posix()] = path
    return files


def _may_be_read(name: str) -> bool:
    """Whether a file that is not listed could be read as a part of a run, as all in the folder of segments."""
    return SEGMENTS in Path(name).parts or name.endswith(_READ)


def _with_new_folders(names: Sequence[str], listed: Collection[str]) -> list[str]:
    """Names of files; a folder without listed files stands for all files in it."""
    listed_folders = {"", *(name.rpartition("/")[0] for name in listed)}
    shown = []
    for name in names:
        parent = name.rpartition("/")[0]
        shown.append(name if parent in listed_folders else f"{parent}/")
    return list(dict.fromkeys(shown))
