"""Write an archive: one zip with the files, their checksums, what they are for machines, and for people."""

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

from walkers.archive.contents import Contents, Item, contents_of, item
from walkers.archive.crate import LICENCES, METADATA_NAME, PAPER, PREVIEW_NAME, Author, describe_crate
from walkers.archive.verification import SUMS_NAME, verify
from walkers.inputs.errors import WalkersError, refused
from walkers.postprocess.report.page import fill
from walkers.runner.files import beside, json_bytes

_STORED = ("/", ".parquet", ".png", ".mp4")
"""Ends of names that are not compressed: folders, and what is already."""
_CHUNK_BYTES = 1 << 20


class ArchiveRefused(WalkersError):
    """A run whose files are not what they were when it was finished."""


@dataclass(frozen=True)
class ArchiveOptions:
    """How an archive is made: with what the engine wrote of the motion or without; by whom; under which of `LICENCES`.

    Tables and results go in in any case.
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
    found = [one for one in verify(directory) if not one.of_points]  # `contents_of` asks for all points
    if not all(one.passed for one in found):
        told = "\n".join(one.describe() for one in found if not one.passed)
        raise ArchiveRefused(f"{directory} is not archived, for it is not what it was:\n{told}")
    contents = contents_of(directory, dumps=options.dumps)
    to = Path(f"{contents.name}.zip") if to is None else to
    if to.suffix != ".zip" or to.is_dir():
        raise refused("--to", f"expected the name of a .zip file, not {to}")
    metadata = json_bytes(describe_crate(contents, options.authors, options.licence))
    described = [item(METADATA_NAME, metadata), item(PREVIEW_NAME, _preview(contents, options))]
    sums = "".join(f"{one.sha256}  {one.place}\n" for one in [*contents.items, *described])
    moment = time.strptime(contents.finished, "%Y-%m-%dT%H:%M:%SZ")[:6]  # of all files, for the same bytes again
    with beside(to) as new, zipfile.ZipFile(new, "w") as archive:
        items = [*described, item(SUMS_NAME, sums.encode("utf-8")), *contents.items]
        folders = [f"{parent}/" for one in items for parent in reversed(Path(one.place).parents) if parent != Path()]
        for place in dict.fromkeys(folders):
            archive.writestr(_info(place, moment), b"")
        for one in items:
            _write(archive, one, moment)
    return to


def _check(options: ArchiveOptions) -> None:
    if options.licence not in LICENCES:
        told = f"expected one of {', '.join(LICENCES)}"
        raise refused("--licence", f"{told}, not {options.licence}")
    for author in options.authors:
        if not author.name.strip():
            raise refused("--author", "expected a name")
        if author.orcid is not None and not _is_orcid(author.orcid):
            raise refused("--orcid", f"expected an ORCID such as 0000-0002-1825-0097, found {author.orcid}")


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
    """Write a file, and see that it is what it was when it was summed."""
    digest = hashlib.sha256()
    source = io.BytesIO(item.source) if isinstance(item.source, bytes) else item.source.open("rb")
    with source, archive.open(_info(item.place, moment), "w", force_zip64=item.size >= zipfile.ZIP64_LIMIT) as file:
        while chunk := source.read(_CHUNK_BYTES):
            digest.update(chunk)
            file.write(chunk)
    if digest.hexdigest() != item.sha256:
        raise ArchiveRefused(f"{item.place} changed while it was archived")


def _preview(contents: Contents, options: ArchiveOptions) -> bytes:
    """What people read first."""
    from walkers.postprocess.analysis import describe_result, read_result
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
