"""Center nominal in any target's numbers: the recursion, its start, its transition.

docs/theory.md section 4. The generated code, the simulation and the bounds run these same
functions on statements, floats and intervals.
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import evaluate
from bfppc_synth.expressions.taylor import Series, TaylorFunctions

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bfppc_synth.expressions.evaluate import Functions
    from bfppc_synth.model.nominal import NominalModel

T = TypeVar("T")


class AlongCenterError(EnvelopeError):
    """No value of f or g (``key``) of the channel ``index`` along the center.

    The key is ``reference`` where it is that of the center itself.
    """

    def __init__(self, error: EnvelopeError, *, index: int, key: str) -> None:
        self.index, self.key = index, key
        super().__init__(str(error), subexpression=error.subexpression, fix=error.fix)


@contextmanager
def _placed(index: int, key: str) -> Iterator[None]:
    """Say which channel has no value."""
    try:
        yield
    except EnvelopeError as error:
        raise AlongCenterError(error, index=index, key=key) from error


def center_series(
    model: NominalModel,
    base: Functions[T],
    reference: Series[T],
    transition: Series[T],
    *,
    length: int,
) -> tuple[tuple[Series[T], ...], Series[T]]:
    """Follow the nominal plant backwards from its output y_d + b.

    Parameters
    ----------
    model : NominalModel
        f^, g^ of order n.
    base : Functions[T]
        The target.
    reference, transition : Series[T]
        Coefficients of y_d and b in t; shorter series mean zeros above. After T_s the
        transition is (0,) or empty.
    length : int
        Coefficients of r_1: n + 1 for v, n + 2 for v and dv.

    Returns
    -------
    tuple
        r_1..r_n with ``length``, ``length`` - 1, .. coefficients or fewer, and v with
        ``length`` - n.

    References
    ----------
    docs/theory.md section 4: r_{i+1} = (dr_i - f^_i(r_1..r_i)) / g^_i(r_1..r_i), v = r_{n+1}.
    """
    r = [TaylorFunctions(base, length).add(reference, transition)]
    for i, (f, g) in enumerate(zip(model.f, model.g, strict=True)):
        functions = TaylorFunctions(base, length - 1 - i)
        values = dict(zip(model.states, r, strict=False))
        ahead = functions.derivative(r[i])
        if f != 0:
            with _placed(i, "f"):
                ahead = functions.sub(ahead, evaluate(f, values, functions))
        if g != 1:
            with _placed(i, "g"):
                ahead = functions.div(ahead, evaluate(g, values, functions))
        r.append(ahead)
    *center, v = r
    return tuple(center), v


def start_series(model: NominalModel, base: Functions[T], start: tuple[T, ...]) -> Series[T]:
    """Follow the nominal plant forwards from a start, as far as its output is determined.

    Parameters
    ----------
    model : NominalModel
        f^, g^ of order n.
    base : Functions[T]
        The target.
    start : tuple[T, ...]
        x_1..x_n at t = 0 (the measured start).

    Returns
    -------
    Series[T]
        Coefficients x_1^(j)(0) / j!, j < n. Minus those of y_d they are b^(j)(0) / j!.

    References
    ----------
    docs/theory.md section 4: the map from the start to the derivatives is triangular.
    """
    order = model.order
    x: list[Series[T]] = [(value,) for value in start]
    for k in range(order - 1):
        functions = TaylorFunctions(base, k + 1)
        values = dict(zip(model.states, x, strict=True))
        for i in range(order - 1 - k):
            rate = x[i + 1]
            if model.g[i] != 1:
                with _placed(i, "g"):
                    rate = functions.mul(evaluate(model.g[i], values, functions), rate)
            if model.f[i] != 0:
                with _placed(i, "f"):
                    rate = functions.add(evaluate(model.f[i], values, functions), rate)
            value = rate[k] if k < len(rate) else base.number(sp.S.Zero)
            if k > 0:
                value = base.div(value, base.number(sp.Integer(k + 1)))
            x[i] = (*x[i], value)
    return x[0]


def transition_weights(
    base: Functions[T], coefficients: tuple[T, ...], duration: T
) -> tuple[T, ...]:
    """Latch the transition: the coefficients of Q in b = (1 - s)^(n+2) Q(s), s = t / T_s.

    Parameters
    ----------
    base : Functions[T]
        The target.
    coefficients : tuple[T, ...]
        b^(j)(0) / j!, j < n.
    duration : T
        T_s [s].

    Returns
    -------
    tuple[T, ...]
        Q_0..Q_{n-1}, Q_m = sum over j <= m of C(n+1+m-j, m-j) T_s^j b^(j)(0) / j!: nothing
        cancels, and b with its n + 1 derivatives is exactly 0 at s = 1.

    References
    ----------
    docs/theory.md section 4: the Hermite polynomial of degree 2n+1 in closed form.
    """
    order = len(coefficients)
    scaled: list[T] = []
    power: T | None = None
    for value in coefficients:
        scaled.append(value if power is None else base.mul(value, power))
        power = duration if power is None else base.mul(power, duration)
    weights: list[T] = []
    for m in range(order):
        total = scaled[m]
        for j in range(m - 1, -1, -1):
            count = base.number(sp.Integer(math.comb(order + 1 + m - j, m - j)))
            total = base.add(total, base.mul(count, scaled[j]))
        weights.append(total)
    return tuple(weights)


def fading_series(
    base: Functions[T], weights: tuple[T, ...], s: T, duration: T, *, length: int
) -> Series[T]:
    """Coefficients in t of b at t = s T_s, for s in [0, 1].

    Parameters
    ----------
    base : Functions[T]
        The target.
    weights : tuple[T, ...]
        From ``transition_weights``.
    s : T
        t / T_s.
    duration : T
        T_s [s].
    length : int
        Number of coefficients, at most n + 3.

    References
    ----------
    docs/theory.md section 4.
    """
    functions = TaylorFunctions(base, length)
    order = len(weights)
    rest = base.sub(base.number(sp.S.One), s)
    powers = [rest]
    while len(powers) < order + 2:
        powers.append(base.mul(powers[-1], rest))
    fall: list[T] = []
    for k in range(min(length, order + 3)):
        count = (-1) ** k * math.comb(order + 2, k)
        if k == order + 2:
            fall.append(base.number(sp.Integer(count)))
        elif count == 1:
            fall.append(powers[order + 1])
        else:
            fall.append(base.mul(base.number(sp.Integer(count)), powers[order + 1 - k]))
    # b is wanted in t: coefficient k of the product in s is divided by T_s^k.
    found = functions.mul(tuple(fall), _shifted(base, weights, s, length))
    scaled: list[T] = []
    power: T | None = None
    for value in found:
        scaled.append(value if power is None else base.div(value, power))
        power = duration if power is None else base.mul(power, duration)
    return tuple(scaled)


def transition_series(
    base: Functions[T],
    coefficients: tuple[T, ...],
    s: T,
    duration: T,
    *,
    length: int,
) -> Series[T]:
    """Both steps at once: the transition from its start values.

    Parameters
    ----------
    base : Functions[T]
        The target.
    coefficients : tuple[T, ...]
        b^(j)(0) / j!, j < n.
    s, duration : T
        t / T_s in [0, 1], and T_s [s].
    length : int
        Number of coefficients.

    References
    ----------
    docs/theory.md section 4.
    """
    weights = transition_weights(base, coefficients, duration)
    return fading_series(base, weights, s, duration, length=length)


def _shifted(base: Functions[T], weights: tuple[T, ...], s: T, length: int) -> Series[T]:
    """Coefficients of Q(s + h) in h, by repeated Horner schemes."""
    row = list(weights)
    found: list[T] = []
    while row and len(found) < length:
        # Each pass divides by (h - s): the last number is the remainder.
        for m in range(len(row) - 2, -1, -1):
            row[m] = base.add(row[m], base.mul(s, row[m + 1]))
        found.append(row.pop(0))
    return tuple(found)
