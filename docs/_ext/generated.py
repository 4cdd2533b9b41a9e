"""Pages of the reference in reference/generated: commands, keys, columns, library, shipped cases.

They are tracked, so that they can be read without a build, which writes them too. After a change of what they show:

    python -m docs._ext.generated
"""

from __future__ import annotations

import io
import json
import re
import types
from collections.abc import Iterable, Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BeforeValidator
from pydantic.fields import FieldInfo

from docs.tables import markdown
from walkers.commands import ALL_COMMANDS
from walkers.commands.catalogue import COMMANDS, NOT_KNOWN, catalogue
from walkers.inputs.config_table import ConfigTable, example_of, table_in, table_keys
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
    from sphinx.application import Sphinx
    from sphinx.config import Config

FOLDER = Path(__file__).parents[1] / "reference" / "generated"

_BOUNDS = {
    "gt": ">",
    "ge": "≥",
    "lt": "<",
    "le": "≤",
    "min_length": "length ≥",
    "max_length": "length ≤",
}
_PAGE = re.compile(r"docs/(\S+?\.md)")


def _described(title: str, quantities: Iterable[Quantity]) -> str:
    rows = ((f"`{quantity.name}`", quantity.si_unit, quantity.meaning) for quantity in quantities)
    return f"### {title}\n\n{markdown(['column', 'unit', 'meaning'], rows)}"


# --- keys of a case file ----------------------------------------------------------------------------------------------


def _expected(hint: Any) -> str:
    """What a key expects, in the words of the message that a wrong value gets."""
    if get_origin(hint) is Annotated:
        inner, *notes = get_args(hint)
        bounds = " and ".join(
            f"{sign} {getattr(bound, name):g}"
            for note in notes
            for bound in (note.metadata if isinstance(note, FieldInfo) else [note])
            for name, sign in _BOUNDS.items()
            if isinstance(getattr(bound, name, None), (int, float))
        )
        refusals = (
            _refusal(note) for note in notes if isinstance(note, (BeforeValidator, QuantityKind))
        )
        expected = next(refusals, None) or _expected(inner)
        expected += ', or `"auto"`' if AUTO in notes else ""
        return f"{expected}; {bounds}" if bounds else expected
    if get_origin(hint) is Literal:
        return "one of " + ", ".join(f'`"{value}"`' for value in get_args(hint))
    if get_origin(hint) in (Union, types.UnionType):
        return " or ".join(
            _expected(member) for member in get_args(hint) if member is not types.NoneType
        )
    if get_origin(hint) is tuple:
        number = "" if ... in get_args(hint) else f" of {len(get_args(hint))}"
        return f"a list{number}, each {_expected(get_args(hint)[0])}"
    words = {
        str: "text",
        bool: "true or false",
        int: "a whole number",
        float: "a plain number without a unit",
    }
    return words.get(hint, "a table")


def _refusal(validator: BeforeValidator | QuantityKind) -> str | None:
    if isinstance(validator, QuantityKind):
        low, high = (_in_unit(end, validator) for end in (validator.smallest, validator.largest))
        words = validator.expectation.removeprefix("expected ").partition(", such as")[0]
        if validator.unit == "rad" and validator.largest > 10.0:  # any angle
            return words
        either = (
            "" if validator.sign or validator.unit == TEMPERATURE.unit else " in absolute value"
        )
        return f"{words}; {low.split()[0]} to {high}{either}"
    try:
        validator.func(object())  # type: ignore[call-arg]
    except ValueError as error:
        return str(error).removeprefix("expected ")
    return None


def _in_unit(value: float, kind: QuantityKind) -> str:
    """A value in the unit of its kind's example, four digits; accelerations, of which gravity is one, in m/s²."""
    number, unit = (
        (value, kind.unit) if kind.unit == ACCELERATION.unit else quantity_text(value, kind).split()
    )
    return f"{float(f'{float(number):.4g}'):g} {unit}"


def _default(field: FieldInfo) -> str:
    """The default in the units of the messages, where a value has a unit."""
    if field.is_required() or field.default in (None, "", (), {}):
        return "required" if field.is_required() else ""
    kind = kind_in([*field.metadata, field.annotation])
    return f"`{_in_unit(field.default, kind)}`" if kind else f"`{json.dumps(field.default)}`"


def _row(name: str, field: FieldInfo, *, supplied: bool) -> tuple[str, str, str, str]:
    """Key, meaning, what it expects with an example, default."""
    example = example_of(field).removeprefix("a value ")
    expected = _expected(Annotated[field.annotation, *field.metadata, "at least one annotation"])
    expected += f"; {example}" if example.startswith("such as") and example not in expected else ""
    return (
        f"`{name}`",
        str(field.description),
        expected,
        "from the library" if supplied else _default(field),
    )


def tables_of_keys(
    model: type[ConfigTable] = CaseFile, place: str = ""
) -> Iterator[tuple[str, str]]:
    """Tables of a case file: heading, and its keys as a table of Markdown with what excludes what."""
    fields = table_keys(model)
    below = {name: table_in(field.annotation) for name, field in fields.items()}
    path = f"{place.strip('[]')}.".lstrip(".")
    keys = [name for name in fields if not below[name]]
    rows = (_row(name, fields[name], supplied=f"{path}{name}" in SUPPLIED) for name in keys)
    text = markdown(["key", "meaning", "expects", "default"], rows)
    for choice in model.choices:
        alternatives = "; ".join(
            " and ".join(f"`{name}`" for name in names) for names in choice.expressions
        )
        supplied = any(
            f"{path}{name}" in SUPPLIED for names in choice.expressions for name in names
        )
        text += f"\n{'Exactly' if choice.required and not supplied else 'At most'} one of: {alternatives}.\n"
    yield place or "Top level", text
    for name, inner in below.items():
        if inner:
            several = "tuple" in str(fields[name].annotation)
            yield from tables_of_keys(inner, f"[[{path}{name}]]" if several else f"[{path}{name}]")


_KEYS = "# Keys and columns\n\n## Keys of a case file\n\n`walkers show CASE` prints every value.\n"
_COLUMNS = """
## Columns of the tables of a run

The parquet files contain the units and meanings too. A name with `*` stands for one column per bead or contact:
`rotation_1`, `rotation_2`, …

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


def _keys() -> str:
    """Keys of case files and columns of tables, read off the declarations that the program itself uses."""
    keys = "".join(f"\n### {place}\n\n{table}" for place, table in tables_of_keys())
    runs = "\n".join(_described(name, quantities) for name, quantities in TABLES.items())
    sweeps = "\n".join(_described(title, GROUPS[group]) for group, title in _GROUPS.items())
    status = "".join(
        f"| `{name}` | {unit} | {meaning} |\n" for name, (unit, meaning) in STATE.items()
    )
    return f"{_KEYS}{keys}{_COLUMNS}{runs}{_SWEEPS}{sweeps}{status}"


_LIBRARY = """# Library

The library of the program. A case can override each number. `walkers library` prints it.

Sources of liquids give the temperature. Densities and moduli of a grade differ by several per cent.
"""


def _library() -> str:
    """The library of materials and liquids with its sources, as ``walkers library`` has it."""
    text, entries = _LIBRARY, catalogue()
    for kind in ("materials", "liquids", "surface pairs"):
        text += f"\n## {kind.capitalize()}\n"
        for entry in (entry for entry in entries if entry.kind == kind):
            linked = {
                key: _PAGE.sub(r"[docs/\1](../../\1)", number.source)
                for key, number in entry.numbers.items()
            }
            rows = ((*_numbers(key, number), linked[key]) for key, number in entry.numbers.items())
            table = markdown(["", "value", "range", "source"], rows)
            text += f"\n### {entry.name}\n\n{entry.text}\n\n{table}"
    defaults = {
        entry.name: entry.numbers["default"] for entry in entries if entry.kind == "not measured"
    }
    guesses = (_numbers(*default) for default in defaults.items())
    return (
        f"{text}\n## Not measured\n\n{NOT_KNOWN}\n\n{markdown(['', 'default', 'range'], guesses)}"
    )


def _numbers(key: str, number: LibraryNumber) -> tuple[str, str, str]:
    return (
        f"`{key}`",
        str(number.written),
        f"{number.range[0]} to {number.range[1]}" if number.range else "",
    )


def _shipped() -> str:
    text = "# Shipped cases, sweeps and calibrations\n\nEvery command accepts these names instead of a file.\n"
    for kind, command in COMMANDS.items():
        entries = (entry for entry in catalogue() if entry.kind == kind)
        rows = ((f"`walkers {command} {entry.name}`", entry.text) for entry in entries)
        text += f"\n## {kind.capitalize()}\n\n{markdown(['', 'title'], rows)}"
    return text


_COMMANDS = """# Commands

The output of `walkers --help` and of `walkers COMMAND --help`. `walkers --install-completion` installs the completion
of commands, options, cases, sweeps and runs for bash, zsh and fish; call it again after an update of the program.

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
    text, app = _COMMANDS, program()
    names: list[list[str]] = [[]]
    for name in (command.name for command in ALL_COMMANDS):
        names += [[name], *([name, part] for part in app[name] if part[0] != "-")]
    for words in names:
        head, page = " ".join(["walkers", *words]), io.StringIO()
        with redirect_stdout(page):
            app([*words, "--help"]) if words else print_help()
        text += (
            f"\n## {head}\n" * bool(words) + f"\n```text\n$ {head} --help\n{page.getvalue()}```\n"
        )
    return text


PAGES = {"commands": _commands, "tables": _keys, "library": _library, "shipped": _shipped}


def _write(_app: Sphinx | None = None, _config: Config | None = None) -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, page in PAGES.items():
        path, text = FOLDER / f"{name}.md", page()
        if not path.exists() or path.read_text("utf-8") != text:  # else Sphinx would read it again
            path.write_text(text, "utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for files."""
    app.connect("config-inited", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    _write()
