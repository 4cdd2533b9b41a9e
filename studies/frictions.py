"""Which law of friction the facts of the paper favour, by the theory of the dimer.

``python -m studies.frictions`` prints the table of docs/explanation/friction.md. It draws the
unknown numbers of each law from their priors, computes the facts of the calibration about walkers
on the axis, and weighs the draws by their likelihood. Each group of facts is predicted from the
others. The theory has rigid beads, which do not lose contact, and no rolling friction.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.paper.sources import ruby
from walkers.arrays import BoolArray, FloatArray
from walkers.calibration.observations import Observation
from walkers.extras import require
from walkers.inputs.axes import unit_cube
from walkers.inputs.tables.case import Case
from walkers.main import main, new_app
from walkers.text import aligned_rows
from walkers.theory.motion import PredictedMotion, Walker, predict_motion
from walkers.theory.quasistatic import translation

COMMAND = "python -m studies.frictions"
app = new_app(COMMAND)

_SEED = 1
"""Seed of the draws."""
_BATCH = 64
"""Number of draws that are computed together."""
DRAWS = 1024
"""Number of draws of each law from the priors of its numbers, a power of two."""
_CYCLES = 30
"""Largest number of cycles of the theory."""
_MODEL_ERROR = 0.5
"""Error of the theory, over the deviation of a fact."""
_DEGREES_OF_FREEDOM = 4
"""Of Student's t, the likelihood of a distance from a fact, as in calibrations."""
_FARTHEST = 30.0
"""Largest distance from a fact, in deviations; it also counts for numbers that do not exist."""
_LINEAR = 1.0
"""Velocity of half of the rise of a friction that grows in proportion to the velocity, m/s."""


@dataclass(frozen=True)
class Prior:
    """What is known of a number: its logarithm is uniform, or normal.

    Attributes
    ----------
    low, high
        Both ends of the uniform distribution; the median and the standard deviation of the
        logarithm of the normal one.
    normal
        Whether it is the normal one.
    """

    low: float
    high: float
    normal: bool = False

    def values(self, uniform: FloatArray) -> FloatArray:
        """Values with this distribution from values that are uniform between 0 and 1."""
        from scipy.stats import norm

        if self.normal:
            return np.asarray(self.low * np.exp(self.high * norm.ppf(uniform)))
        return np.asarray(self.low * (self.high / self.low) ** uniform)


PRIORS: Mapping[str, Prior] = {
    "wall": Prior(0.08, 0.5),
    "wall of Fig. 4": Prior(0.08, 0.5),
    "beads": Prior(0.005, 0.3),
    "slope at walls": Prior(0.3, 100.0),
    "velocity at walls": Prior(5e-4, 0.3),
    "slope of beads": Prior(0.3, 30.0),
    "velocity of beads": Prior(1e-3, 0.3),
    "viscous force": Prior(1.0, 0.5, normal=True),
    "edges": Prior(1.0, 0.5, normal=True),
}
"""Priors of the numbers of laws: frictions at rest, slopes Δμ/v_h of their growth (s/m), velocities
of half of the rise (m/s), and factors of the viscous forces of bridges and of their edges."""


@dataclass(frozen=True)
class Law:
    """A law of friction, with the forces of bridges that go with it.

    Attributes
    ----------
    name
        Its name in the table.
    numbers
        Its unknown numbers, keys of `PRIORS`. A slope without a velocity is that of a friction that
        grows in proportion to the velocity.
    with_viscosity
        Whether friction grows with the product of velocity and viscosity.
    """

    name: str
    numbers: tuple[str, ...]
    with_viscosity: bool = False


_ONE_WALL = ("wall", "beads")
_TWO_WALLS = ("wall", "wall of Fig. 4", "beads")
_WALLS_GROW = (*_ONE_WALL, "slope at walls", "velocity at walls")
_BEADS_GROW = (*_ONE_WALL, "slope of beads")
_BEADS_SATURATE = (*_BEADS_GROW, "velocity of beads")
_BOTH_GROW = (*_WALLS_GROW, "slope of beads", "velocity of beads")
LAWS = (
    Law("Coulomb, one wall", _ONE_WALL),
    Law("Coulomb, two walls", _TWO_WALLS),
    Law("beads grow", _BEADS_GROW),
    Law("beads grow and saturate", _BEADS_SATURATE),
    Law("walls grow and saturate", _WALLS_GROW),
    Law("Coulomb, one wall; viscous force", (*_ONE_WALL, "viscous force")),
    Law("Coulomb, two walls; viscous force", (*_TWO_WALLS, "viscous force")),
    Law("beads grow; viscous force", (*_BEADS_GROW, "viscous force")),
    Law("Coulomb, one wall; edges", (*_ONE_WALL, "edges")),
    Law("Coulomb, two walls; edges", (*_TWO_WALLS, "edges")),
    Law("beads grow; edges", (*_BEADS_GROW, "edges")),
    Law("beads grow with ηv; edges", (*_BEADS_GROW, "edges"), with_viscosity=True),
    Law("beads grow and saturate; edges", (*_BEADS_SATURATE, "edges")),
    Law("walls grow and saturate; edges", (*_WALLS_GROW, "edges")),
    Law("both grow and saturate; edges", (*_BOTH_GROW, "edges")),
    Law("beads grow; edges and viscous force", (*_BEADS_GROW, "edges", "viscous force")),
)
"""The rows of the table."""


# --- the facts ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Facts:
    """The facts about walkers on the axis, and their experiments.

    Attributes
    ----------
    experiments
        Cases by the names of the experiments.
    observations
        The facts of the calibration.
    """

    experiments: Mapping[str, Case]
    observations: Sequence[Observation]

    @property
    def groups(self) -> list[str]:
        """The group of each fact."""
        return [fact.group for fact in self.observations]


def facts() -> Facts:
    """The facts and experiments of the calibration to which the theory applies."""
    calibration = ruby()
    names = list(calibration.experiments)
    cases = dict(zip(names, calibration.sweep("frictions").cases(), strict=True))
    on_axis = {}
    for name, case in cases.items():
        walker = case.walkers[0]
        if walker.angle == 0.0 and walker.radii[0] != walker.radii[1]:
            on_axis[name] = case
    observations = []
    for fact in calibration.file.observations:
        if not fact.derived and on_axis.keys() >= {*fact.of, *fact.over}:
            observations.append(fact)
    return Facts(on_axis, observations)


# --- draws ----------------------------------------------------------------------------------------


def draws(law: Law, count: int) -> dict[str, FloatArray]:
    """Draws of the numbers of a law from their priors: a Sobol sequence, shape (count,) each.

    ``count`` is a power of two.
    """
    uniform = unit_cube(len(law.numbers), count, _SEED)
    return {name: PRIORS[name].values(uniform[:, k]) for k, name in enumerate(law.numbers)}


def distances(law: Law, values: Mapping[str, FloatArray], of: Facts) -> FloatArray:
    """Distances of all facts in deviations, shape (draws, facts).

    Parameters
    ----------
    law
        The law.
    values
        Its numbers, shape (draws,) each.
    of
        The facts.
    """
    cases = [case.with_value_at("liquid.edge_ratio", 1.0) for case in of.experiments.values()]
    parts = []
    count = len(values[law.numbers[0]])
    for start in range(0, count, _BATCH):
        batch = {name: numbers[start : start + _BATCH] for name, numbers in values.items()}
        parts.append(_distances_of_batch(law, batch, cases, of))
    return np.concatenate(parts)


def _distances_of_batch(
    law: Law, values: Mapping[str, FloatArray], cases: Sequence[Case], of: Facts
) -> FloatArray:
    """As `distances`, for a few draws; the cases have an edge ratio of 1."""
    motion = _motion(law, values, cases, list(of.experiments))
    count = len(values[law.numbers[0]])
    rows = []
    for numbers in _quantities(motion, list(of.experiments), count):
        row = []
        for fact in of.observations:
            distance = fact.residual(fact.number_from(numbers))
            row.append(_FARTHEST if np.isnan(distance) else distance)
        rows.append(row)
    clipped: FloatArray = np.clip(np.array(rows), -_FARTHEST, _FARTHEST)
    return clipped


def _motion(
    law: Law, values: Mapping[str, FloatArray], cases: Sequence[Case], names: Sequence[str]
) -> PredictedMotion:
    """The motion of all draws of a law in all K experiments: of draw d at K d, K d + 1, …."""
    count = len(values[law.numbers[0]])
    kinds = len(cases)

    def of_draws(name: str, default: float) -> FloatArray:
        """A number of the law for all walkers."""
        return np.repeat(values.get(name, np.full(count, default)), kinds)

    walker = Walker.joined([Walker.of_case(case) for case in cases] * count)
    wall = of_draws("wall", 0.0)
    if "wall of Fig. 4" in values:
        in_fig_4 = np.tile([name in ("fig4a", "fig4b") for name in names], count)
        wall = np.where(in_fig_4, of_draws("wall of Fig. 4", 0.0), wall)
    viscosity = np.array([case.liquid.of_bridges.viscosity for case in cases])
    slower = np.ones(kinds)
    if law.with_viscosity:
        slower = viscosity / viscosity[0]
    velocity_at_walls = of_draws("velocity at walls", _LINEAR)
    velocity_of_beads = of_draws("velocity of beads", _LINEAR)
    rise_at_walls = of_draws("slope at walls", 0.0) * velocity_at_walls
    rise_of_beads = of_draws("slope of beads", 0.0) * velocity_of_beads
    velocities = np.array([velocity_at_walls, velocity_at_walls, velocity_of_beads])
    walker = replace(
        walker,
        friction=np.array([wall, wall, of_draws("beads", 0.0)]),
        friction_rise=np.array([rise_at_walls, rise_at_walls, rise_of_beads]),
        half_rise_velocity=velocities / np.tile(slower, count),
        resistances=walker.resistances * of_draws("viscous force", 1.0),
        edges=walker.edges * of_draws("edges", 0.0),
    )
    drives = [case.excitation for case in cases]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of draws for which the theory does not hold
        return predict_motion(
            walker,
            np.tile([drive.frequency for drive in drives], count),
            np.tile([drive.peak_acceleration for drive in drives], count),
            cycles=_CYCLES,
        )


def _quantities(
    motion: PredictedMotion, names: Sequence[str], count: int
) -> Iterator[dict[str, dict[str, float]]]:
    """The quantities of the facts in each experiment, for one draw after the other.

    Beads are taken not to lose contact.
    """
    kinds = len(names)
    velocity = translation(motion.sliding)
    mean_square_velocity = np.mean(translation(motion.series) ** 2, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):  # walkers at rest have no slip
        slips = np.sqrt(np.mean(motion.series**2, axis=-1) / mean_square_velocity)
    for draw in range(count):
        of_draw = {}
        for kind, name in enumerate(names):
            walker = kinds * draw + kind
            of_draw[name] = {
                "velocity": float(velocity[walker]),
                "rotation_1": float(velocity[walker] - motion.sliding[0, walker]),
                "slip_1": float(slips[0, walker]),
                "slip_2": float(slips[1, walker]),
            }
        yield of_draw


# --- the table ------------------------------------------------------------------------------------


def log_likelihoods(distance: FloatArray) -> FloatArray:
    """Logarithm of the likelihood of distances from facts, in deviations."""
    from scipy.stats import t

    width = np.sqrt(1.0 + _MODEL_ERROR**2)
    return np.asarray(t.logpdf(distance / width, _DEGREES_OF_FREEDOM) - np.log(width))


def log_mean(logarithms: FloatArray) -> float:
    """Logarithm of the mean of numbers, which are given by their logarithms."""
    largest = logarithms.max()
    return float(largest + np.log(np.mean(np.exp(logarithms - largest))))


def predicted(likelihoods: FloatArray, in_group: BoolArray) -> float:
    """Logarithm of the density that other facts predict for a group of facts.

    Parameters
    ----------
    likelihoods
        Logarithms of the likelihoods of facts, shape (draws, facts).
    in_group
        Which facts are in the group, shape (facts,).
    """
    without_group = likelihoods[:, ~in_group].sum(axis=1)
    return log_mean(likelihoods.sum(axis=1)) - log_mean(without_group)


def row(law: Law, of: Facts, count: int) -> dict[str, str]:
    """The row of a law: texts by the heads of the columns.

    Parameters
    ----------
    law
        The law.
    of
        The facts.
    count
        Number of draws, a power of two.
    """
    values = draws(law, count)
    distance = distances(law, values, of)
    likelihoods = log_likelihoods(distance)
    groups = np.array(of.groups)
    texts = {"law": law.name, "numbers": str(len(law.numbers))}
    total = 0.0
    for group in dict.fromkeys(of.groups):
        density = predicted(likelihoods, groups == group)
        texts[group] = f"{density:.1f}"
        total += density
    texts["all"] = f"{total:.1f}"
    texts["evidence"] = f"{log_mean(likelihoods.sum(axis=1)):.1f}"
    nearest = int(np.argmin(np.minimum(distance**2, 25.0).sum(axis=1)))
    agreeing = np.count_nonzero(np.abs(distance[nearest]) <= 1.0)
    texts["nearest"] = f"{agreeing} of {len(groups)}"
    weights = np.exp(likelihoods.sum(axis=1) - likelihoods.sum(axis=1).max())
    medians = []
    for name, numbers in values.items():
        order = np.argsort(numbers)
        below = np.cumsum(weights[order]) / weights.sum()
        ends = np.interp([0.05, 0.5, 0.95], below, numbers[order])
        medians.append(f"{name} {ends[1]:.2g} ({ends[0]:.2g} to {ends[2]:.2g})")
    texts["5, 50 and 95 %"] = ", ".join(medians)
    return texts


def rows(count: int = DRAWS) -> list[dict[str, str]]:
    """The table: a row for each of `LAWS`, with a number of draws, which is a power of two."""
    require("theory")
    of = facts()
    return [row(law, of, count) for law in LAWS]


@app.default
def frictions() -> None:
    """Print how well laws of friction predict the facts of the paper, by the theory.

    It takes half an hour.
    """
    table = rows()
    print(aligned_rows(table, right=range(1, len(table[0]) - 1)))


if __name__ == "__main__":
    main(app=app)
