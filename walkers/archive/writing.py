"""Write an archive: one zip file with the files of a run or a sweep, checksums and descriptions."""

from __future__ import annotations

import hashlib
import io
import re
import shutil
import zipfile
from collections.abc import Mapping, Sequence
from datetime import datetime
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from walkers.archive.crate import METADATA_NAME, PAPER, Author, describe_crate
from walkers.archive.verification import SUMS_NAME
from walkers.errors import refused
from walkers.extras import require
from walkers.inputs.toml import toml_bytes
from walkers.regular_files import open_regular
from walkers.runner.directory import CASE_NAME, case_of, name_of
from walkers.runner.files import beside, checksum, json_bytes
from walkers.runner.manifest import MANIFEST_NAME, FileChanged, read_manifest
from walkers.sweeps.table import RECORD_NAME, read_record, states
from walkers.text import printable, rendered

RUNS = "runs"
"""Folder of the run directories in an archive: the default folder of the program."""
_ROLES: Mapping[str, Sequence[str]] = {
    "case": (CASE_NAME, "*.toml"),
    "record": (MANIFEST_NAME, RECORD_NAME),
    "dump": ("beads.bin", "bridges.*.txt", "state.restart"),
    "deck": ("walker.lig", "layout.json", "deck.json", "law.py", "run.sh", "scale.awk", "*.txt"),
    "table": ("table.csv", "*.parquet"),
    "result": ("result.json", "accuracy.json"),
}
"""Roles of files in the actions of the crate, by their names; the first that fits. Others are output of the engine."""


class File(NamedTuple):
    """A file of an archive: source or contents, SHA-256, and role in the actions of the crate."""

    source: Path | bytes
    sha256: str
    role: str

    @classmethod
    def of(cls, place: str, source: Path | bytes, sha256: str | None = None) -> File:
        """A file, whose checksum is computed if no manifest has it."""
        if sha256 is None:
            sha256 = hashlib.sha256(source).hexdigest() if isinstance(source, bytes) else checksum(source)
        name = Path(place).name
        roles = (role for role, names in _ROLES.items() if any(fnmatch(name, pattern) for pattern in names))
        return cls(source, sha256, next(roles, "output"))

    def open(self) -> BinaryIO:
        """The contents, to be read."""
        return io.BytesIO(self.source) if isinstance(self.source, bytes) else open_regular(self.source)


class Contents(NamedTuple):
    """Contents of an archive: name, title, manifests of the runs by their folders, and files by their places."""

    name: str
    title: str
    manifests: Mapping[str, dict[str, Any]]
    files: Mapping[str, File]

    @property
    def finished(self) -> str:
        """End of the last run, ISO 8601."""
        return max(str(manifest["finished"]) for manifest in self.manifests.values())


def write_archive(
    directory: str | Path,
    to: Path | None = None,
    *,
    dumps: bool = True,
    authors: Sequence[Author] = (),
    licence: str = "CC-BY-4.0",
) -> Path:
    """Pack a finished run, or a sweep whose runs are all finished, into an RO-Crate; an older file is replaced.

    The ``licence`` is an SPDX identifier. Without ``dumps``, tables and results are included all the same. `InputError`
    if something is unusable or unfinished; `FileChanged` if a file differs from its manifest.
    """
    require("archive")
    _check(authors, licence)
    contents = contents_of(Path(directory), dumps=dumps)
    to = Path(f"{contents.name}.zip") if to is None else to
    if to.suffix != ".zip" or to.is_dir():
        raise refused("to", f"expected the name of a .zip file, not {to}")
    by = printable(", ".join(author.name for author in authors))
    about: dict[str, Any] = {"contents": contents, "by": by, "licence": licence, "paper": PAPER, "sums": SUMS_NAME}
    about["left_out"] = any("left_out" in manifest for manifest in contents.manifests.values())
    described = {
        METADATA_NAME: json_bytes(describe_crate(contents, authors, licence)),
        "README.md": rendered("walkers.archive", "README.md.j2", **about).encode(),
    }
    files = {**{place: File.of(place, text) for place, text in described.items()}, **contents.files}
    sums = "".join(f"{file.sha256}  {place}\n" for place, file in files.items()).encode()
    date = datetime.fromisoformat(contents.finished).timetuple()[:6]  # of all files, for the same bytes again
    with beside(to) as new, zipfile.ZipFile(new, "w") as archive:
        for place in contents.manifests:
            folder = zipfile.ZipInfo(f"{place}/", date)
            folder.external_attr = 0o40755 << 16 | 0x10
            archive.writestr(folder, b"")
        for place, file in {SUMS_NAME: File.of(SUMS_NAME, sums), **files}.items():
            _write(archive, zipfile.ZipInfo(place, date), file)
    return to


def _check(authors: Sequence[Author], licence: str) -> None:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9.+-]*", licence):
        raise refused("licence", f"expected an SPDX identifier such as CC-BY-4.0, not {licence}")
    for author in authors:
        if not author.name.strip():
            raise refused("author", "expected a name")
        if author.orcid is not None and not re.fullmatch(r"\d{4}-\d{4}-\d{4}-\d{3}[\dX]", author.orcid):
            raise refused("orcid", f"expected an ORCID such as 0000-0002-1825-0097, found {author.orcid}")


def _write(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, file: File) -> None:
    """Write a file, and compare the written bytes with its checksum."""
    entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o100644 << 16
    with file.open() as source, archive.open(entry, "w", force_zip64=True) as copy:
        shutil.copyfileobj(source, copy)
    with archive.open(entry) as written:
        if hashlib.file_digest(written, "sha256").hexdigest() != file.sha256:  # type: ignore[arg-type]
            raise FileChanged(
                f"{entry.filename} has changed since the run was finished: walkers check files lists all changes"
            )


def contents_of(directory: Path, *, dumps: bool = True) -> Contents:
    """Contents of the archive of a finished run or a sweep; without the engine's dumps if ``dumps`` is false."""
    from walkers.sweeps.table import encoded, load

    if not (directory / RECORD_NAME).is_file():
        place, manifest, files = _packed(directory, dumps)
        return Contents(Path(place).name, case_of(directory).title, {place: manifest}, files)
    record = read_record(directory)
    points = states(record)
    unfinished = sum(state.status != "finished" for state in points)
    if unfinished:
        message = f"{unfinished} of {len(points)} points are not finished; see: walkers list {directory}"
        raise refused(directory, message)
    name = name_of(record.directory.name)
    place, table = f"{RUNS}/{name}", load(record.directory)
    table["run"] = [f"{RUNS}/{Path(run).name}" if run else "" for run in table["run"]]  # not where this machine has it
    sources: dict[str, Path | bytes] = {f"{place}/{RECORD_NAME}": record.directory / RECORD_NAME}
    sources |= {f"{place}/table.{form}": encoded(table, form) for form in ("csv", "parquet")}
    sources |= {f"{place}/{name}.toml": toml_bytes(record.sweep.file)}
    files, manifests = {path: File.of(path, source) for path, source in sources.items()}, {}
    for run in dict.fromkeys(state.directory for state in points if state.directory is not None):
        place, manifests[place], of_run = _packed(run, dumps)
        files |= of_run
    return Contents(name, record.sweep.title, manifests, files)


def _packed(directory: Path, dumps: bool) -> tuple[str, dict[str, Any], dict[str, File]]:
    """Place and manifest of a run, and its files by place: files of the manifest, and the case file if it is known."""
    manifest, record = read_manifest(directory), directory / MANIFEST_NAME
    case, place = case_of(directory), f"{RUNS}/{directory.resolve().name}"
    files = {name: File.of(name, directory / name, manifest["sha256"].get(name)) for name in manifest["files"]}
    before = set(manifest.get("left_out", ()))
    left_out = {name for name, file in files.items() if name in before or (file.role == "dump" and not dumps)}
    sources: dict[str, Path | bytes] = (
        {f"{name_of(case.name)}.toml": toml_bytes(case.document)} if case.document else {}
    )
    sources[MANIFEST_NAME] = record
    if left_out - before:
        manifest["left_out"] = sorted(left_out)
        sources[MANIFEST_NAME] = json_bytes(manifest)
    files |= {name: File.of(name, source) for name, source in sources.items()}
    return place, manifest, {f"{place}/{name}": file for name, file in files.items() if name not in left_out}
