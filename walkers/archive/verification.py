"""Check whether the files of a run, a sweep or an archive are unchanged.

Files are compared with the checksums in the manifests of runs, or in the list of an archive.
"""

from __future__ import annotations

import hashlib
import zipfile
import zlib
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from walkers.archive.contents import RECORD_FILE, SUMS_NAME
from walkers.errors import input_error
from walkers.runner.manifest import MANIFEST_NAME, checksums, read_manifest
from walkers.runner.run_directory import CASE_NAME, REQUESTED_NAME, SEGMENTS
from walkers.sweeps.record import RECORD_NAME, read_sweep_record, states
from walkers.text import printable

_NOT_COMPARED = (MANIFEST_NAME, SUMS_NAME, REQUESTED_NAME)
"""Files that no list contains: the lists themselves, and a note for listings."""
_READ_SUFFIXES = (".json", ".parquet", ".txt", ".lig", ".bin")
"""Suffixes of the files of a run that the program reads again."""
_ZIP_ERRORS = (OSError, EOFError, RuntimeError, ValueError, zipfile.BadZipFile, zlib.error)
"""Errors of reading a zip file that is damaged, encrypted or compressed in an unknown way."""


class Finding(StrEnum):
    """What can be found of a file, in the words that are printed before its name."""

    CHANGED = "changed"
    MISSING = "missing"
    NOT_LISTED = "not listed"
    DOUBTFUL = "doubtful"
    MADE_SINCE = "made since"
    LEFT_OUT = "left out"


HARMLESS = (Finding.MADE_SINCE, Finding.LEFT_OUT)
"""Findings that cannot influence a result."""


@dataclass(frozen=True)
class Verification:
    """Outcome for a run, an archive or the points of a sweep.

    Attributes
    ----------
    name
        Name of the run, archive or sweep.
    summary
        The outcome in words, such as ``12 files are unchanged``.
    findings
        Names of files, or of points of a sweep, by what was found.
    """

    name: str
    summary: str
    findings: Mapping[Finding, Sequence[str]]

    @property
    def passed(self) -> bool:
        """Whether all listed files are unchanged and no other file could influence a result."""
        return not any(names for finding, names in self.findings.items() if finding not in HARMLESS)

    def describe(self) -> str:
        """The outcome, and one line for each finding."""
        lines = [f"{self.name}: {self.summary}"]
        for finding, names in self.findings.items():
            # Names in archives may contain escape sequences.
            lines += [f"  {finding:<10} {printable(name)}" for name in names]
        return "\n".join(lines)


def verify(path: Path) -> list[Verification]:
    """Compare a run, the runs of a sweep, or an archive with the checksums in manifests or lists.

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
        return _verify_sweep(path)
    sums = path / SUMS_NAME
    if sums.is_file():
        return [_verify_folder(path, _listed_checksums(path, sums.read_bytes()))]
    if (path / MANIFEST_NAME).is_file():
        return [_verify_run(path)]
    if path.is_file():
        return [_verify_zip(path)]
    raise input_error(
        path,
        f"expected a run directory (with a {MANIFEST_NAME}), a sweep's ({RECORD_NAME}), "
        f"or an archive ({SUMS_NAME})",
    )


def _verify_sweep(directory: Path) -> list[Verification]:
    """One verification of the points of a sweep, and one of each finished run."""
    record = read_sweep_record(directory)
    directories = []
    missing = []
    for number, (run, state) in enumerate(zip(record.runs, states(record), strict=True)):
        if state.status != "finished":
            missing.append(f"{run} ({state.status}: point {number})")
        elif state.directory is not None:  # which a finished point always has
            directories.append(state.directory)
    summary = f"{len(directories)} points have a run"
    points = Verification(record.sweep.name, summary, {Finding.MISSING: missing})
    # Several points may have the same run.
    verified_runs = [_verify_run(directory) for directory in dict.fromkeys(directories)]
    return [points, *verified_runs]


def _verify_run(directory: Path) -> Verification:
    """Compare a run with its manifest; a run without a readable manifest does not pass."""
    try:
        manifest = read_manifest(directory)
        # Every run has a case, also if its manifest does not list it.
        listed = {CASE_NAME: "", **manifest["sha256"]}
        return _verify_folder(directory, listed, manifest.get("left_out", ()))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        doubt = f"{MANIFEST_NAME} (it, or a file in its list, cannot be read: {error})"
        name = directory.resolve().name
        return Verification(name, "files are not compared", {Finding.DOUBTFUL: [doubt]})


def _verify_folder(
    folder: Path, listed: Mapping[str, str], left_out: Collection[str] = ()
) -> Verification:
    """Compare the files of a folder with a list.

    Parameters
    ----------
    folder
        A run directory, or the folder of an unpacked archive.
    listed
        SHA-256 of the listed files, by their paths relative to the folder.
    left_out
        Listed files that may be missing.
    """
    files = _files_in(folder)
    readable = [name for name, path in files.items() if name in listed and path.is_file()]
    sums = checksums(folder, readable)
    changed = [name for name, checksum in sums.items() if checksum != listed[name]]
    missing = [name for name in listed if name not in sums and name not in left_out]
    not_listed = []
    made_since = []
    for name in files:
        if name in listed or name in _NOT_COMPARED:
            continue
        if _may_be_read(name):
            not_listed.append(name)
        else:
            made_since.append(name)
    findings: dict[Finding, Sequence[str]] = {
        Finding.CHANGED: changed,
        Finding.MISSING: missing,
        Finding.NOT_LISTED: not_listed,
        Finding.MADE_SINCE: _with_new_folders(made_since, listed),
        Finding.LEFT_OUT: [name for name in left_out if name not in sums],
    }
    summary = f"{len(sums) - len(changed)} files are unchanged"
    return Verification(folder.resolve().name, summary, findings)


def _files_in(folder: Path) -> dict[str, Path]:
    """Files, links and empty folders below a folder, by their relative paths in order."""
    files = {}
    for path in sorted(folder.rglob("*")):
        is_folder = path.is_dir() and not path.is_symlink()
        if not is_folder or not any(path.iterdir()):
            files[path.relative_to(folder).as_posix()] = path
    return files


def _may_be_read(name: str) -> bool:
    """Whether a file that is not listed could be read as a part of a run.

    All files in the folder of segments could.
    """
    return SEGMENTS in Path(name).parts or name.endswith(_READ_SUFFIXES)


def _with_new_folders(names: Sequence[str], listed: Collection[str]) -> list[str]:
    """Names of files; a folder without listed files stands for all files in it."""
    listed_folders = {""}
    for name in listed:
        listed_folders.add(_folder_of(name))
    shown = []
    for name in names:
        folder = _folder_of(name)
        shown.append(name if folder in listed_folders else f"{folder}/")
    return list(dict.fromkeys(shown))


def _folder_of(name: str) -> str:
    """The folder of a relative path; empty without one."""
    return name.rpartition("/")[0]


def _verify_zip(path: Path) -> Verification:
    """Compare the files of an archive that is not unpacked with the checksums in it."""
    changed = []
    missing = []
    try:
        with zipfile.ZipFile(path) as archive:
            entries = Counter(archive.namelist())
            if SUMS_NAME not in entries:
                raise input_error(path, f"expected an archive, which has a {SUMS_NAME}")
            listed = _listed_checksums(path, archive.read(SUMS_NAME))
            for name, checksum in listed.items():
                if name not in entries:
                    missing.append(name)
                elif _checksum_in(archive, name) != checksum:
                    changed.append(name)
    except _ZIP_ERRORS as error:
        raise input_error(path, f"expected an archive, a zip file ({error})") from error
    not_listed = [name for name in entries if name not in listed and name != SUMS_NAME]
    # Of two files of the same name, programs that unpack take either one.
    duplicates = [name for name, count in entries.items() if count > 1]
    findings = {
        Finding.CHANGED: changed,
        Finding.MISSING: missing,
        Finding.NOT_LISTED: not_listed + duplicates,
    }
    unchanged = len(listed) - len(changed) - len(missing)
    return Verification(path.name, f"{unchanged} files are unchanged", findings)


def _listed_checksums(path: Path, text: bytes) -> dict[str, str]:
    """The checksums in the list of an archive, by the paths of the files.

    Every archive has a record, also if the list does not have it. `InputError` names ``path``, the
    archive, if the list cannot be read.
    """
    listed = {RECORD_FILE: ""}
    for line in text.decode("utf-8", "replace").splitlines():
        checksum, _, place = line.partition("  ")
        if len(checksum) != 64 or not place:
            expected = f"{SUMS_NAME}: expected a checksum and a path, found {line[:80]!r}"
            raise input_error(path, expected)
        listed[place] = checksum
    return listed


def _checksum_in(archive: zipfile.ZipFile, name: str) -> str | None:
    """SHA-256 of a file in an archive; None if it cannot be read."""
    try:
        with archive.open(name) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()  # type: ignore[arg-type]
    except _ZIP_ERRORS:
        return None
