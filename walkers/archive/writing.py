"""Write an archive: one zip file with the files of a run or a sweep, checksums and descriptions."""

from __future__ import annotations

import hashlib
import shutil
import zipfile
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from walkers.archive.contents import README_FILE, RECORD_FILE, SUMS_NAME, ArchiveFile, contents_of
from walkers.archive.description import archive_record, readme
from walkers.errors import input_error
from walkers.extras import require
from walkers.files import json_bytes, replacing
from walkers.runner.manifest import FileChanged


def write_archive(
    directory: str | Path,
    to: Path | None = None,
    *,
    dumps: bool = True,
    authors: Sequence[str] = (),
    licence: str | None = None,
) -> Path:
    """Pack a finished run, or a sweep whose runs are all finished, into a zip file.

    The same runs and arguments give the same bytes.

    Parameters
    ----------
    directory
        The run directory or the directory of the sweep.
    to
        The zip file; an older one is replaced. None: a file with the name of the run or sweep, in
        the current folder.
    dumps
        Whether to include the dumps of the engine. Tables and results are included in any case.
    authors
        Names of the authors of the runs.
    licence
        Licence of the data, such as ``CC-BY-4.0``; None: not stated.

    Returns
    -------
    Path
        The zip file.

    Raises
    ------
    InputError
        If an argument cannot be used, or points of the sweep are not finished.
    FileChanged
        If a file differs from its checksum in the manifest of its run.
    """
    require("archive")
    _check_arguments(authors, licence)
    contents = contents_of(Path(directory), dumps=dumps)
    if to is None:
        to = Path(f"{contents.name}.zip")
    if to.suffix != ".zip" or to.is_dir():
        raise input_error("to", f"expected the name of a .zip file, not {to}")
    readme_text = readme(contents, authors, licence)
    record = archive_record(contents, authors, licence)
    files = {
        README_FILE: ArchiveFile.of(readme_text.encode()),
        RECORD_FILE: ArchiveFile.of(json_bytes(record)),
        **contents.files,
    }
    sums = "".join(f"{file.sha256}  {place}\n" for place, file in files.items())
    # One date for all files: the same runs give the same bytes.
    date = datetime.fromisoformat(contents.finished).timetuple()[:6]
    with replacing(to) as new, zipfile.ZipFile(new, "w") as archive:
        _write(archive, zipfile.ZipInfo(SUMS_NAME, date), ArchiveFile.of(sums.encode()))
        for place, file in files.items():
            _write(archive, zipfile.ZipInfo(place, date), file)
    return to


def _check_arguments(authors: Sequence[str], licence: str | None) -> None:
    """Refuse authors and a licence that say nothing."""
    if isinstance(authors, str):
        raise input_error("authors", f"expected a list of names, not the text {authors}")
    if not all(name.strip() for name in authors):
        raise input_error("authors", "expected names that are not empty")
    if licence is not None and not licence.strip():
        raise input_error("licence", "expected a licence such as CC-BY-4.0")


def _write(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, file: ArchiveFile) -> None:
    """Write a file, and compare the written bytes with its checksum."""
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.external_attr = 0o100644 << 16
    with file.open() as source, archive.open(entry, "w", force_zip64=True) as copy:
        shutil.copyfileobj(source, copy)
    with archive.open(entry) as written:
        if hashlib.file_digest(written, "sha256").hexdigest() != file.sha256:  # type: ignore[arg-type]
            raise FileChanged(
                f"{entry.filename} has changed since the run was finished: "
                "walkers check files lists all changes"
            )
