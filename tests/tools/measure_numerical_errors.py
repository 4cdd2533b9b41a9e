"""Measure the numerical errors of the shipped cases of walkers, and write the table of them (minutes of computing).

    python tests/tools/measure_numerical_errors.py

Each case runs as it is, at half its time step, and with beads `STIFFER` times as hard. The last is compared with the
first at a step that is smaller by the square root of that besides, for the limit of the step falls so.
"""

from __future__ import annotations

from math import sqrt
from pathlib import Path

import walkers
from walkers.inputs import numerical

CASES = ("fig1b", "fig4a", "fig4b", "symmetric", "climber", "tray")
OUT = Path("runs/numerical-errors")
HEAD = f"""\
# Numerical errors of the velocities of shipped cases, mm/s: how much a velocity changes at half the time step
# (half_step), and then with beads of {numerical.STIFFER:g} times the Young's modulus (stiffer). A hash names the case.
# Written by tests/tools/measure_numerical_errors.py.
"""


def changes_of(name: str) -> list[dict[str, str]]:
    """What the case is changed by, in the order of the table's keys."""
    case = walkers.load_case(name)
    half, modulus = 0.5e6 * case.run.time_step, numerical.STIFFER * case.contact.youngs_modulus
    harder = {
        "run.time_step": f"{half / sqrt(numerical.STIFFER):.9g} us",
        "contact.youngs_modulus": f"{modulus * 1e-6:g} MPa",
    }
    return [{}, {"run.time_step": f"{half:.9g} us"}, harder]


def main() -> None:
    """Measure, and write the table."""
    blocks = [HEAD]
    for name in CASES:
        runs = [walkers.run(walkers.load_case(name, changes), OUT) for changes in changes_of(name)]
        own, half, harder = (1e3 * run.result["velocity"]["mean"] for run in runs)
        values = {"velocity": own, "half_step": half - own, "stiffer": harder - half}
        lines = [f"{key:9} = {value:.4g}\n" for key, value in values.items()]
        blocks.append(f'[{name}]\ncase      = "{numerical.digest(walkers.load_case(name))}"\n' + "".join(lines))
        print(blocks[-1])
    Path(numerical.__file__).with_name(numerical.TABLE).write_text("\n".join(blocks), encoding="utf-8")


if __name__ == "__main__":
    main()
