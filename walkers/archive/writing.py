"""Write an archive: one zip file with the files of a run or a sweep, checksums and descriptions."""

from __future__ import annotations

import hashlib
import re
import shutil
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from walkers.archive.contents import METADATA_NAME, MODEL_FOLDER, REPEAT_NAME, SUMS_NAME, Contents, File, contents_of
from walkers.archive.crate import PAPER, Author, describe_crate
from walkers.errors import refused
from walkers.extras import require
from walkers.files import beside, json_bytes
from walkers.runner.manifest import FileChanged
from walkers.runner.model_sources import model_version
from walkers.text import printable, rendered


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
    described = {
        METADATA_NAME: json_bytes(describe_crate(contents, authors, licence)),
        "README.md": _readme(contents, authors, licence).encode(),
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


def _readme(contents: Contents, authors: Sequence[Author], licence: str) -> str:
    """Description of an archive for readers, in Markdown."""
    example = contents.main[0]
    deck_folder = "segments/0000"
    if any(place.startswith(f"{example}/shared_deck/") for place in contents.files):
        deck_folder = "shared_deck"
    elif f"{example}/walker.lig" in contents.files:  # a deck that was run by hand
        deck_folder = "."
    return rendered(
        "walkers.archive",
        "README.md.j2",
        contents=contents,
        by=printable(", ".join(author.name for author in authors)),
        licence=licence,
        paper=PAPER,
        sums=SUMS_NAME,
        left_out=contents.left_out,
        companions=contents.companions,
        example=example,
        deck_folder=deck_folder,
        up="" if deck_folder == "." else "../" * len(Path(deck_folder).parts),
        model_folder=MODEL_FOLDER,
        model_sentence=_model_sentence(contents.manifests.values()),
        repeat=REPEAT_NAME,
    )


def _model_sentence(manifests: Iterable[Mapping[str, Any]]) -> str:
    """Whether the sources of the contact model in the archive are those with which the runs were made."""
    present = model_version()
    models = [manifest["contact_model"] for manifest in manifests if manifest.get("contact_model")]
    if all(model.get("sources") == present["sources"] for model in models):
        return "The runs were made with these sources."
    versions = {model.get("forces_version") for model in models}
    if versions == {present["forces_version"]}:
        return "Some runs were made with other sources that compute the same forces."
    return (
        "Some runs were made with another version of the contact model, or do not record it: their manifests name "
        "the version of granular-walkers. Such runs may give other dumps with these sources."
    )


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
