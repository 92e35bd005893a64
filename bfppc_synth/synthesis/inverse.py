"""Inverse objectives: the smallest accuracy, the largest period, the coarsest quantizers.

Each value of what is sought is a design problem of its own, and the peak input of its best design
grows with how hard the value is: the outermost value whose peak input keeps the limit is found on
that curve. So U of `peak-input` at an accuracy, taken as the limit, gives that accuracy back.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.errors import NoDesignError, PlantFileError
from bfppc_synth.gains.objective import weights_of
from bfppc_synth.gains.rounding import to_digits
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.chosen import Chosen
from bfppc_synth.model.spec import Objective, PlantSpec
from bfppc_synth.spec.objective import INVERSE
from bfppc_synth.spec.resolve import least_period, resolved
from bfppc_synth.synthesis.edge import cheapest, furthest
from bfppc_synth.synthesis.probe import Probe, Prober
from bfppc_synth.synthesis.scale import first_guess

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.design import Design

# What the last search may take of the limit: a steeper law than the one with 1 % side weight on
# its slope needs less than that one, by up to 1 %.
_REACH = 1.002
# Where no design is certified right at the edge, it is stepped back from [log].
_BACK = (0.0, 1e-3, 3e-3, 1e-2, 3e-2, 0.1)
# Digits of the value that the folder states.
_DIGITS = 5
# First values that are tried: steps away from the guess [log 4].
_FIRST = (0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6, 8, -8, 10, -10)
_QUARTER = math.log(4.0)
# How much of a limit may be left where it still counts as what ends the search.
_USED = 0.98
_ROUNDS = 3


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

    References
    ----------
    docs/theory.md section 5; SPEC section 1, objectives.
    """
    seeker = _Seeker(spec, objective, Prober(spec, objective, arithmetic, progress))
    if seeker.prober.spec.chosen is not None:
        raise LookupError(objective)
    position = seeker.best()
    return _certified(seeker, position, solve, progress)


class _Seeker:
    """The curve of one objective; positions are logs in the direction that is wanted."""

    def __init__(self, spec: PlantSpec, objective: Objective, prober: Prober) -> None:
        self.spec, self.objective, self.prober = spec, objective, prober
        self.sign = -1.0 if objective is Objective.ACCURACY else 1.0
        limit = spec.actuator.limit
        self.limit = math.inf if limit is None else limit.approximate
        self.least = -math.inf
        if objective is Objective.ACCURACY and spec.performance.accuracy is not None:
            self.least = -math.log(spec.performance.accuracy.approximate)
        elif objective is Objective.PERIOD and least_period(spec) > 0.0:
            self.least = math.log(least_period(spec))
        weights = dict(spec.synthesis.objective)
        self.alone = all(word in INVERSE for word in weights)
        self.weight = weights[objective]

    def value(self, position: float) -> float:
        """Return the number at a position; the file's own limit exactly as the file has it."""
        if position <= self.least:
            return self._given()
        # Rounded to the safe side: a larger accuracy, a shorter period, finer steps.
        value = math.exp(self.sign * position)
        rounded = to_digits(value, _DIGITS, upward=-int(self.sign))
        return self._given() if self.sign * math.log(rounded) <= self.least else rounded

    def _given(self) -> float:
        accuracy = self.spec.performance.accuracy
        if self.objective is Objective.ACCURACY and accuracy is not None:
            return accuracy.approximate
        return least_period(self.spec)

    def best(self) -> float:
        """Return the best position; with a free T_s again from there, as long as that moves."""
        start = self._start()
        position = self._best_from(start)
        for _ in range(_ROUNDS):
            taken = self.prober.transition
            if taken is None or self.spec.performance.transition is not None:
                break
            self.prober.transition = None
            self.prober.forget()
            if self.prober.at(self.value(position)) is None or self.prober.transition == taken:
                self.prober.transition = taken
                break
            position = self._best_from(position if self._excess(position) <= 0.0 else start)
        return position

    def _best_from(self, start: float) -> float:
        if not self.alone:
            return cheapest(self._cost, start)
        edge = furthest(self._excess, start)
        probe = self.prober.at(self.value(edge.position))
        if probe is None or (edge.bound and self._fills(probe)):
            return edge.position
        # Nothing but the slope ends it, which is beyond all bounds there.
        return cheapest(self._cost, edge.position, end=edge.position)

    def _excess(self, position: float) -> float:
        """Log of the peak input over the limit; infinite where there is no design."""
        probe = self.prober.at(self.value(position))
        if probe is None or not 0.0 < probe.U < math.inf:
            return math.inf
        if math.isinf(self.limit):
            return -math.inf
        return math.log(probe.U / (_REACH * self.limit))

    def _cost(self, position: float) -> float:
        probe = self.prober.at(self.value(position))
        if probe is None or position < self.least or self._exceeds(probe):
            return math.inf
        if self.alone:
            side = weights_of(self.spec)
            return 0.0 - position + side.slope * math.log(max(probe.slope, 1e-300))
        return probe.cost - self.weight * position

    def _fills(self, probe: Probe) -> bool:
        share: float = probe.U / self.limit
        return share >= _USED

    def _exceeds(self, probe: Probe) -> bool:
        share: float = probe.U / self.limit
        return share > _REACH

    def _start(self) -> float:
        """Find a position that holds."""
        if self.least > -math.inf:
            positions = [self.least + k * _QUARTER for k in (0, 1, 2, 3)]
        else:
            guess = self.sign * math.log(first_guess(self.spec, self.objective))
            positions = [guess + k * _QUARTER for k in _FIRST]
        for position in positions:
            if self._excess(position) <= 0.0:
                return position
        raise self.refusal()

    def refusal(self) -> NoDesignError | PlantFileError:
        """Say that no value will do, and which limit the best of them needs."""
        probes = self.prober.found
        if not probes and self.prober.failure is not None:
            return self.prober.failure
        path, word = self.spec.path, self.objective
        allowed = ""
        if self.least > -math.inf:
            side = "up to" if word is Objective.ACCURACY else "of at least"
            allowed = f" {side} {self._given():.6g}, which the file asks for,"
        head = f"no certified design for {path}: no {word}{allowed}"
        if not probes:
            return NoDesignError(
                f"{head} has gains\n  fix: a smaller initial set, a slower rho (larger t_s), or"
                " tighter bounds on the plant"
            )
        least = min(probes, key=lambda probe: probe.U)
        return NoDesignError(
            f"{head} keeps actuator.limit {self.limit:.6g}: the least peak input found is"
            f" {least.U:.4g}, at {word} {least.value:.4g}\n"
            f"  would suffice: actuator.limit {least.U * 1.01:.4g}"
        )


def _certified(
    seeker: _Seeker,
    position: float,
    solve: Callable[[PlantSpec, float | None], Design],
    progress: Callable[[str], None],
) -> Design:
    """Step back from the edge until the checker is content."""
    last: Design | None = None
    reason: NoDesignError | None = None
    tried: set[float] = set()
    for back in _BACK:
        value = seeker.value(position - back)
        if value in tried:
            continue
        tried.add(value)
        progress(f"{seeker.objective} {value:.5g}: making the design")
        chosen = Chosen(objective=seeker.objective, value=value)
        try:
            last = solve(resolved(seeker.spec, chosen), seeker.prober.transition)
        except NoDesignError as error:
            reason = error
            continue
        certificate = last.certificate
        refuted = any(not entry.holds for entry in certificate.assumption_checks)
        if certificate.verdict is Verdict.CERTIFIED or refuted:
            return last
    if last is None:
        raise reason or seeker.refusal()
    return last
