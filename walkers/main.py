"""The program ``walkers``. Exit status: 0 done, 1 a run failed, 2 bad input, 130 interrupted, 143 or 129 terminated."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import warnings
from contextlib import suppress
from importlib import import_module
from inspect import isfunction
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

import walkers.inputs
from walkers.commands import GROUPS, SECTIONS
from walkers.completion import offering

_INTERRUPTED = 130
_OPTIONS = {"changes": "--set", "formats": "--format"}
"""Options with another name than the argument of the function."""
_ENGINE_SECONDS = 10.0
"""Longest time, s, for the engine to print its version."""


class _Terminated(BaseException):
    """SIGTERM, or SIGHUP of a terminal that is closed, as an exception: engines are stopped on the way out."""

    def __init__(self, number: int) -> None:
        self.status = 128 + number
        super().__init__("terminated" if number == signal.SIGTERM else "the terminal was closed")


def _on_signal(number: int, _frame: FrameType | None) -> NoReturn:
    raise _Terminated(number)


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the program and exit."""
    signal.signal(signal.SIGTERM, _on_signal)
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # nohup
        signal.signal(signal.SIGHUP, _on_signal)
    warnings.showwarning = lambda message, *_, **__: print(f"walkers: warning: {message}", file=sys.stderr)
    sys.exit(_status(arguments))


def _status(arguments: list[str] | None) -> int:
    """Run the program and return its exit status. Unexpected errors are raised."""
    try:
        outcome: Any = _program()(arguments, standalone_mode=False, prog_name="walkers")
        sys.stdout.flush()
    except (Exception, KeyboardInterrupt, SystemExit, _Terminated) as stop:
        return _report_stop(stop)
    if outcome == _INTERRUPTED:  # typer turns Ctrl-C into a status
        return _tell("interrupted", _INTERRUPTED)
    return outcome if isinstance(outcome, int) else 0


class _Grouped(TyperGroup):
    """The commands under the headings of `GROUPS`. An unknown command is refused with a suggestion."""

    def format_commands(self, _ctx: Any, formatter: Any) -> None:
        """Write the commands below their headings."""
        for heading in dict.fromkeys(GROUPS.values()):
            names = sorted(self.commands, key=lambda name: name not in SECTIONS)
            there = [name for name in names if getattr(self.commands[name], "rich_help_panel", "") == heading]
            with formatter.section(heading):
                formatter.write_dl([(name, self.commands[name].get_short_help_str(1000)) for name in there])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the first argument names."""
        if args[0] not in self.commands and not ctx.resilient_parsing:
            from walkers.errors import refused, suggestion

            other = suggestion(args[0], self.commands) or "; walkers --help lists them"
            raise refused(args[0], f"no such command{other}")
        return super().resolve_command(ctx, args)


class _OrCase(TyperGroup):
    """Sub-commands of a command; any other word is CASE."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The sub-command with a name."""
        return super().get_command(ctx, cmd_name) or self.commands.get("CASE")

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of the sub-commands; for the completion of a shell, also of cases."""
        case = "CASE" in self.commands
        return [*self.commands, *(offering("case")(ctx, "") if case and ctx.resilient_parsing else ())]


def _program() -> typer.Typer:
    """The program, whose commands are the public functions of the modules of `GROUPS`."""
    # Rich takes longer to load than everything else that most commands need.
    plain: dict[str, Any] = {"no_args_is_help": True, "pretty_exceptions_enable": False, "rich_markup_mode": None}
    plain["context_settings"] = {"help_option_names": ["-h", "--help"]}
    program = typer.Typer(name="walkers", cls=_Grouped, help="Wet granular walkers, simulated with LIGGGHTS.", **plain)
    program.callback()(_options)
    parts: dict[str, typer.Typer] = {}
    for module, heading in GROUPS.items():
        place = f"walkers.commands.{module}"
        for name, function in vars(import_module(place)).items():
            if not isfunction(function) or function.__module__ != place or name.startswith("_"):
                continue
            section, _, command = name.strip("_").rpartition("_")
            if section and section not in parts:
                either = "CASE|COMMAND" if section == "check" else "COMMAND"
                how: dict[str, Any] = {"help": SECTIONS[section], "subcommand_metavar": f"{either} [ARGS]..."}
                parts[section] = typer.Typer(cls=_OrCase, **how, **plain)
                program.add_typer(parts[section], name=section, rich_help_panel=heading)
            command = "CASE" if command == "case" else command
            home = parts.get(section, program)
            home.command(command, short_help=function.__doc__, rich_help_panel=heading)(function)
    return program


def _show_version(wanted: bool) -> None:
    if wanted:
        print(describe_version())
        raise typer.Exit


def _use_library(file: Path | None) -> None:
    walkers.inputs.chosen_library = file


def _options(
    library: Annotated[
        Path | None,
        typer.Option(callback=_use_library, help="Your own library file; default: library.toml beside the case."),
    ] = None,
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_show_version, help="Show the versions and exit.")
    ] = False,
) -> None:
    """Options of the program."""


def describe_version() -> str:
    """Versions of the package (with its commit, if known) and of the engine, one per line."""
    from walkers.runner.binary import find_engine, version_in
    from walkers.runner.failures import EngineMissing
    from walkers.runner.provenance import PROJECT, software

    ours = software()
    package = f"{PROJECT} {ours['granular_walkers']}" + (f" (commit {ours['commit']})" if ours["commit"] else "")
    try:
        path = find_engine().path
    except EngineMissing as missing:
        return f"{package}\n{missing}"
    version, command = None, [str(path), "-log", "none", "-in", "/dev/null"]
    with TemporaryDirectory() as folder, suppress(OSError, subprocess.TimeoutExpired):  # it writes files there
        how: dict[str, Any] = {"cwd": folder, "stdin": subprocess.DEVNULL, "timeout": _ENGINE_SECONDS}
        version = version_in(subprocess.run(command, capture_output=True, check=False, **how).stdout)
    return f"{package}\n{version or 'an engine that does not name its version'}, {path}"


def _report_stop(stop: BaseException) -> int:
    """Print why the program stopped, and return its exit status."""
    from walkers.errors import InputError, WalkersError, WrongArgument

    if isinstance(stop, WrongArgument):
        return _tell(f"{_OPTIONS.get(stop.source, f'--{stop.source}')}: {stop.problems[0]}", 2)
    known = ((InputError, 2), (WalkersError, 1), (KeyboardInterrupt, _INTERRUPTED), (typer.Abort, _INTERRUPTED))
    status = stop.status if isinstance(stop, _Terminated) else next((s for k, s in known if isinstance(stop, k)), None)
    if status is not None:
        return _tell(str(stop) or "interrupted", status)
    # The reader of the output, such as head, has closed it; this is not a failure.
    if isinstance(stop if isinstance(stop, OSError) else stop.__context__, BrokenPipeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the end of the interpreter flushes it again
        return 0
    if isinstance(stop, OSError):  # a given path cannot be read or written
        return _tell(f"{stop.filename}: {stop.strerror}" if stop.filename else str(stop), 2)
    # Typer's usage errors print themselves and have their own exit status.
    if hasattr(stop, "show") and hasattr(stop, "exit_code"):
        stop.show()
        return int(stop.exit_code)
    raise stop


def _tell(message: str, status: int) -> int:
    print(f"walkers: {message}", file=sys.stderr)
    return status


if __name__ == "__main__":
    main()
