"""Interface of the modules that measure runs.

They are `walking`, `threshold`, `meetings`, `piles` and `record_part`. Each module measures one
kind of experiment: it tells to which cases it applies, and computes tables and numbers from the
motion of a run. Several may apply to a case: `walking`, `meetings` and `record_part` measure a tray
of walkers that is shaken by a record. The modules are listed in
`walkers.postprocess.measure.results.MODULES`. They neither read dumps nor write results.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from walkers.inputs.tables.case import Case
    from walkers.postprocess.measure.motion import Motion
    from walkers.postprocess.measure.numbers import Measurement


class MeasuringModule(Protocol):
    """What a module that measures contains.

    Attributes
    ----------
    NAME
        Name of its numbers in `walkers.postprocess.measure.quantities.GROUPS`, and of its version
        in ``result.json``.
    VERSION
        Version of its method: raise it if the module gives other numbers or tables for the same
        dumps, also where the change is in a function that it calls. Results that other modules
        measured stay valid.
    """

    NAME: str
    VERSION: int

    def applies(self, case: Case) -> bool:
        """Tell whether the module measures the runs of a case.

        Parameters
        ----------
        case
            The resolved case.

        Returns
        -------
        bool
            Whether `derived` and `measure` can be called for this case.
        """

    def derived(self, case: Case) -> Mapping[str, Any]:
        """Compute the numbers that follow from the case without a run.

        Parameters
        ----------
        case
            A case to which the module applies.

        Returns
        -------
        mapping of str to number
            Numbers in SI units by their names in the group ``NAME``; empty if there are none.
        """

    def measure(self, motion: Motion) -> Measurement:
        """Measure a run.

        Parameters
        ----------
        motion
            Motion of the beads of a run to whose case the module applies; the run may be
            unfinished.

        Returns
        -------
        Measurement
            Tables, numbers in SI units, and reasons to doubt them.
        """
