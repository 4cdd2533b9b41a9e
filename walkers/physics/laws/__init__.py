"""Laws of liquid bridges by name: built-in laws and laws of users.

A law is a function `Surfaces → Curve` (`walkers.physics.bridge`). A built-in law is the function ``law`` of a file in
this folder, with its equation and source, and has the name of the file. Packages add laws by entry points
``walkers.bridge_laws``. A user's own law is named ``package.module:function`` or ``path/to/file.py:function``.
"""

from __future__ import annotations

import hashlib
import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from inspect import getsourcefile
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType
from typing import TYPE_CHECKING

from walkers.packages import offers
from walkers.physics.matter import Liquid

if TYPE_CHECKING:  # numpy is not needed to find a law by name
    from walkers.physics.bridge import BridgeLaw

LAWS = tuple(one.name.replace("_", "-") for one in iter_modules(__path__))
"""Names of the built-in laws."""


def by_name(name: str) -> BridgeLaw:
    """Find a law by name: one of `LAWS`, of an installed package, ``package.module:function`` or ``file.py:function``.

    Paths of files are relative to the working directory.

    Raises
    ------
    ValueError
        If there is no law with this name; an error in a user's file or module is its cause.
    """
    place, _, function = name.rpartition(":")
    if name in LAWS:
        place, function = f"{__name__}.{name.replace('-', '_')}", "law"
    elif offer := offers("walkers.bridge_laws").get(name):
        if not callable(law := offer.load(call=False)):
            raise offer.broken("it is not a function")
        return law  # type: ignore[no-any-return]
    if not place or not function:
        names = ", ".join([*LAWS, *offers("walkers.bridge_laws")])
        raise ValueError(f"bridge law {name!r}: expected one of {names}, package.module:function or file.py:function")
    law = getattr(_module(name, place), function, None)
    if not callable(law):
        raise ValueError(f"bridge law {name!r}: {place} has no function {function}")
    return law  # type: ignore[no-any-return]


def source_sha256(name: str) -> str | None:
    """SHA-256 of the file of a user's own law, None for a built-in law; raises the errors of `by_name`."""
    if name in LAWS:
        return None
    file = getsourcefile(by_name(name))
    return hashlib.sha256(Path(file).read_bytes()).hexdigest() if file else None


def law_of(liquid: Liquid) -> BridgeLaw:
    """The law of a liquid's bridges (`by_name`)."""
    return by_name(liquid.law)


def _module(name: str, place: str) -> ModuleType:
    """A module, or a file as one; a file is in `sys.modules` while it runs, where its dataclasses look for it."""
    key = f"walkers_law_{Path(place).resolve()}"
    try:
        if not place.endswith(".py"):
            return import_module(place)
        specification = spec_from_file_location(key, place)
        assert specification is not None
        assert specification.loader is not None
        module = sys.modules[key] = module_from_spec(specification)
        specification.loader.exec_module(module)
    except BaseException as error:
        sys.modules.pop(key, None)
        if isinstance(error, Exception):
            raise ValueError(f"bridge law {name!r}: {place} cannot be imported: {error}") from error
        raise
    return module
