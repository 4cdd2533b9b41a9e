"""The commands of the program, in the order of ``walkers --help``.

The module of a command is imported when the command is called: ``walkers --help`` needs this table
alone. ``check`` has commands of its own.
"""

from __future__ import annotations

from typing import NamedTuple


class Command(NamedTuple):
    """A command of the program.

    Attributes
    ----------
    name
        What the user types.
    heading
        Its heading in the help.
    place
        ``module:function``.
    summary
        What it does; the first paragraph of the function's docstring.
    """

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
        name="new",
        heading=_RUN,
        place="walkers.commands.run:new",
        summary="Write a commented case file as a starting point.",
    ),
    Command(
        name="show",
        heading=_RUN,
        place="walkers.commands.run:show",
        summary=(
            "Show all values of a case with their sources, the forces, the time step and "
            "the predicted run time."
        ),
    ),
    Command(
        name="run",
        heading=_RUN,
        place="walkers.commands.run:run",
        summary=(
            "Run cases and print the results. A finished run is only printed, an "
            "interrupted run continues."
        ),
    ),
    Command(
        name="sweep",
        heading=_RUN,
        place="walkers.commands.run:sweep",
        summary=(
            "Run the missing points of a sweep on all cores or on a cluster. Exit status 1 "
            "if a point fails."
        ),
    ),
    Command(
        name="list",
        heading=_LOOK,
        place="walkers.commands.look:list_",
        summary=(
            "List runs and sweeps with status, result, age and size, or print the table of "
            "one sweep."
        ),
    ),
    Command(
        name="log",
        heading=_LOOK,
        place="walkers.commands.look:log",
        summary=(
            "Print the engine's log of a run, finished or not; of a pile, that of all "
            "segments in order."
        ),
    ),
    Command(
        name="plot",
        heading=_LOOK,
        place="walkers.commands.look:plot",
        summary=(
            "Plot a run (path, orientation and gait of walkers; climbs of piles) or a "
            "column of a sweep's table."
        ),
    ),
    Command(
        name="render",
        heading=_LOOK,
        place="walkers.commands.look:render",
        summary=(
            "Render pictures of a run at several times, or a film with --film; before any "
            "run, the start of the case."
        ),
    ),
    Command(
        name="report",
        heading=_LOOK,
        place="walkers.commands.look:report",
        summary=(
            "Write a self-contained HTML report: parameters, results, plots and a 3-D view "
            "of the motion."
        ),
    ),
    Command(
        name="compare",
        heading=_LOOK,
        place="walkers.commands.look:compare",
        summary=(
            "Compare two runs or cases in parameters and results, or the points of a sweep "
            "with its first; --set changes the second case."
        ),
    ),
    Command(
        name="climb",
        heading=_LOOK,
        place="walkers.commands.look:climb",
        summary=(
            "Print probability, rate and speed of climbs in piles for each condition, with "
            "confidence intervals."
        ),
    ),
    Command(
        name="export",
        heading=_KEEP,
        place="walkers.commands.keep:export",
        summary=(
            "Write a run for other programs: LIGGGHTS deck, VTK for ParaView, LAMMPS dump, "
            "CSV tables, or an archive to publish."
        ),
    ),
    Command(
        name="clean",
        heading=_KEEP,
        place="walkers.commands.keep:clean",
        summary=(
            "Remove interrupted and failed runs, or the given runs and sweeps. Asks first. "
            "Runs in progress stay."
        ),
    ),
    Command(
        name="check",
        heading=_CHECK,
        place="walkers.commands.check:check",
        summary=(
            "Check the engine, the contact model, one case, or files. Exit status 1 if "
            "something differs."
        ),
    ),
    Command(
        name="library",
        heading=_CHECK,
        place="walkers.commands.check:library",
        summary=(
            "List materials, liquids, friction, bridge laws, cases, sweeps and "
            "calibrations, or print one with its sources."
        ),
    ),
    Command(
        name="calibrate",
        heading=_CHECK,
        place="walkers.commands.check:calibrate",
        summary=(
            "Calibrate unknown parameters to measured or published values. An interrupted "
            "calibration continues."
        ),
    ),
)
"""All commands in the order of ``walkers --help``."""
