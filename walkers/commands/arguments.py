"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Case = Annotated[str, typer.Argument(metavar="CASE", help="A case file, or the name of a shipped case such as fig1b.")]
Run = Annotated[str, typer.Argument(metavar="RUN", help="A run directory, or a case whose run is looked up in --out.")]
Out = Annotated[Path, typer.Option("--out", help="Folder of the run directories.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, SI units.")]
