"""TOML files as users write them."""

from __future__ import annotations

import stat
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from walkers.errors import refused

_MOST_BYTES = 16 << 20


def toml_bytes(tables: Mapping[str, Any]) -> bytes:
    """Tables as a TOML file; needs the extra that installs tomli-w."""
    import tomli_w

    return tomli_w.dumps(tables).encode("utf-8")


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file; an `InputError` if it cannot be read, is no TOML, no regular file, or larger than 16 MB."""
    try:
        about = path.stat()
        if not stat.S_ISDIR(about.st_mode) and (not stat.S_ISREG(about.st_mode) or about.st_size > _MOST_BYTES):
            raise refused(path, f"expected a file of at most {_MOST_BYTES >> 20} MB")
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        actual = f"byte {error.object[error.start]:#04x} at offset {error.start}"
        raise refused(path, f"expected UTF-8 text, found {actual}") from error
    except (ValueError, RecursionError) as error:  # TOML's own errors, integers of 5000 digits, brackets without end
        raise refused(path, f"not TOML: {error}") from error
    except OSError as error:
        raise refused(path, f"cannot be read: {error.strerror}") from error
