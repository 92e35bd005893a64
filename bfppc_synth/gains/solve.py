"""The only importer of CasADi: the design problem as a log-space program for IPOPT."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import casadi as ca

from bfppc_synth.bounds.chain import Loads, chain_input, evaluate_chain
from bfppc_synth.bounds.residual import PerformanceResidual
from bfppc_synth.gains.problem import assemble, log_limits
from bfppc_synth.gains.tight_points import PointLoads
from bfppc_synth.gains.traced_chain import TracedNumbers, TracedResidual
from bfppc_synth.gains.units import per_rate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.bounds.chain import Residual
    from bfppc_synth.gains.positive import PositiveProblem
    from bfppc_synth.gains.problem import DesignProblem, Slot
    from bfppc_synth.gains.tight_points import Points

# The search keeps this many times the final margin, as room for rounding to few digits.
ROOM = 5.0
# A rate [1/s] below which a load counts as this much of p: keeps log F* finite for f = 0.
LEAST_RATE = 1e-6
# Name of the row of actuator.limit.
LIMIT = "limit"
# Logs of the common factor that an elastic program looks at; its rows hold to this much, and the
# design's cost counts this little.
LEAST_MISS, MOST_MISS = -0.5, 60.0
SETTLED = 1e-5
STOPPED = ("User_Requested_Stop", "NonIpopt_Exception_Thrown")
OWN_COST = 1e-4
# Inequalities between feedback values: in units of x_{i+1}, and not of x_i as the other ones.
FORCES = ("U1", "U2", "U2'", "T2")


class _Solver:
    """One compiled program: minimize ``goal`` where every row is at least 0."""

    def __init__(self, variables: Any, goal: Any, rows: list[Any]) -> None:
        quiet: dict[str, Any] = {"print_level": 0, "sb": "yes", "max_iter": 300, "tol": 1e-7}
        self._solver = ca.nlpsol(
            "design",
            "ipopt",
            {"x": variables, "f": goal, "g": ca.vertcat(*rows)},
            {
                "ipopt": quiet,
                "print_time": False,
                "error_on_fail": False,
                "show_eval_warnings": False,
            },
        )
        self._rows = len(rows)
        self._parts = (variables, goal, ca.vertcat(*rows))
        self._found: list[float] = []
        self._box: tuple[list[float], list[float]] = ([], [])
        self.multipliers: tuple[float, ...] = ()
        self.lowest_row = -math.inf

    def run(self, guess: list[float], lower: list[float], upper: list[float]) -> list[float] | None:
        """Solve from a guess; None outside of every box, or where the iterates broke down."""
        if any(low > high for low, high in zip(lower, upper, strict=True)):
            return None
        found = self._solver(
            x0=guess, lbx=lower, ubx=upper, lbg=[0.0] * self._rows, ubg=[math.inf] * self._rows
        )
        values = [float(value) for value in found["x"].full().ravel()]
        if self._solver.stats()["return_status"] in STOPPED:
            raise KeyboardInterrupt  # the solver has swallowed it
        # Of the last run: how hard each row presses, and how far the worst one is from holding.
        # CasADi's multiplier of a row that is at least 0 is not positive.
        self.multipliers = tuple(max(-float(m), 0.0) for m in found["lam_g"].full().ravel())
        self.lowest_row = min(map(float, found["g"].full().ravel()), default=0.0)
        self._found, self._box = values, (lower, upper)
        return values if all(map(math.isfinite, values)) else None

    def lower_bounds(self, room: float, counted: int) -> tuple[float, float]:
        """Bound the goal of a convex program from below by its Lagrangian, in floats.

        The Lagrangian lies above its tangent at the point found, wherever that is. The second
        bound is without the ``room`` that the first ``counted`` rows ask for beyond 0.
        """
        variables, goal, rows = self._parts
        lagrangian = goal - ca.dot(ca.DM(self.multipliers), rows)
        gradient = ca.gradient(lagrangian, variables)
        tangent = ca.Function("tangent", [variables], [lagrangian, gradient])
        value, slope = (part.full().ravel() for part in tangent(self._found))
        ends = zip(slope, self._found, *self._box, strict=True)
        fall = sum(min(g * (low - at), g * (high - at)) for g, at, low, high in ends)
        bound = float(value[0]) + float(fall)
        without = bound - room * sum(self.multipliers[:counted])
        finite = math.isfinite(without)
        return (bound, without) if finite else (-math.inf, -math.inf)


class PositiveProgram:
    """A program in positive numbers, stated by another file, solved in their logs."""

    def __init__(self, problem: PositiveProblem) -> None:
        variables = ca.SX.sym("log", problem.count)
        values = tuple(ca.exp(variables[j]) for j in range(problem.count))
        plant = problem.plant
        residuals = [
            TracedResidual(
                ca,
                partial(PerformanceResidual, plant, problem.majorants, center),
                problem.accuracy,
                plant.order,
            )
            for center in problem.centers
        ]
        handed: tuple[Residual[Any], ...] = tuple(residuals)
        goal, pairs = problem.formulate(values, handed, TracedNumbers(ca))
        room = ROOM * problem.margin
        # A right side that may be negative asks nothing there: only its positive part counts.
        rows = [
            ca.log(ca.fmax(lhs, 1e-300)) - ca.log(ca.fmax(rhs, 1e-9 * lhs + 1e-300)) - room
            for lhs, rhs in pairs
        ]
        rows += [value - 1e-9 for part in residuals for value in part.arithmetic.positive]
        total = sum(weight * ca.log(value + 1e-300) for weight, value in goal)
        self._solver = _Solver(variables, total, rows)

    def solve(
        self, start: tuple[float, ...], boxes: tuple[tuple[float, float], ...]
    ) -> tuple[float, ...] | None:
        """Solve from positive start values; ``boxes`` are factors on them.

        The result is a candidate: the caller re-evaluates it.
        """
        guess = [math.log(value) for value in start]
        lower = [g + math.log(low) for g, (low, _) in zip(guess, boxes, strict=True)]
        upper = [g + math.log(high) for g, (_, high) in zip(guess, boxes, strict=True)]
        logs = self._solver.run(guess, lower, upper)
        return None if logs is None else tuple(math.exp(value) for value in logs)


class Program:
    """One alternative and pattern of the design problem, compiled once, solved from any start.

    With ``points`` the loads are the largest at these points instead of the termwise ones:
    each load is a variable above its values there, in shares of ``points.scales``.
    """

    def __init__(
        self,
        problem: DesignProblem,
        free: tuple[Slot, ...],
        alternative: str,
        points: Points | None = None,
    ) -> None:
        self._free = free
        self._needs_inner = not problem.exact and alternative != "T2"
        self._loads = 0 if points is None else problem.order + 1
        count = len(free) + self._loads
        variables = ca.SX.sym("log", count + (1 if self._needs_inner else 0))
        numbers = TracedNumbers(ca)
        residual = TracedResidual(ca, problem.residual, problem.accuracy, problem.order)
        values: Mapping[Slot, Any] = {slot: ca.exp(variables[j]) for j, slot in enumerate(free)}
        shapes, widths = assemble(problem, values, numbers)
        start = chain_input(shapes, widths, problem.center, problem.conditions, numbers)
        rows, room, loads = [], ROOM * problem.margin, None
        if points is not None:
            shares = [variables[len(free) + j] for j in range(self._loads)]
            pressed = [share * scale for share, scale in zip(shares, points.scales, strict=True)]
            loads = Loads(load=tuple(pressed[:-1]), rate=pressed[-1])
            values_there = PointLoads(problem, shapes, widths, numbers, ca)
            rows += _pressed(values_there, points, shares)
        bounds = evaluate_chain(start, residual, numbers, problem.theorem.rules, loads)
        units = per_rate(problem)
        inner = ca.exp(variables[count]) if self._needs_inner else None
        asked, self.names = [], []
        for demand in problem.theorem.demands(alternative, start, bounds, numbers, inner):
            floor = LEAST_RATE * widths[demand.step]
            if demand.name in FORCES:
                floor *= units[demand.step]
            asked.append(ca.log(demand.lhs) - ca.log(demand.rhs + floor) - room)
            self.names.append((demand.name, demand.step))
        if problem.limit is not None:
            asked.append(math.log(problem.limit) - ca.log(bounds.U) - room)
            self.names.append((LIMIT, problem.order - 1))
        self._room = room
        rows += [value - 1e-9 for value in residual.arithmetic.positive]
        weights = problem.weights
        goal = weights.peak_input * ca.log(bounds.U + 1e-300) + weights.slope * ca.log(bounds.slope)
        self._solver = self._closed(variables, goal, asked, rows)

    def _closed(self, variables: Any, goal: Any, asked: list[Any], rows: list[Any]) -> _Solver:
        """Minimize the goal where everything that is asked holds."""
        return _Solver(variables, goal, [*asked, *rows])

    def solve(
        self, start: Mapping[Slot, float], inner: float, reach: float = 30.0
    ) -> dict[Slot, float] | None:
        """Solve from positive start values; None where the iterates broke down.

        ``inner`` is the start of phi_n's argument in the last inequality, below p_n; ``reach``
        how far a log may move from its start.

        The result is a candidate, whatever the solver's status says: the caller re-evaluates it.
        """
        guess = [math.log(start[slot]) for slot in self._free]
        limits = [log_limits(slot) for slot in self._free]
        lower = [max(low, g - reach) for (low, _), g in zip(limits, guess, strict=True)]
        upper = [min(high, g + reach) for (_, high), g in zip(limits, guess, strict=True)]
        guess += [1.0] * self._loads
        lower += [0.0] * self._loads
        upper += [math.inf] * self._loads
        if self._needs_inner:
            guess.append(math.log(inner))
            lower.append(min(-60.0, guess[-1] - reach))
            upper.append(max(60.0, guess[-1] + reach))
        logs = self._run(guess, lower, upper)
        if logs is None:
            return None
        return {slot: math.exp(value) for slot, value in zip(self._free, logs, strict=False)}

    def _run(
        self, guess: list[float], lower: list[float], upper: list[float]
    ) -> list[float] | None:
        return self._solver.run(guess, lower, upper)

    def lower_bounds(self) -> tuple[float, float]:
        """Bound the cost of every design from below, where the program is a geometric one.

        Estimates, in floats, from the multipliers of the last solve, for designs within its box:
        of those that keep the room that the search asks for, and of all.
        """
        return self._solver.lower_bounds(self._room, len(self.names))


class ElasticProgram(Program):
    """The same where everything asked may miss by one common factor, whose log is the goal."""

    #: Log of the factor of the last solution; below 0 everything holds with that much room.
    miss = math.inf

    def _closed(self, variables: Any, goal: Any, asked: list[Any], rows: list[Any]) -> _Solver:
        miss = ca.SX.sym("miss")
        relaxed = [row + miss for row in asked]
        return _Solver(ca.vertcat(variables, miss), miss + OWN_COST * goal, [*relaxed, *rows])

    def _run(
        self, guess: list[float], lower: list[float], upper: list[float]
    ) -> list[float] | None:
        logs = self._solver.run([*guess, 1.0], [*lower, LEAST_MISS], [*upper, MOST_MISS])
        if logs is None or self._solver.lowest_row < -SETTLED:
            return None
        self.miss = logs[-1]
        return logs

    def pressures(self) -> dict[tuple[str, int], float]:
        """Tell what presses in the last solution: name and step of a row, its multiplier."""
        pressing: dict[tuple[str, int], float] = {}
        for name, multiplier in zip(self.names, self._solver.multipliers, strict=False):
            pressing[name] = pressing.get(name, 0.0) + multiplier
        return pressing


def _pressed(values: PointLoads, points: Points, shares: list[Any]) -> list[Any]:
    """Ask every load to be at least its value at each point, in shares of its scale."""
    *scales, rate = points.scales
    rows = [shares[-1] - values.rate(point) / rate for point in points.rate]
    for step, facet in enumerate(points.facets):
        rows += [shares[step] - values.load(step, point) / scales[step] for point in facet]
    return rows
