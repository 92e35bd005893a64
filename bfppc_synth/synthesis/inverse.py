"""Inverse objectives: the smallest accuracy, the largest period, the coarsest quantizers.

Each value of what is sought is a design problem of its own, and the peak input of its best design
grows with how hard the value is: the outermost value whose peak input keeps the limit is found on
that curve. So U of `peak-input` at an accuracy, taken as the limit, gives that accuracy back.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.errors import NoDesignError, UsageError
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.chosen import Chosen
from bfppc_synth.spec.resolve import resolved
from bfppc_synth.spec.rules import MOST_STEPS
from bfppc_synth.synthesis.seeker import Seeker

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import Objective, PlantSpec

# Where no design is certified right at the edge, it is stepped back from [log]: little where
# margins are thin, far where it is the rounding of the code that the values run into.
_BACK = (0.0, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 9.0, 18.0)
# A long step back is halved again until what is given away is this little [log].
_GIVEN_AWAY = 0.1


def solve_inverse(
    spec: PlantSpec,
    objective: Objective,
    solve: Callable[[PlantSpec, float | None], Design],
    progress: Callable[[str], None],
    arithmetic: Arithmetic = DEFAULT,
) -> Design:
    """Find the value that an inverse objective seeks, and the certified design there.

    Parameters
    ----------
    spec : PlantSpec
        A plant file whose objective is the inverse one, or has a weight for it.
    objective : Objective
        ACCURACY, PERIOD or RESOLUTION.
    solve : callable
        Makes the certified design of a plant file whose requirements are all given; its second
        argument is T_s of center nominal where that has been chosen [s].
    progress : callable
        Receives one sentence per stage.
    arithmetic : Arithmetic
        What the generated code computes with.

    Returns
    -------
    Design
        About ``spec`` with ``chosen``; certified, or the last one tried with what it lacks.

    Raises
    ------
    PlantFileError
        A mistake that no value mends.
    NoDesignError
        No value that the file allows has a design within the limit.
    UsageError
        The period that was found is too short for the simulation that the file asks for.

    References
    ----------
    docs/theory.md section 5; SPEC section 1, objectives.
    """
    seeker = Seeker(spec, objective, arithmetic, progress)
    position = seeker.best()
    designs = _Designs(seeker, solve, progress)
    failed = 0.0
    for back in _BACK:
        design = designs.at(position - back)
        if design is not None and not _thin(design):
            return designs.closest(position - failed, position - back) or design
        failed = back
    return designs.last()


class _Designs:
    """Certified designs of single values; each is made once."""

    def __init__(
        self,
        seeker: Seeker,
        solve: Callable[[PlantSpec, float | None], Design],
        progress: Callable[[str], None],
    ) -> None:
        self._seeker, self._solve, self._progress = seeker, solve, progress
        self._made: dict[float, Design | None] = {}
        self._reason: NoDesignError | None = None

    def at(self, position: float) -> Design | None:
        """Make the design of a position, None where there is none."""
        seeker, value = self._seeker, self._seeker.value(position)
        if value not in self._made:
            self._progress(f"{seeker.objective} {value:.5g}: making the design")
            asked = resolved(seeker.spec, Chosen(objective=seeker.objective, value=value))
            _require_steps(asked)
            try:
                self._made[value] = self._solve(asked, seeker.transition)
            except NoDesignError as error:
                self._reason, self._made[value] = error, None
        return self._made[value]

    def closest(self, failed: float, holds: float) -> Design | None:
        """Halve a long step back: the last design that is not thin."""
        best: Design | None = None
        while failed - holds > _GIVEN_AWAY:
            middle = 0.5 * (failed + holds)
            design = self.at(middle)
            if design is None or _thin(design):
                failed = middle
            else:
                best, holds = design, middle
        return best

    def last(self) -> Design:
        """Return the last design that was made though not certified, or raise."""
        made = [design for design in self._made.values() if design is not None]
        if made:
            return made[-1]
        raise self._reason or self._seeker.refusal()


def _require_steps(spec: PlantSpec) -> None:
    """Refuse a run of the file's length in steps of a period that only the search knows."""
    period, horizon = spec.sampling.period.approximate, spec.simulation.horizon
    if period > 0.0 and horizon / period > MOST_STEPS:
        raise UsageError(
            f"{spec.path}: the period that was found, {period:.4g} s, makes a run of"
            f" {horizon:g} s more than {MOST_STEPS:.2g} steps\n"
            f"  fix: a simulation.horizon below {MOST_STEPS * period:.3g}"
        )


def _thin(design: Design) -> bool:
    """Whether another value may be certified: nothing that the file declares is refuted."""
    certificate = design.certificate
    refuted = any(not entry.holds for entry in certificate.assumption_checks)
    return certificate.verdict is not Verdict.CERTIFIED and not refuted
