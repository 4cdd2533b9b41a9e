"""The commands of the program, in the order of ``walkers --help``.

The module of a command is imported when the command is called: ``walkers --help`` needs this table alone. ``check``
has commands of its own.
"""

from __future__ import annotations

from typing import NamedTuple


class Command(NamedTuple):
    """A command: its name, its heading in the help, ``module:function``, and its summary."""

    name: str
    heading: str
    place: str
    summary: str


_RUN = "Run"
_LOOK = "Look at results"
_KEEP = "Keep and share"
_CHECK = "Check and calibrate"

ALL_COMMANDS = (
    Command(
        "new",
        _RUN,
        "walkers.commands.run:new",
        "Write a commented case file as a starting point.",
    ),
    Command(
        "show",
        _RUN,
        "walkers.commands.run:show",
        "Show all values of a case with their sources, the forces, the time step and the predicted run time.",
    ),
    Command(
        "run",
        _RUN,
        "walkers.commands.run:run",
        "Run cases and print the results. A finished run is only printed, an interrupted run continues.",
    ),
    Command(
        "sweep",
        _RUN,
        "walkers.commands.run:sweep",
        "Run the missing points of a sweep on all cores or on a cluster. Exit status 1 if a point fails.",
    ),
    Command(
        "list",
        _LOOK,
        "walkers.commands.look:list_",
        "List runs and sweeps with status, result, age and size, or print the table of one sweep.",
    ),
    Command(
        "plot",
        _LOOK,
        "walkers.commands.look:plot",
        "Plot a run (path, orientation and gait of walkers; climbs of piles) or a column of a sweep's table.",
    ),
    Command(
        "render",
        _LOOK,
        "walkers.commands.look:render",
        "Render pictures of a run at several times, or a film with --film.",
    ),
    Command(
        "report",
        _LOOK,
        "walkers.commands.look:report",
        "Write a self-contained HTML report: parameters, results, plots and a 3-D view of the motion.",
    ),
    Command(
        "compare",
        _LOOK,
        "walkers.commands.look:compare",
        "Compare two runs or cases in parameters and results; --set changes the second case.",
    ),
    Command(
        "climb",
        _LOOK,
        "walkers.commands.look:climb",
        "Print probability, rate and speed of climbs in piles for each condition, with confidence intervals.",
    ),
    Command(
        "export",
        _KEEP,
        "walkers.commands.keep:export",
        "Write a run for other programs: LIGGGHTS deck, VTK for ParaView, LAMMPS dump, or an archive to publish.",
    ),
    Command(
        "clean",
        _KEEP,
        "walkers.commands.keep:clean",
        "Remove interrupted and failed runs, or the given runs and sweeps. Asks first. Runs in progress stay.",
    ),
    Command(
        "check",
        _CHECK,
        "walkers.commands.check:check",
        "Check the engine, the contact model, one case, or files. Exit status 1 if something differs.",
    ),
    Command(
        "library",
        _CHECK,
        "walkers.commands.check:library",
        "List materials, liquids, friction, bridge laws, cases, sweeps and calibrations, "
        "or print one with its sources.",
    ),
    Command(
        "calibrate",
        _CHECK,
        "walkers.commands.check:calibrate",
        "Calibrate unknown parameters to measured or published values. An interrupted calibration continues.",
    ),
)
"""Summaries are the first lines of the functions' docstrings."""
