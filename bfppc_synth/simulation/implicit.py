"""The step that is implicit in x_n: continuous measurement without a time step of its own.

    x_n' = x_n + h (f_n + g_n u(t + h, x_1', .., x_n'))

A peak-input design may have slopes of 1e10, so the law must be that of the step's end. The
states below follow, x_i' = x_i + h (f_i + g_i x_{i+1}'), which keeps steep virtual controls
stable too; so they are affine in z = x_n', the law falls with z, and one increasing scalar
equation remains. f and g are those of the start of the step: this is of first order in h.
Unlike the sampled runs, which are exact up to the RK4 error, it is the certified loop only up
to that error. With center nominal the error on the center itself is added to f, so that only
what moves the errors e_i is of first order.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.simulation.loading import load_text

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.loading import Controller

    # Arguments as in _SOLVER; returns states, what was measured, command, slope.
    Solver = Callable[..., tuple[tuple[float, ...], tuple[float, ...], float, float]]

#: Status of a controller that holds its command: a sample far from where the tube may be.
_BAD_INPUT = 2

#: A residual counts as a disturbance of dx_n; this is its share of the certified D_n.
_RESIDUAL = 1e-7

#: A distance from the root counts as a measurement error; this is its share of p_n.
_DISTANCE = 1e-10

# The guess z is where the last command would lead: the command changes little from step to
# step, and so does the equation's slope. The clamped command brackets the root. A secant below
# 1 is rounding, since z itself has the slope 1; where the law is clamped or saturated it points
# far beyond the root, so a step is at most eight times the one before. From the fifth attempt
# on every other one halves the bracket, so that a bent law cannot stall it. Where the law is so
# steep that its own rounding exceeds the tolerance, z itself has to be close.
_SOLVER = """
def solve(step, t, h, tolerance, close, peak, slope, u, error, y_d, {states}, {pairs}, {noise}):
    push = h * g{n}
    offset = x{n} + h * (f{n} + g{n} * error)
    b{n} = 0.0
    a{n} = 1.0
    {levers}
    z = offset + push * u
    for attempt in range(400):
        measured = ({measured},)
        u = step(t, measured, y_d)
        residual = z - offset - push * u
        if -tolerance <= residual <= tolerance:
            break
        if attempt == 0:
            reach = abs(push) * peak
            lower, upper = offset - reach, offset + reach
            trial = z - residual / slope
        else:
            slope = max(1.0, (residual - last) / (z - last_z))
            if -close * slope <= residual <= close * slope:
                break
            limit = 8.0 * abs(z - last_z)
            trial = z - min(max(residual / slope, -limit), limit)
        if residual > 0.0:
            upper = min(upper, z)
        else:
            lower = max(lower, z)
        if (attempt > 3 and attempt % 2) or not lower < trial < upper:
            trial = 0.5 * (lower + upper)
            if upper - lower <= close or not lower < trial < upper:
                break
        last_z, last, z = z, residual, trial
    return ({reached},), measured, u, slope
"""


def make_solver(order: int) -> Solver:
    """Write the step for plants of one order.

    Parameters
    ----------
    order : int
        Number of states n.

    Returns
    -------
    Callable
        ``solve(step, t, h, tolerance, close, peak, slope, u, error, y_d, *x, *pairs, *noise)``
        takes a step of length h to time t [s] from the states x and the command u, with f_1, g_1,
        .., f_n, g_n in ``pairs``. It returns the states, what the controller was given of
        them, its command at t and the equation's slope for the next step. The last call of
        ``step`` is the one at the accepted point, so that the controller's held command and
        status are right; all others are at the same t.
    """
    numbers = range(1, order + 1)
    # x_i' = b_i + a_i z
    levers = [
        f"a{i} = h * g{i}\n    b{i} = x{i} + h * f{i} + a{i} * b{i + 1}\n    a{i} *= a{i + 1}"
        for i in reversed(numbers[:-1])
    ]
    text = _SOLVER.format(
        n=order,
        states=", ".join(f"x{i}" for i in numbers),
        pairs=", ".join(f"f{i}, g{i}" for i in numbers),
        noise=", ".join(f"n{i}" for i in numbers),
        levers="\n    ".join(levers),
        measured=", ".join(f"b{i} + a{i} * z + n{i}" for i in numbers),
        reached=", ".join(f"b{i} + a{i} * z" for i in numbers),
    )
    solver: Solver = load_text(text, name="implicit_step", origin="<implicit step>").solve
    return solver


def accuracy(design: Design, h: float) -> tuple[float, float]:
    """Say when the equation of a step counts as solved: either is enough.

    Parameters
    ----------
    design : Design
        Its p_n and the bounds D_n, G_n and U.
    h : float
        Length of a step [s].

    Returns
    -------
    tuple[float, float]
        A residual whose rate is 1e-7 of what the design withstands, and a distance from the
        root that is 1e-10 of p_n [both unit of x_n].
    """
    every = (design.bounds, *(stage.bounds for stage in design.stages))
    withstood = min(bounds.D[-1] + 1e-3 * bounds.G[-1] * bounds.U for bounds in every)
    narrowest = min(design.omega[-1], *(stage.omega[-1] for stage in design.stages), math.inf)
    return _RESIDUAL * h * withstood, _DISTANCE * narrowest


def tried(
    controller: Controller, sizes: Sequence[float], peak: float
) -> Callable[[float, Sequence[float], float | Sequence[float] | None], float]:
    """Ask the law at the points that a step tries, also beyond what it takes for a measurement.

    There it would hold the command of the point before, at which the step's equation holds by
    itself: what was tried would be taken for the answer.
    """
    step = controller.step

    def command(t: float, measured: Sequence[float], y_d: float | Sequence[float] | None) -> float:
        u = step(t, measured, y_d)
        if controller.status == _BAD_INPUT and all(map(math.isfinite, measured)):
            pairs = zip(measured, sizes, strict=True)
            shares = [x / size if size > 0.0 else 0.0 for x, size in pairs]
            return -math.copysign(peak, max(shares, key=abs))
        return u

    return command
