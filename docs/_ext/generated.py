"""Pages of the reference that follow from the code, in reference/generated.

They show the commands, the keys of case files, the columns of tables, the library, and the shipped
cases. The pages are tracked, so that they can be read without a build of the site, which writes
them too. After a change of what they show:

    python -m docs._ext.generated
"""

from __future__ import annotations

import io
import json
import re
import types
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BeforeValidator
from pydantic.fields import FieldInfo

from docs.tables import markdown
from walkers.commands import ALL_COMMANDS
from walkers.commands.catalogue import COMMANDS, NOT_KNOWN, Entry, catalogue
from walkers.inputs.config_table import (
    Choice,
    ConfigTable,
    example_of,
    is_table,
    table_in,
    table_keys,
)
from walkers.inputs.resolving.from_library import SUPPLIED
from walkers.inputs.resolving.library import LibraryNumber
from walkers.inputs.tables.case import CaseFile
from walkers.inputs.units import (
    ACCELERATION,
    AUTO,
    TEMPERATURE,
    QuantityKind,
    kind_in,
    quantity_text,
)
from walkers.main import print_help, program
from walkers.postprocess.measure.quantities import GROUPS, TABLES, Quantity
from walkers.sweeps.table import STATE

if TYPE_CHECKING:
    from cyclopts import App
    from sphinx.application import Sphinx
    from sphinx.config import Config

FOLDER = Path(__file__).parents[1] / "reference" / "generated"
"""Where the pages are written."""

_BOUNDS = {
    "gt": ">",
    "ge": "≥",
    "lt": "<",
    "le": "≤",
    "min_length": "length ≥",
    "max_length": "length ≤",
}
"""Signs of the bounds of a field, by their names in pydantic."""

_WORDS = {
    str: "text",
    bool: "true or false",
    int: "a whole number",
    float: "a plain number without a unit",
}
"""What keys of these types expect."""

_DOCS_PAGE = re.compile(r"docs/(\S+?\.md)")
"""A page of the documentation in the source of a number."""


# --- keys of a case file --------------------------------------------------------------------------


def _expected(hint: Any) -> str:
    """What a key of a type expects, in the words of the message that a wrong value gets."""
    origin = get_origin(hint)
    if origin is Annotated:
        return _expected_with_notes(hint)
    if origin is Literal:
        return "one of " + ", ".join(f'`"{value}"`' for value in get_args(hint))
    if origin in (Union, types.UnionType):
        members = [member for member in get_args(hint) if member is not types.NoneType]
        return " or ".join(_expected(member) for member in members)
    if origin is tuple:
        members = list(get_args(hint))
        number = "" if ... in members else f" of {len(members)}"
        return f"a list{number}, each {_expected(members[0])}"
    return _WORDS.get(hint, "a table")


def _expected_with_notes(hint: Any) -> str:
    """What an annotated type expects: the words of its validator, ``auto``, and its bounds."""
    inner, *notes = get_args(hint)
    expected = None
    for note in notes:
        if expected is None and isinstance(note, (BeforeValidator, QuantityKind)):
            expected = _words_of_validator(note)
    if not expected:
        expected = _expected(inner)
    if AUTO in notes:
        expected += ', or `"auto"`'
    bounds = " and ".join(_bounds(notes))
    return f"{expected}; {bounds}" if bounds else expected


def _bounds(notes: Iterable[Any]) -> list[str]:
    """Bounds among the notes of a type, such as ``≥ 1``."""
    limits: list[Any] = []
    for note in notes:
        limits += note.metadata if isinstance(note, FieldInfo) else [note]
    bounds = []
    for limit in limits:
        for name, sign in _BOUNDS.items():
            value = getattr(limit, name, None)
            if isinstance(value, (int, float)):
                bounds.append(f"{sign} {value:g}")
    return bounds


def _words_of_validator(validator: BeforeValidator | QuantityKind) -> str | None:
    """What a validator expects, by the message with which it refuses a value."""
    if isinstance(validator, QuantityKind):
        return _words_of_quantity(validator)
    try:
        validator.func(object())  # type: ignore[call-arg]
    except ValueError as error:
        return str(error).removeprefix("expected ")
    return None


def _words_of_quantity(kind: QuantityKind) -> str:
    """What a quantity expects, with its smallest and largest magnitude."""
    words, _, _ = kind.expectation.removeprefix("expected ").partition(", such as")
    is_any_angle = kind.unit == "rad" and kind.largest > 10.0
    if is_any_angle:
        return words
    smallest, _ = _in_unit(kind.smallest, kind).split()
    largest = _in_unit(kind.largest, kind)
    has_sign = kind.sign or kind.unit == TEMPERATURE.unit
    signs = "" if has_sign else " in absolute value"
    return f"{words}; {smallest} to {largest}{signs}"


def _in_unit(value: float, kind: QuantityKind) -> str:
    """A value in the unit of its kind's example, with four digits.

    Accelerations, of which gravity is one, are in m/s².
    """
    number: float | str = value
    unit = kind.unit
    if unit != ACCELERATION.unit:
        number, unit = quantity_text(value, kind).split()
    return f"{float(f'{float(number):.4g}'):g} {unit}"


def _default(field: FieldInfo) -> str:
    """The default of a key, with the unit of the messages if it is a quantity."""
    if field.is_required():
        return "required"
    if field.default in (None, "", (), {}):
        return ""
    kind = kind_in([*field.metadata, field.annotation])
    if kind:
        return f"`{_in_unit(field.default, kind)}`"
    return f"`{json.dumps(field.default)}`"


def _row(name: str, field: FieldInfo, *, supplied: bool) -> tuple[str, str, str, str]:
    """Key, meaning, what it expects with an example, and default.

    ``supplied`` tells whether the library gives the value if a file does not.
    """
    expected = _expected(Annotated[field.annotation, *field.metadata, "at least one annotation"])
    example = example_of(field).removeprefix("a value ")
    if example.startswith("such as") and example not in expected:
        expected += f"; {example}"
    default = "from the library" if supplied else _default(field)
    return f"`{name}`", str(field.description), expected, default


def tables_of_keys(
    model: type[ConfigTable] = CaseFile, heading: str = ""
) -> Iterator[tuple[str, str]]:
    """Describe a table of a case file, and the tables in it.

    Parameters
    ----------
    model
        The class of the table.
    heading
        How a file begins the table, such as ``[beads]``; empty for the file itself.

    Yields
    ------
    heading : str
        The heading of a table.
    text : str
        A Markdown table of its keys, and which keys exclude each other.
    """
    fields = table_keys(model)
    name_of_table = heading.strip("[]")
    path = f"{name_of_table}." if name_of_table else ""
    tables = {}
    rows = []
    for name, field in fields.items():
        table = table_in(field.annotation)
        if table:
            tables[name] = table
        if not is_table(field):
            rows.append(_row(name, field, supplied=f"{path}{name}" in SUPPLIED))
    text = markdown(["key", "meaning", "expects", "default"], rows)
    for choice in model.choices:
        text += _choice_text(choice, path)
    yield heading or "Top level", text
    for name, table in tables.items():
        is_list = "tuple" in str(fields[name].annotation)
        yield from tables_of_keys(table, f"[[{path}{name}]]" if is_list else f"[{path}{name}]")


def _choice_text(choice: Choice, path: str) -> str:
    """Which keys of the table with a path exclude each other."""
    alternatives = []
    supplied = False
    for names in choice.expressions:
        alternatives.append(" and ".join(f"`{name}`" for name in names))
        supplied = supplied or any(f"{path}{name}" in SUPPLIED for name in names)
    number = "Exactly" if choice.required and not supplied else "At most"
    return f"\n{number} one of: {'; '.join(alternatives)}.\n"


# --- keys and columns -----------------------------------------------------------------------------

_KEYS = """# Keys and columns

## Keys of a case file

`walkers show CASE` prints every value.
"""

_COLUMNS = """
## Columns of the tables of a run

The parquet files contain the units and meanings too. A name with `*` stands for one column per bead
or contact: `rotation_1`, `rotation_2`, …

"""

_SWEEPS = """
## Columns of the table of a sweep

The first columns are the keys that vary.

"""

_GROUPS = {
    "walking": "Walkers",
    "meetings": "Walkers that may meet",
    "piles": "Piles",
    "drive": "All sweeps",
}
"""Titles of the groups of columns of sweeps."""


def _columns(title: str, quantities: Iterable[Quantity]) -> str:
    """A Markdown table of columns with their units and meanings."""
    rows = []
    for quantity in quantities:
        rows.append((f"`{quantity.name}`", quantity.si_unit, quantity.meaning))
    return f"### {title}\n\n{markdown(['column', 'unit', 'meaning'], rows)}"


def _keys() -> str:
    """The page of keys and columns, from the declarations that the program itself uses."""
    page = _KEYS
    for heading, table in tables_of_keys():
        page += f"\n### {heading}\n\n{table}"
    page += _COLUMNS
    page += "\n".join(_columns(name, quantities) for name, quantities in TABLES.items())
    page += _SWEEPS
    page += "\n".join(_columns(title, GROUPS[group]) for group, title in _GROUPS.items())
    for name, (unit, meaning) in STATE.items():
        page += f"| `{name}` | {unit} | {meaning} |\n"
    return page


# --- library and shipped files --------------------------------------------------------------------

_LIBRARY = """# Library

The library of the program. A case can override each number. `walkers library` prints it.

Sources of liquids give the temperature. Densities and moduli of a grade differ by several per cent.
"""


def _library() -> str:
    """The page of materials and liquids with their sources, as ``walkers library`` has them."""
    page = _LIBRARY
    entries = catalogue()
    for kind in ("materials", "liquids", "surface pairs"):
        page += f"\n## {kind.capitalize()}\n"
        for entry in entries:
            if entry.kind == kind:
                page += _library_entry(entry)
    defaults = []
    for entry in entries:
        if entry.kind == "not measured":
            defaults.append(_value_and_range(entry.name, entry.numbers["default"]))
    table = markdown(["", "default", "range"], defaults)
    return f"{page}\n## Not measured\n\n{NOT_KNOWN}\n\n{table}"


def _library_entry(entry: Entry) -> str:
    """The section of a material, a liquid or a pair of surfaces."""
    rows = []
    for key, number in entry.numbers.items():
        source = _DOCS_PAGE.sub(r"[docs/\1](../../\1)", number.source)
        rows.append((*_value_and_range(key, number), source))
    table = markdown(["", "value", "range", "source"], rows)
    return f"\n### {entry.name}\n\n{entry.text}\n\n{table}"


def _value_and_range(key: str, number: LibraryNumber) -> tuple[str, str, str]:
    limits = f"{number.range[0]} to {number.range[1]}" if number.range else ""
    return f"`{key}`", str(number.written), limits


_SHIPPED = """# Shipped cases, sweeps and calibrations

Every command accepts these names instead of a file.
"""


def _shipped() -> str:
    """The page of shipped cases, sweeps and calibrations."""
    page = _SHIPPED
    entries = catalogue()
    for kind, command in COMMANDS.items():
        rows = []
        for entry in entries:
            if entry.kind == kind:
                rows.append((f"`walkers {command} {entry.name}`", entry.text))
        page += f"\n## {kind.capitalize()}\n\n{markdown(['', 'title'], rows)}"
    return page


# --- commands -------------------------------------------------------------------------------------

_COMMANDS = """# Commands

The output of `walkers --help` and of `walkers COMMAND --help`. `walkers --install-completion`
installs the completion of commands, options, cases, sweeps and runs for bash, zsh and fish; call it
again after an update of the program.

| exit status | meaning |
| --- | --- |
| 0 | done |
| 1 | a run or a check failed |
| 2 | bad input |
| 130 | interrupted with Ctrl-C |
| 143 | terminated |
| 129 | the terminal was closed |

"""


def _commands() -> str:
    """The page of commands with their help."""
    app = program()
    overview = _printed(print_help)
    page = f"{_COMMANDS}```text\n$ walkers --help\n{overview}```\n"
    for command in ALL_COMMANDS:
        page += _help_of(app, [command.name])
        for part in app[command.name]:
            if not part.startswith("-"):
                page += _help_of(app, [command.name, part])
    return page


def _help_of(app: App, words: Sequence[str]) -> str:
    """The section of a command, which consists of several words if it has parts."""
    command = " ".join(["walkers", *words])
    text = _printed(lambda: app([*words, "--help"]))
    return f"\n## {command}\n\n```text\n$ {command} --help\n{text}```\n"


def _printed(show: Callable[[], object]) -> str:
    """What a function prints."""
    page = io.StringIO()
    with redirect_stdout(page):
        show()
    return page.getvalue()


# --- pages ----------------------------------------------------------------------------------------

PAGES = {"commands": _commands, "tables": _keys, "library": _library, "shipped": _shipped}
"""Functions that give the text of a page, by its name."""


def _write(_app: Sphinx | None = None, _config: Config | None = None) -> None:
    """Write the pages that have changed; Sphinx would read others again too."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, page in PAGES.items():
        path = FOLDER / f"{name}.md"
        text = page()
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for files."""
    app.connect("config-inited", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    _write()
