"""How fast work goes, compared with a prediction of its time.

At the start nothing is measured, and soon little: the first estimates of the remaining time follow
the prediction, later ones what was measured. How long work takes is predicted elsewhere
(`walkers.runner.cost`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

_TRUST_IN_PREDICTION = 0.03
"""Share of the work after which a measurement counts as much as the prediction."""
_MEMORY = 0.2
"""Share of the work after which a measurement counts 1/e times as much as a new one."""


@dataclass(frozen=True)
class Pace:
    """Time that work has taken, and the time that was predicted for it.

    Both are sums in which earlier work counts less, exponentially in the work done since. They
    begin as if some of the work had been done as fast as predicted.

    Attributes
    ----------
    memory
        Predicted time of the work after which earlier work counts 1/e times as much, s.
    taken
        Time that the work has taken, s.
    predicted
        Time that was predicted for it, s.
    """

    memory: float
    taken: float
    predicted: float

    @classmethod
    def of_prediction(cls, seconds: float) -> Pace:
        """The pace of work that has not begun, and that takes so long in total by prediction, s."""
        trusted = _TRUST_IN_PREDICTION * seconds
        return cls(_MEMORY * seconds, trusted, trusted)

    def after(self, taken: float, predicted: float) -> Pace:
        """The pace after further work.

        Parameters
        ----------
        taken
            Time that the work has taken, s; of several workers, the sum of their times.
        predicted
            Time that was predicted for it, s; 0 if nothing is known to be done in this time.
        """
        kept = exp(-predicted / self.memory)
        return Pace(self.memory, kept * self.taken + taken, kept * self.predicted + predicted)

    @property
    def slowness(self) -> float:
        """Time that the work takes per predicted time: above 1 if it is slower than predicted."""
        return self.taken / self.predicted
