"""Write an archive: one zip with the files, their checksums, what they are for machines, and for people."""

from __future__ import annotations

import hashlib
import re
import shlex
import time
import zipfile
from calendar import timegm
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from walkers.archive.citation import LICENCES, PAPER, Author
from walkers.archive.contents import Contents, Item, contents_of_run, contents_of_sweep
from walkers.archive.crate import METADATA_NAME, PREVIEW_NAME, as_bytes, describe_crate
from walkers.archive.verification import SUMS_NAME, verify
from walkers.inputs.errors import InputError, Problem, WalkersError
from walkers.postprocess.report.page import fill
from walkers.runner.files import beside
from walkers.runner.manifest import checksum
from walkers.sweeps.record import RECORD_NAME

_COMPRESSED = (".parquet", ".png", ".mp4")
_CHUNK_BYTES = 1 << 20


class ArchiveRefused(WalkersError):
    """A run whose files are not what they were when it was finished."""


@dataclass(frozen=True)
class ArchiveOptions:
    """How an archive is made.

    Attributes
    ----------
    dumps
        Whether what the engine wrote of the motion goes in; tables and results do in any case.
    authors
        Of the runs.
    licence
        Key of `walkers.archive.citation.LICENCES`.
    """

    dumps: bool = True
    authors: Sequence[Author] = ()
    licence: str = "CC-BY-4.0"


def write_archive(directory: str | Path, to: Path | None = None, options: ArchiveOptions | None = None) -> Path:
    """Pack a finished run, or a sweep all of whose runs are finished, into an RO-Crate.

    Parameters
    ----------
    directory
        A run directory, or a sweep's.
    to
        The zip to write; ``NAME.zip`` in the current directory if left out. An older one is replaced at the end.
    options
        How.

    Returns
    -------
    Path
        The zip.

    Raises
    ------
    InputError
        If it is no run or sweep, or not finished, or an option makes no sense.
    ArchiveRefused
        If files are not what the manifests say.
    """
    directory, options = Path(directory), options or ArchiveOptions()
    _check(options)
    found = [one for one in verify(directory) if not one.of_points]  # `contents_of_sweep` asks for all points
    if not all(one.passed for one in found):
        told = "\n".join(one.describe() for one in found if not one.passed)
        raise ArchiveRefused(f"{directory} is not archived, for it is not what it was:\n{told}")
    is_sweep = (directory / RECORD_NAME).is_file()
    contents = (contents_of_sweep if is_sweep else contents_of_run)(directory, dumps=options.dumps)
    to = Path(f"{contents.name}.zip") if to is None else to
    if to.suffix != ".zip" or to.is_dir():
        raise InputError("--to", [Problem("", None, f"expected the name of a .zip file, not {to}")])
    sums = {item.place: item.sha256 or _sum(item) for item in contents.items}
    metadata = as_bytes(describe_crate(contents, sums, options.authors, options.licence))
    described = [Item(METADATA_NAME, metadata), Item(PREVIEW_NAME, _preview(contents, options))]
    sums |= {item.place: _sum(item) for item in described}
    listing = "".join(f"{one}  {place}\n" for place, one in sums.items()).encode("utf-8")
    with beside(to) as new:
        _write_zip(new, [*described, Item(SUMS_NAME, listing), *contents.items], sums, _moment(contents.finished))
    return to


def _check(options: ArchiveOptions) -> None:
    if options.licence not in LICENCES:
        told = f"expected one of {', '.join(LICENCES)}"
        raise InputError("--licence", [Problem("", None, f"{told}, not {options.licence}")])
    for author in options.authors:
        if not author.name.strip():
            raise InputError("--author", [Problem("", None, "expected a name")])
        if author.orcid is not None and not _is_orcid(author.orcid):
            told = f"expected an ORCID such as 0000-0002-1825-0097, found {author.orcid}"
            raise InputError("--orcid", [Problem("", None, told)])


def _is_orcid(text: str) -> bool:
    """Whether the last of its sixteen digits checks the others (ISO 7064, mod 11-2)."""
    if not re.fullmatch(r"\d{4}-\d{4}-\d{4}-\d{3}[\dX]", text):
        return False
    total = 0
    for digit in text.replace("-", "")[:-1]:
        total = 2 * (total + int(digit))
    return "0123456789X"[(12 - total % 11) % 11] == text[-1]


def _sum(item: Item) -> str:
    return hashlib.sha256(item.source).hexdigest() if isinstance(item.source, bytes) else checksum(item.source)


def _moment(iso: str) -> tuple[int, ...]:
    """A time of a manifest as zip files have them: no time zone, every other second."""
    return time.gmtime(timegm(time.strptime(iso, "%Y-%m-%dT%H:%M:%SZ")))[:6]


def _write_zip(path: Path, items: Sequence[Item], sums: Mapping[str, str], moment: tuple[int, ...]) -> None:
    """Write the files, all of one time, and see that each is what it was when it was summed."""
    folders = dict.fromkeys(
        f"{parent}/" for item in items for parent in reversed(Path(item.place).parents) if str(parent) != "."
    )
    with zipfile.ZipFile(path, "w") as archive:
        for place in folders:
            archive.writestr(_info(place, moment), b"")
        for item in items:
            with archive.open(_info(item.place, moment), "w", force_zip64=item.size >= zipfile.ZIP64_LIMIT) as file:
                written = _copy(item, file)
            if written != sums.get(item.place, written):
                raise ArchiveRefused(f"{item.source!s} changed while it was archived")


def _info(place: str, moment: tuple[int, ...]) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(place, moment)  # type: ignore[arg-type]
    stored = place.endswith(("/", *_COMPRESSED))
    info.compress_type = zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED
    info.create_system = 3
    info.external_attr = (0o40755 << 16 | 0x10) if place.endswith("/") else 0o100644 << 16
    return info


def _copy(item: Item, file: IO[bytes]) -> str:
    """Write an item into an archive; its SHA-256."""
    if isinstance(item.source, bytes):
        file.write(item.source)
        return hashlib.sha256(item.source).hexdigest()
    digest = hashlib.sha256()
    with item.source.open("rb") as source:
        while chunk := source.read(_CHUNK_BYTES):
            digest.update(chunk)
            file.write(chunk)
    return digest.hexdigest()


def _preview(contents: Contents, options: ArchiveOptions) -> bytes:
    """What people read first."""
    from walkers.postprocess.analysis import describe_result, read_result
    from walkers.sweeps.table import load, short_text

    if contents.record is None:
        result = "\n".join(describe_result(Path(run.place), read_result(run.directory)) for run in contents.runs)
    else:
        table = load(contents.record.directory)
        table["run"] = [Path(one).name for one in table["run"]]
        result = short_text(table)
    first = contents.runs[0]
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
