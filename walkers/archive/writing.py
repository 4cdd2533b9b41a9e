"""Write an archive: one zip file with the files of a run or a sweep, checksums and descriptions."""

from __future__ import annotations

import hashlib
import io
import re
import shlex
import time
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.archive.crate import LICENCES, METADATA_NAME, PAPER, PREVIEW_NAME, Author, describe_crate
from walkers.archive.verification import SUMS_NAME, verify
from walkers.errors import InputError, Problem, WalkersError, refused
from walkers.extras import require
from walkers.postprocess.report.page import fill
from walkers.runner.directory import CASE_NAME, case_of, name_of
from walkers.runner.files import beside, checksum, json_bytes
from walkers.runner.manifest import MANIFEST_NAME, read_manifest
from walkers.sweeps.table import RECORD_NAME, SweepRecord, read_record, states

_STORED = ("/", ".parquet", ".png", ".mp4")
"""Suffixes of names that are not compressed again, and of folders."""
_CHUNK_BYTES = 1 << 20
_MOMENT = "%Y-%m-%dT%H:%M:%SZ"
RUNS = "runs"
"""Folder of the run directories in an archive: the default folder of the program."""
_MEANINGS = {
    CASE_NAME: ("case", "the resolved case: every number that determines the run, SI units"),
    MANIFEST_NAME: ("record", "provenance: versions, machine, times, and checksums of all files"),
    RECORD_NAME: ("record", "the points of the sweep: varied keys, derived quantities, names of the runs"),
    "result.json": ("result", "the result of the run, SI units"),
    "accuracy.json": ("result", "numerical errors of the result, SI units"),
    "walker.lig": ("deck", "the deck: input script of the engine"),
    "law.py": ("deck", "the file of the user's bridge law"),
    "bridges.txt": ("deck", "forces of each bridge against its gap, which the engine reads"),
    "loads.txt": ("deck", "gravity and drive of each bead, if they differ between beads"),
    "run.sh": ("deck", "script that runs the deck by hand"),
    "layout.json": ("deck", "columns of the dumps; which bead belongs to which walker"),
    "engine.log": ("output", "the log of the engine"),
    "segment.json": ("output", "first and last step of the segment, and its cost"),
    "beads.bin": ("dump", "positions, velocities and spins of the beads, LIGGGHTS binary dump; columns in layout.json"),
    "bridges.pairs.txt": ("dump", "bridges between beads, frame by frame, text"),
    "bridges.walls.txt": ("dump", "bridges between beads and walls, frame by frame, text"),
    "state.restart": ("dump", "restart file of the engine, from which the next segment continues"),
    "table.csv": ("table", "the table of the sweep, one row per point, units in the header"),
    "table.parquet": ("table", "the table of the sweep, one row per point, units and meanings in the field metadata"),
}
_GIVEN = ("case", "the case file, including changes by --set")
_SWEEP = ("record", "the original sweep file")
_REST = ("output", "other output of the engine")


class ArchiveRefused(WalkersError):
    """A run whose files have changed since it was finished."""


@dataclass(frozen=True)
class ArchiveOptions:
    """Options of an archive: with or without dumps (tables and results are included), authors, one of `LICENCES`."""

    dumps: bool = True
    authors: Sequence[Author] = ()
    licence: str = "CC-BY-4.0"


def write_archive(directory: str | Path, to: Path | None = None, options: ArchiveOptions | None = None) -> Path:
    """Pack a finished run, or a sweep whose runs are all finished, into an RO-Crate.

    The default file is ``NAME.zip`` in the current directory; an older file is replaced. `InputError` if it is
    no run or sweep, is not finished, or an option is invalid; `ArchiveRefused` if a file differs from its manifest.
    """
    require("archive")
    directory, options = Path(directory), options or ArchiveOptions()
    _check(options)
    found = [one for one in verify(directory) if not one.of_points]  # `contents_of` asks for all points
    if not all(one.passed for one in found):
        message = "\n".join(one.describe() for one in found if not one.passed)
        raise ArchiveRefused(f"{directory} is not archived, files have changed:\n{message}")
    contents = contents_of(directory, dumps=options.dumps)
    to = Path(f"{contents.name}.zip") if to is None else to
    if to.suffix != ".zip" or to.is_dir():
        raise refused("to", f"expected the name of a .zip file, not {to}")
    metadata = json_bytes(describe_crate(contents, options.authors, options.licence))
    about = [item(METADATA_NAME, metadata), item(PREVIEW_NAME, _preview(contents, options))]
    sums = "".join(f"{one.sha256}  {one.place}\n" for one in [*contents.items, *about])
    moment = time.strptime(contents.finished, _MOMENT)[:6]  # of all files, for the same bytes again
    with beside(to) as new, zipfile.ZipFile(new, "w") as archive:
        items = [*about, item(SUMS_NAME, sums.encode("utf-8")), *contents.items]
        folders = [f"{parent}/" for one in items for parent in reversed(Path(one.place).parents) if parent != Path()]
        for place in dict.fromkeys(folders):
            archive.writestr(_info(place, moment), b"")
        for one in items:
            _write(archive, one, moment)
    return to


def _check(options: ArchiveOptions) -> None:
    if options.licence not in LICENCES:
        message = f"expected one of {', '.join(LICENCES)}"
        raise refused("licence", f"{message}, not {options.licence}")
    for author in options.authors:
        if not author.name.strip():
            raise refused("author", "expected a name")
        if author.orcid is not None and not _is_orcid(author.orcid):
            raise refused("orcid", f"expected an ORCID such as 0000-0002-1825-0097, found {author.orcid}")


def _is_orcid(text: str) -> bool:
    """Whether the last of its sixteen digits checks the others (ISO 7064, mod 11-2)."""
    if not re.fullmatch(r"\d{4}-\d{4}-\d{4}-\d{3}[\dX]", text):
        return False
    total = 0
    for digit in text.replace("-", "")[:-1]:
        total = 2 * (total + int(digit))
    return "0123456789X"[(12 - total % 11) % 11] == text[-1]


def _info(place: str, moment: tuple[int, ...]) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(place, moment)  # type: ignore[arg-type]
    info.compress_type = zipfile.ZIP_STORED if place.endswith(_STORED) else zipfile.ZIP_DEFLATED
    info.create_system = 3
    info.external_attr = (0o40755 << 16 | 0x10) if place.endswith("/") else 0o100644 << 16
    return info


def _write(archive: zipfile.ZipFile, item: Item, moment: tuple[int, ...]) -> None:
    """Write a file, and check its checksum again."""
    digest = hashlib.sha256()
    source = io.BytesIO(item.source) if isinstance(item.source, bytes) else item.source.open("rb")
    with source, archive.open(_info(item.place, moment), "w", force_zip64=item.size >= zipfile.ZIP64_LIMIT) as file:
        while chunk := source.read(_CHUNK_BYTES):
            digest.update(chunk)
            file.write(chunk)
    if digest.hexdigest() != item.sha256:
        raise ArchiveRefused(f"{item.place} changed while it was archived")


def _preview(contents: Contents, options: ArchiveOptions) -> bytes:
    from walkers.postprocess.analysis import describe_result
    from walkers.runner.manifest import read_result
    from walkers.sweeps.table import load, short_text

    first = contents.runs[0]
    if contents.record is None:
        result = describe_result(Path(first.place), read_result(first.directory))
    else:
        table = load(contents.record.directory)
        table["run"] = [Path(one).name for one in table["run"]]
        result = short_text(table)
    given = next((item for item in first.items if item.name.endswith(".toml")), None)
    text = fill(
        "preview.html.j2",
        "walkers.archive",
        contents=contents,
        options=options,
        result=result,
        given=given,
        case=given.source.decode("utf-8") if given and isinstance(given.source, bytes) else None,
        manifest=first.manifest,
        first=first,
        licence=LICENCES[options.licence],
        paper=PAPER,
        quote=shlex.quote,
        sums_name=SUMS_NAME,
        metadata_name=METADATA_NAME,
    )
    return text.encode("utf-8")


# --- contents ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Item:
    """A file of an archive: path in it, source or contents, SHA-256, role (in the crate's actions) and meaning."""

    place: str
    source: Path | bytes
    sha256: str
    role: str = ""
    meaning: str = ""

    @property
    def name(self) -> str:
        """Name without folders."""
        return self.place.rpartition("/")[2]

    @property
    def size(self) -> int:
        """Size in bytes."""
        return len(self.source) if isinstance(self.source, bytes) else self.source.stat().st_size


def item(place: str, source: Path | bytes, sha256: str | None = None, about: tuple[str, str] | None = None) -> Item:
    """A file of an archive; by default, checksum, role and meaning (``about``) follow from contents and name."""
    name = place.rpartition("/")[2]
    if name.endswith(".parquet"):
        table = name.removesuffix(".parquet")
        about = about or ("table", f"table {table}; units and meanings of its columns are in the field metadata")
    if sha256 is None:
        sha256 = hashlib.sha256(source).hexdigest() if isinstance(source, bytes) else checksum(source)
    return Item(place, source, sha256, *_MEANINGS.get(name, about or _REST))


@dataclass(frozen=True)
class PackedRun:
    """A run in an archive: source, folder and manifest in the archive, and files."""

    directory: Path
    place: str
    manifest: dict[str, Any]
    items: Sequence[Item]

    @property
    def name(self) -> str:
        """Name of the run."""
        return self.directory.name

    def with_role(self, *roles: str) -> list[Item]:
        """The files with one of the roles."""
        return [item for item in self.items if item.role in roles]


@dataclass(frozen=True)
class Contents:
    """Contents of an archive: name, title, runs, and for a sweep its own files and its record."""

    name: str
    title: str
    runs: Sequence[PackedRun]
    sweep: Sequence[Item] = ()
    record: SweepRecord | None = None

    @property
    def items(self) -> list[Item]:
        """All files."""
        return [*self.sweep, *(item for run in self.runs for item in run.items)]

    @property
    def finished(self) -> str:
        """End of the last run, ISO 8601."""
        return max(str(run.manifest["finished"]) for run in self.runs)


def contents_of(directory: Path, *, dumps: bool = True) -> Contents:
    """Contents of the archive of a finished run or a sweep; without the engine's dumps if ``dumps`` is false.

    `InputError` if points of a sweep are not finished.
    """
    from walkers.sweeps.table import encoded, load

    if not (directory / RECORD_NAME).is_file():
        run = _packed(directory, dumps)
        return Contents(run.name, case_of(directory).title, [run])
    record = read_record(directory)
    found = states(record)
    unfinished = sum(state.status not in ("finished", "not needed") for state in found)
    if unfinished:
        message = f"{unfinished} of {len(found)} points are not finished; see: walkers list {directory}"
        raise refused(directory, message)
    runs = list(dict.fromkeys(state.directory for state in found if state.directory is not None))
    name = name_of(record.directory.name)
    place, table = f"{RUNS}/{name}", load(record.directory)
    table["run"] = [f"{RUNS}/{Path(one).name}" if one else "" for one in table["run"]]  # not where this machine has it
    items = [item(f"{place}/{RECORD_NAME}", record.directory / RECORD_NAME)]
    items += [item(f"{place}/table.{form}", encoded(table, form)) for form in ("csv", "parquet")]
    if record.file:
        items.append(item(f"{place}/{name}.toml", _toml(record.file), about=_SWEEP))
    return Contents(name, record.title, [_packed(run, dumps) for run in runs], items, record)


def _packed(directory: Path, dumps: bool) -> PackedRun:
    """The files of a manifest, the manifest, and the case file, if it is known."""
    manifest = read_manifest(directory)
    for key in ("started", "finished"):
        try:
            time.strptime(manifest[key], _MOMENT)
        except (ValueError, TypeError) as error:
            text = "expected a time such as 2026-01-31T12:00:00Z"
            raise InputError(str(directory / MANIFEST_NAME), [Problem(key, f'"{manifest[key]}"', text)]) from error
    case, place = case_of(directory), f"{RUNS}/{directory.resolve().name}"
    before, sums = set(manifest.get("left_out", ())), manifest["sha256"]
    named = {name: item(f"{place}/{name}", directory / name, sums.get(name)) for name in manifest["files"]}
    left_out = {name for name, one in named.items() if name in before or (one.role == "dump" and not dumps)}
    said: Path | bytes = directory / MANIFEST_NAME
    if left_out - before:
        manifest["left_out"] = sorted(left_out)
        said = json_bytes(manifest)
    items = [item(f"{place}/{name_of(case.name)}.toml", _toml(case.document), about=_GIVEN)] if case.document else []
    items += [item(f"{place}/{MANIFEST_NAME}", said), *(one for name, one in named.items() if name not in left_out)]
    return PackedRun(directory.resolve(), place, manifest, items)


def _toml(tables: Any) -> bytes:
    import tomli_w

    return tomli_w.dumps(tables).encode("utf-8")
