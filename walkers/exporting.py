"""Names that a package exports from modules which are imported when one is first asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any


def exporting(package: str, **names: Sequence[str]) -> Callable[[str], Any]:
    """The ``__getattr__`` of a package that exports, for each of its modules, some of what that holds.

    Whoever needs one module of a package, such as its errors, does not wait for all the others, and for pydantic,
    jinja2 and numpy with them.
    """
    modules = {name: f"{package}.{module}" for module, exported in names.items() for name in exported}

    def get(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(modules[name]), name)

    return get
