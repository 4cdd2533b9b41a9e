"""The built-in laws of liquid bridges.

A law is a function `Surfaces → Curve` (`walkers.physics.bridge`). A built-in law is the function
``law`` of a file in this folder, with its equation and source, and has the name of the file.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # numpy is not needed to list the laws
    from walkers.physics.bridge import BridgeLaw

LAWS = tuple(module.name.replace("_", "-") for module in iter_modules(__path__))
"""Names of the built-in laws."""


def built_in(name: str) -> BridgeLaw:
    """The law with a name of `LAWS`."""
    law: BridgeLaw = import_module(f"{__name__}.{name.replace('-', '_')}").law
    return law
