"""Which law of friction the facts of the paper favour, in the engine.

``python -m studies.frictions_by_engine`` prints the table of docs/explanation/friction.md. Each law
is calibrated to the same facts with as many parameter sets, and its emulators predict each figure
from all others.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.special import logsumexp

from studies.friction_laws import LAWS, calibration_with
from walkers.arrays import FloatArray
from walkers.calibration.calibrate import Outcome, calibrate
from walkers.calibration.emulator import Posterior
from walkers.inputs.axes import unit_cube
from walkers.main import main, new_app
from walkers.sweeps.scheduler import SweepOptions
from walkers.text import aligned_rows

COMMAND = "python -m studies.frictions_by_engine"
app = new_app(COMMAND)

_POINTS = 1 << 15
"""Number of points of the prior at which the emulators are evaluated."""
_SHOWN = ("curve_3g", "velocity_6g", "fig4a_velocity", "fig4b_velocity", "fig4b_rotation")
"""Facts whose predictions from other figures the table shows."""


def log_likelihoods(outcome: Outcome) -> dict[str, FloatArray]:
    """Logarithms of the likelihoods of the facts at points of the prior.

    Parameters
    ----------
    outcome
        A calibration.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        By the name of the observation; without those that have no weight.
    """
    seed = outcome.calibration.file.design.seed
    points = unit_cube(len(outcome.calibration.file.parameters), _POINTS, seed)
    likelihoods = {}
    for name, emulator in outcome.emulators.items():
        if emulator.observation.weighed:
            likelihoods[name] = emulator.log_likelihood(points)
    return likelihoods


def density_of_group(
    likelihoods: dict[str, FloatArray], groups: dict[str, str], group: str
) -> float:
    """Logarithm of the density that the facts of other groups predict for a group of facts.

    Parameters
    ----------
    likelihoods
        As from `log_likelihoods`.
    groups
        The group of each fact, by its name.
    group
        The group that is predicted.
    """
    everything = np.sum(list(likelihoods.values()), axis=0)
    given = [column for name, column in likelihoods.items() if groups[name] != group]
    without = np.sum(given, axis=0)
    return float(logsumexp(everything) - logsumexp(without))


def row(law: str, outcome: Outcome) -> dict[str, str]:
    """The row of a law: texts by the heads of the columns."""
    observations = outcome.calibration.file.observations
    groups = {observation.name: observation.group for observation in observations}
    likelihoods = log_likelihoods(outcome)
    texts = {"law": LAWS[law].title, "numbers": str(len(outcome.calibration.file.parameters))}
    total = 0.0
    for group in dict.fromkeys(groups[name] for name in likelihoods):
        density = density_of_group(likelihoods, groups, group)
        texts[group] = f"{density:.1f}"
        total += density
    texts["all"] = f"{total:.1f}"
    evidence = logsumexp(np.sum(list(likelihoods.values()), axis=0)) - np.log(_POINTS)
    texts["evidence"] = f"{evidence:.1f}"
    agreeing = []
    for numbers in outcome.numbers.values():
        agree = [
            observation.agrees(number)
            for observation, number in zip(observations, numbers, strict=True)
            if not observation.derived
        ]
        agreeing.append(sum(agree))
    counted = [observation for observation in observations if not observation.derived]
    texts["best set"] = f"{max(agreeing)} of {len(counted)}"
    for name in _SHOWN:
        texts[name] = _prediction(outcome, name)
    return texts


def _prediction(outcome: Outcome, name: str) -> str:
    """The median of a fact, and 5 to 95 %, predicted from the facts of other groups."""
    emulator = outcome.emulators[name]
    seed = outcome.calibration.file.design.seed
    without_group = Posterior.from_emulators(
        list(outcome.emulators.values()), _POINTS, seed, [emulator.observation.group]
    )
    samples = without_group.samples
    normal = np.random.default_rng(seed).standard_normal(len(samples))
    scale = emulator.observation.unit[1]
    low, median, high = scale * np.percentile(emulator.numbers(samples, normal), (5, 50, 95))
    return f"{median:.2g} ({low:.2g} to {high:.2g})"


def outcomes(out: Path, options: SweepOptions | None = None) -> dict[str, Outcome]:
    """Calibrate all laws; it takes an hour on two cores and goes on where it was interrupted.

    Parameters
    ----------
    out
        Folder of the runs.
    options
        As for `walkers.sweeps.scheduler.run_sweep`.
    """
    calibrated = {}
    for law in LAWS:
        calibrated[law] = calibrate(
            calibration_with(law), out, options or SweepOptions(), progress=True
        )
    return calibrated


def rows(out: Path) -> list[dict[str, str]]:
    """The table: a row for each law of `studies.friction_laws`."""
    return [row(law, outcome) for law, outcome in outcomes(out).items()]


@app.default
def frictions_by_engine(*, out: Path = Path("runs")) -> None:
    """Print how well laws of friction predict the figures of the paper, in the engine.

    Parameters
    ----------
    out
        Folder of the runs.
    """
    table = rows(out)
    print(aligned_rows(table, right=range(1, len(table[0]) - len(_SHOWN))))


if __name__ == "__main__":
    main(app=app)
