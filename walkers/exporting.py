"""Names that a package exports from modules, which are imported on first use."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any


def exporting(package: str, **names: Sequence[str]) -> Callable[[str], Any]:
    """The ``__getattr__`` of a package that exports the given names of each of its modules.

    The use of one module, such as the errors, does not import the others, and with them pydantic, jinja2 and numpy.
    """
    modules = {name: f"{package}.{module}" for module, exported in names.items() for name in exported}

    def get(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(modules[name]), name)

    return get
