"""The program ``walkers``: its help, signals, messages and exit statuses.

The exit status is 0 if the command is done, 1 if a run failed, 2 for bad input, 130 after Ctrl-C,
143 if the program was terminated, and 129 if its terminal was closed. The commands are in
`walkers.commands`.
"""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from itertools import groupby
from tempfile import TemporaryDirectory
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

from walkers.commands import ALL_COMMANDS
from walkers.errors import InputError, WalkersError, shortened
from walkers.terminal import ERROR, HEADING, WARNING, message_text, styled, text_width, wrapped
from walkers.text import printable

if TYPE_CHECKING:
    from cyclopts import App, CycloptsError
    from cyclopts.help import HelpEntry, HelpPanel

_SUMMARY = "Wet granular walkers, simulated with LIGGGHTS."
"""What the program is, in its help."""

_OPTIONS = {
    "--help, -h": "Display this message and exit. Of a command: walkers help COMMAND.",
    "--version": (
        "Show the versions of the package (with its commit, if known) and of the engine, and exit."
    ),
    "--install-completion": (
        "Install the completion of commands, options, cases, runs and sweeps for your shell."
    ),
}
"""Options of the program without a command, in its help."""

_LARGEST_NAME_WIDTH = 24
"""Largest width of the first column of the help, characters."""

_OLD_NAMES = ("--out", "-o")
"""Earlier names of options, which help leaves out."""

_LARGEST_HELP_WIDTH = 80
"""Largest width of the help, characters; narrower terminals have it fitted to them."""

_LONGEST_MESSAGE = 1000
"""Largest length of a message about the command line, characters."""

_FAILED = 1
"""Exit status of a command whose run failed."""

_BAD_INPUT = 2
"""Exit status for bad input."""

_INTERRUPTED = 130
"""Exit status after Ctrl-C."""

_ENGINE_SECONDS = 10.0
"""Longest time for the engine to print its version, s."""


class _Terminated(BaseException):
    """SIGTERM, or SIGHUP of a terminal that is closed, as an exception.

    Thus the engines are stopped before the program ends.
    """

    def __init__(self, number: int) -> None:
        self.status = 128 + number
        super().__init__("terminated" if number == signal.SIGTERM else "the terminal was closed")


def _on_signal(number: int, _frame: FrameType | None) -> NoReturn:
    raise _Terminated(number)


def main(arguments: list[str] | None = None, app: App | None = None) -> NoReturn:
    """Run the program or another app, and exit.

    Parameters
    ----------
    arguments
        The words of the command line; default: those of this process.
    app
        An app of `new_app`; default: the program.
    """
    _prepare_streams()
    # The program opens no windows, and matplotlib refuses unknown names of backends.
    os.environ["MPLBACKEND"] = "agg"
    signal.signal(signal.SIGTERM, _on_signal)
    is_ignored = signal.getsignal(signal.SIGHUP) == signal.SIG_IGN  # as by nohup
    if not is_ignored:
        signal.signal(signal.SIGHUP, _on_signal)
    warnings.showwarning = _show_warning
    tokens = sys.argv[1:] if arguments is None else arguments
    sys.exit(_status(tokens, app))


def _show_warning(message: object, *_position: object, **_options: object) -> None:
    """Print a warning as the program prints messages."""
    _print_message("walkers: warning:", str(message), WARNING)


def _prepare_streams() -> None:
    """Open streams that are closed, and print letters that their encoding lacks, such as Γ."""
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            # A file takes the lowest free number, so the next one would be the output.
            os.open(os.devnull, os.O_RDWR)
    if sys.stdout is None:
        sys.stdout = open(1, "w", encoding="utf-8")  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(2, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")


def _status(tokens: list[str], app: App | None = None) -> int:
    """Run the program, or another app, and return its exit status. Unexpected errors are raised."""
    try:
        outcome = None
        if app is None and tokens[:1] == ["help"]:
            tokens = [*tokens[1:], "--help"]
        if app is None and tokens in ([], ["--help"], ["-h"]):
            print_help()
        else:
            app = app or program()
            outcome = app(tokens)
        sys.stdout.flush()
    except (Exception, KeyboardInterrupt, SystemExit, _Terminated) as stop:
        return _report_stop(stop, tokens, app or program())
    return outcome if isinstance(outcome, int) else 0


def print_help() -> None:
    """Print the commands and options of the program.

    Without cyclopts and rich this takes a tenth of the time.
    """
    print(f"{styled('Usage:', HEADING)} walkers COMMAND [OPTIONS]\n\n{_SUMMARY}")
    for heading, group in groupby(ALL_COMMANDS, lambda command: command.heading):
        _print_panel(heading, {command.name: command.summary for command in group})
    _print_panel("Options", _OPTIONS)


def _help_width() -> int:
    """Width of the help, characters."""
    return min(_LARGEST_HELP_WIDTH, text_width())


def _print_panel(title: str, meanings: Mapping[str, str]) -> None:
    """Print names and their meanings in two columns below a heading."""
    if not meanings:
        return
    width = min(_LARGEST_NAME_WIDTH, max(len(name) for name in meanings))
    margin = " " * (width + 4)
    print(f"\n{styled(f'{title}:', HEADING)}")
    for name, meaning in meanings.items():
        first, *rest = wrapped(meaning, width=_help_width() - len(margin)) or [""]
        if len(name) <= width:
            print(f"  {name:{width}}  {first}")
        else:
            print(f"  {name}")
            print(f"{margin}{first}")
        for line in rest:
            print(f"{margin}{line}")


class _PlainHelp:
    """Help of a command in plain text.

    Attributes
    ----------
    before_panels
        Usage and description, until they are printed with the first panel: it has the names of the
        arguments, which the usage of cyclopts lacks.
    """

    def __init__(self) -> None:
        self.before_panels: list[str] = []

    def __call__(self, _console: object, _options: object, panel: HelpPanel) -> None:
        if not panel.entries:
            return
        if self.before_panels:
            usage, *description = self.before_panels
            self.before_panels = []
            print("\n".join([_complete_usage(usage, panel.entries), *description]))
        meanings = {}
        for entry in panel.entries:
            names = ", ".join(_labels(entry))
            meaning = _plain(entry.description)
            if entry.default not in (None, "False"):
                meaning += f" [default: {entry.default}]"
            meanings[names] = meaning
        _print_panel(str(panel.title), meanings)

    def render_usage(self, _console: object, _options: object, usage: Any) -> None:
        """Print how the command is called."""
        self.before_panels.append(f"{styled('Usage:', HEADING)} {_plain(usage)}")

    def render_description(self, _console: object, _options: object, description: Any) -> None:
        """Print what the command does."""
        lines = wrapped(_plain(description), width=_help_width())
        self.before_panels.append("\n".join(["", *lines]))


def _complete_usage(usage: str, entries: Iterable[HelpEntry]) -> str:
    """A line of usage with the names of the arguments that need not be given, and with choices."""
    optional = [entry for entry in entries if not entry.required]
    arguments = [entry.display_labels[0] for entry in optional if entry.display_labels]
    names = "] [".join(name for name in arguments if not name.startswith("-"))
    return usage.replace("[ARGS...]", f"[{names}...]").replace("[ARGS]", f"[{names}]")


def _labels(entry: HelpEntry) -> list[str]:
    """The names of an option or argument, the last one with its choices or the kind of value."""
    labels = [name for name in entry.display_labels if name not in _OLD_NAMES]
    if entry.metavar and not entry.positional_label:
        value = "|".join(entry.choices) if entry.choices else entry.metavar
        labels[-1] += f" {value}"
    return labels


def _plain(text: Any) -> str:
    """A text of cyclopts without its markup."""
    return str(getattr(text, "primary_renderable", text)).strip()


def program() -> App:
    """The program with all of its commands. A command is imported when it is called."""
    app = new_app("walkers", _SUMMARY)
    for command in ALL_COMMANDS:
        app.command(command.place, name=command.name, help=command.summary)
    app.command(print_version, name="--version")
    app.register_install_completion_command(help=_OPTIONS["--install-completion"])
    return app


def new_app(name: str, summary: str | None = None) -> App:
    """An app with help in plain text, which leaves the messages about errors to `main`.

    Parameters
    ----------
    name
        How the app is called, such as ``walkers``; messages and help name it so.
    summary
        The first line of its help; default: that of its default command.

    Returns
    -------
    cyclopts.App
        An app without commands.
    """
    from cyclopts import App, Parameter

    formatter: Any = _PlainHelp()  # its unused arguments have names of their own
    return App(
        name,
        summary,
        version_flags=(),
        default_parameter=Parameter(negative=()),
        result_action="return_value",
        print_error=False,
        exit_on_error=False,
        suppress_keyboard_interrupt=False,
        help_formatter=formatter,
        help_format="plaintext",
        group_parameters="Options",
    )


def print_version() -> None:
    """Show the versions of the package (with its commit, if known) and of the engine, and exit."""
    from walkers.runner.binary import find_engine, version_in
    from walkers.runner.failures import EngineMissing
    from walkers.runner.provenance import PROJECT, software

    versions = software()
    package = f"{PROJECT} {versions['granular_walkers']}"
    if versions["commit"]:
        package += f" (commit {versions['commit']})"
    print(package)
    try:
        path = find_engine().path
    except EngineMissing as missing:
        print(missing)
        return
    version = None
    command = [str(path), "-log", "none", "-in", "/dev/null"]
    with TemporaryDirectory() as folder, suppress(OSError, subprocess.TimeoutExpired):
        engine = subprocess.run(
            command,
            cwd=folder,  # the engine writes files into it
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=False,
            timeout=_ENGINE_SECONDS,
        )
        version = version_in(engine.stdout)
    print(f"{version or 'an engine that does not name its version'}, {path}")


def _report_stop(stop: BaseException, tokens: list[str], app: App) -> int:
    """Print why a command has stopped and return the exit status; raise unexpected errors."""
    from cyclopts import CycloptsError

    if isinstance(stop, SystemExit):
        return stop.code if isinstance(stop.code, int) else 0
    if isinstance(stop, (_Terminated, KeyboardInterrupt, WalkersError)):
        return _report_own_stop(stop, tokens, app)
    if _is_broken_pipe(stop):
        # The interpreter flushes the output once more at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 0
    message = _message_of_system(stop)
    if not message:
        if not isinstance(stop, CycloptsError):
            raise stop
        message = _message_of_command_line(stop, app)
    return _tell(message, _BAD_INPUT)


def _report_own_stop(
    stop: _Terminated | KeyboardInterrupt | WalkersError, tokens: list[str], app: App
) -> int:
    """Print a signal or an error of the package, and return the exit status."""
    if isinstance(stop, _Terminated):
        return _tell(str(stop), stop.status)
    if isinstance(stop, KeyboardInterrupt):
        return _tell(str(stop) or "interrupted", _INTERRUPTED)
    if isinstance(stop, InputError):

        def name_of(source: str) -> str:
            return source if source in tokens else _options_of(source, tokens, app)

        return _tell(str(stop.in_command(name_of)), _BAD_INPUT)
    return _tell(str(stop), _FAILED)


def _is_broken_pipe(stop: BaseException) -> bool:
    """Whether the reader of the output, such as head, has closed it, which is not a failure."""
    error = stop if isinstance(stop, OSError) else stop.__context__
    return isinstance(error, BrokenPipeError)


def _message_of_system(stop: BaseException) -> str:
    """Message about a path that cannot be used or about an impossible clock; else empty."""
    if isinstance(stop, OSError):
        return f"{stop.filename}: {stop.strerror}" if stop.filename else str(stop)
    if isinstance(stop, OverflowError) and _clock_is_wrong():
        return f"the clock of this machine is wrong ({stop})"
    return ""


def _clock_is_wrong() -> bool:
    """Whether the clock of this machine gives no valid date, as after its battery has failed."""
    try:
        datetime.now(UTC)
    except (OverflowError, ValueError, OSError):
        return True
    return False


def _message_of_command_line(stop: CycloptsError, app: App) -> str:
    """Message about an option or argument that a command does not take, or lacks."""
    from cyclopts import MissingArgumentError, UnusedCliTokensError

    message = str(stop)
    if isinstance(stop, UnusedCliTokensError) and stop.unused_tokens:
        message = f"Unexpected: {' '.join(stop.unused_tokens)}."
    if isinstance(stop, MissingArgumentError) and stop.argument:
        choices = stop.argument.get_choices()
        if choices:
            message += f" Choose from: {', '.join(choices)}."
    commands: Sequence[str] = stop.command_chain or ()
    help_command = " ".join([*app.name, *commands, "--help"])
    return f"{shortened(printable(message), _LONGEST_MESSAGE)} See: {help_command}"


def _options_of(names: str, tokens: list[str], app: App) -> str:
    """Options of the command that is called, for arguments of a function of the package.

    Parameters
    ----------
    names
        Names of arguments, such as ``begin, end``; other names are returned as they are.
    tokens
        The words of the command line.
    app
        The app that is called.
    """
    _, apps, _ = app.parse_commands(tokens)
    options = {}
    arguments = apps[-1].assemble_argument_collection()
    for argument in arguments:
        if argument.field_info.name != "out":  # what is called runs is a folder, not the option
            options[argument.name.removeprefix("--")] = argument.name
    for argument in arguments:
        options[argument.field_info.name] = argument.name
    return ", ".join(options.get(name, name) for name in names.split(", "))


def _tell(message: str, status: int) -> int:
    """Print a message, and return the status."""
    _print_message("walkers:", message, ERROR)
    return status


def _print_message(head: str, message: str, style: str) -> None:
    """Print a message on standard error; its head has a style on a terminal."""
    text = message_text(f"{head} {message}", sys.stderr)
    print(styled(head, style, sys.stderr) + text[len(head) :], file=sys.stderr)


if __name__ == "__main__":
    main()
