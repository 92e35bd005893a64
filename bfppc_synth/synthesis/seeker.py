"""Along the curve of an inverse objective: where it ends, or is worth the most."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.errors import NoDesignError, PlantFileError
from bfppc_synth.gains.objective import weights_of
from bfppc_synth.gains.rounding import to_digits
from bfppc_synth.model.spec import BoundsKind, Objective
from bfppc_synth.spec.objective import INVERSE
from bfppc_synth.spec.resolve import least_period
from bfppc_synth.synthesis.edge import COARSE, RESOLVED, Edge, cheapest, furthest
from bfppc_synth.synthesis.probe import Limit, Prober
from bfppc_synth.synthesis.scale import first_guess

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.synthesis.probe import Probe

# What the last search may take of the limit: a steeper law than the one with 1 % side weight on
# its slope needs less than that one, by up to 1 %.
_REACH = 1.002
# Digits of the value that the folder states.
_DIGITS = 5
# First values that are tried: steps away from the guess [log 4].
_FIRST = (0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6, 8, -8, 10, -10)
_QUARTER = math.log(4.0)
_SAME_MISTAKE = 5
# A perfect model has no smallest accuracy: from the first one that holds it is sought so far.
_FURTHEST = math.log(1e8)
# How much of a limit may be left where it still counts as what ends the search.
_USED = 0.98
# How often T_s, and what tight bounds add to termwise ones, are taken anew at the edge.
_ROUNDS = 2
# How far back from the last design the slope is traded [log].
_TRADED = 0.1
_CORRECTIONS = 4
# An excess that ends these corrections [log].
_CLOSE = 2e-4
_CHORDS = 3


class Seeker:
    """The curve of one objective; positions are logs in the direction that is wanted."""

    def __init__(
        self,
        spec: PlantSpec,
        objective: Objective,
        arithmetic: Arithmetic,
        progress: Callable[[str], None],
    ) -> None:
        self.spec, self.objective = spec, objective
        self._sign = -1.0 if objective is Objective.ACCURACY else 1.0
        limit = spec.actuator.limit
        self._limit = math.inf if limit is None else limit.approximate
        self._given = 0.0
        if objective is Objective.ACCURACY and spec.performance.accuracy is not None:
            self._given = spec.performance.accuracy.approximate
        elif objective is Objective.PERIOD:
            self._given = least_period(spec)
        self._least = self._sign * math.log(self._given) if self._given > 0.0 else -math.inf
        weights = dict(spec.synthesis.objective)
        self._alone = all(word in INVERSE for word in weights)
        self._weight = weights[objective]
        kept = Limit.IGNORED if self._alone else Limit.KEPT
        bounds = spec.synthesis.bounds
        self._prober = Prober(spec, objective, arithmetic, progress, kept, bounds)
        self._termwise: Prober | None = None
        if bounds is BoundsKind.TIGHT and self._alone:
            plain = BoundsKind.TERMWISE
            self._termwise = Prober(spec, objective, arithmetic, progress, kept, plain)

    @property
    def transition(self) -> float | None:
        """T_s of center nominal that was chosen on the way [s]."""
        return self._prober.transition

    def value(self, position: float) -> float:
        """Return the number at a position; the file's own limit exactly as the file has it."""
        if position <= self._least:
            return self._given
        # Rounded to the safe side: a larger accuracy, a shorter period, finer steps.
        value = math.exp(self._sign * position)
        rounded = to_digits(value, _DIGITS, upward=-int(self._sign))
        return self._given if self._sign * math.log(rounded) <= self._least else rounded

    def best(self) -> float:
        """Return the best position; with a free T_s again from there, while that moves it."""
        position = self._best_from(self._start())
        for _ in range(_ROUNDS if self.spec.performance.transition is None else 0):
            taken = self._prober.transition
            if taken is None:
                break
            self._prober.transition = None
            self._prober.forget()
            if self._excess(position) > 0.0 or self._prober.transition == taken:
                self._prober.transition = taken
                break
            if self._termwise is not None:
                self._termwise.transition = self._prober.transition
                self._termwise.forget()
            position = self._best_from(position)
        return position

    def _best_from(self, start: float) -> float:
        if not self._alone:
            return cheapest(self._cost, start)
        edge = self._edge(start)
        probe = self._prober.at(self.value(edge.position))
        settled = self._termwise is not None or (probe and probe.U / self._limit >= _USED)
        if probe is None or (edge.bound and settled):
            return edge.position
        # Nothing but the slope ends it, which is beyond all bounds there.
        return cheapest(self._cost, edge.position, end=edge.position, first=_TRADED)

    def _edge(self, start: float) -> Edge:
        if self._termwise is not None:
            corrected = self._corrected(start, self._termwise)
            if corrected is not None:
                return corrected
        edge = furthest(self._excess, start, end=start + _FURTHEST)
        if not edge.bound:
            # No design so near to one may be the fault of the one start that was tried.
            beyond = edge.position + COARSE
            if self._prober.again(self.value(beyond)) is not None and self._excess(beyond) <= 0.0:
                edge = furthest(self._excess, beyond)
        return edge

    def _corrected(self, start: float, termwise: Prober) -> Edge | None:
        """Follow the termwise curve, cheap, moved by what tight bounds save where they were tried.

        None where termwise bounds have no design, or the limit is not what ends the search.
        """

        def plain(position: float) -> float:
            return self._over(termwise.at(self.value(position)))

        best, at_best = start, self._excess(start)
        position, excess = best, at_best
        for _ in range(_CORRECTIONS):
            saved = plain(position) - excess
            if not math.isfinite(saved):
                return None
            edge = furthest(lambda at, less=saved: plain(at) - less, best)  # type: ignore[misc]
            if not edge.bound or edge.position <= best + RESOLVED:
                break
            position = edge.position
            excess = self._excess(position)
            for _ in range(_CHORDS):
                if not 0.0 < excess < math.inf or position <= best + RESOLVED:
                    break
                # Between the two by the chord, a little to the safe side.
                aim = min(at_best + 0.5 * _CLOSE, 0.9 * at_best)
                position = best + (position - best) * min(aim / (at_best - excess), 0.98)
                excess = self._excess(position)
            if excess > 0.0:
                break
            best, at_best = position, excess
            if at_best > -_CLOSE:
                break
        return Edge(position=best, bound=True)

    def _over(self, probe: Probe | None) -> float:
        if probe is None or not 0.0 < probe.U < math.inf:
            return math.inf
        if math.isinf(self._limit):
            return -math.inf
        return math.log(probe.U / (_REACH * self._limit))

    def _excess(self, position: float) -> float:
        """Log of the peak input over the limit; infinite where there is no design."""
        return self._over(self._prober.at(self.value(position)))

    def _cost(self, position: float) -> float:
        probe = self._prober.at(self.value(position))
        if probe is None or position < self._least or self._over(probe) > 0.0:
            return math.inf
        if self._alone:
            return weights_of(self.spec).slope * math.log(max(probe.slope, 1e-300)) - position
        return probe.cost - self._weight * position

    def _start(self) -> float:
        """Find a position that holds."""
        if self._given > 0.0:
            # A larger tube reaches further: a smaller one may hold where the file's does not.
            more = (0, 1, 2, 3) if self.objective is Objective.ACCURACY else (0,)
            positions = [self._least + k * _QUARTER for k in more]
        else:
            guess = self._sign * math.log(first_guess(self.spec, self.objective))
            positions = [guess + k * _QUARTER for k in _FIRST]
        for tried, position in enumerate(positions, start=1):
            if self._excess(position) <= 0.0:
                return position
            if self._prober.mistaken == tried == _SAME_MISTAKE:
                # No value of what is sought mends this mistake of the file.
                break
        raise self.refusal()

    def refusal(self) -> NoDesignError | PlantFileError:
        """Say that no value will do, and which limit the best of them needs."""
        probes, failure = self._prober.found, self._prober.failure
        if not probes and failure is not None:
            return failure
        word, allowed, fix = self.objective, "", ""
        if self._given > 0.0:
            key = "performance.accuracy"
            side = "up to"
            if word is Objective.PERIOD:
                key, side = "sampling.period", "of at least"
            allowed = f" {side} {self._given:.6g}, which the file asks for,"
            fix = f"\n  fix: raise actuator.limit, or try without {key} (not certified)"
        head = f"no certified design for {self.spec.path}: no {word}{allowed}"
        if not probes:
            other = (
                "\n  fix: remove what synthesis.gains or synthesis.p fixes, a smaller initial set,"
                " a slower rho (larger t_s), or tighter bounds on the plant"
            )
            return NoDesignError(f"{head} leaves a design{fix or other}")
        least = min(probes, key=lambda probe: probe.U)
        return NoDesignError(
            f"{head} keeps actuator.limit {self._limit:.6g}: the least peak input found is"
            f" {least.U:.4g}, at {word} {least.value:.4g}\n"
            f"  would suffice: actuator.limit {least.U * 1.01:.4g}{fix}"
        )
