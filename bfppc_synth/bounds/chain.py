"""The chain of bounds of docs/theory.md sections 2 and 3, once for every number type."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from bfppc_synth.bounds.feedback import (
    Numbers,
    coupled_rate,
    feedback,
    largest_slope,
    measurement_growth,
)
from bfppc_synth.errors import ShapeError
from bfppc_synth.model.bounds import ChainBounds

if TYPE_CHECKING:
    from bfppc_synth.model.bounds import CenterBounds, Conditions
    from bfppc_synth.model.shapes import GenericShape

T = TypeVar("T")


class Residual(Protocol[T]):
    """W_i, maj g_i* and g_{m,i} on the set |x_j - r_j| <= xi_j, j <= i (0-based index)."""

    def disturbance(self, index: int, xi: tuple[T, ...]) -> T:
        """Return W_i."""

    def gain_upper(self, index: int, xi: tuple[T, ...]) -> T:
        """Return maj g_i*."""

    def gain_lower(self, index: int, xi: tuple[T, ...]) -> T:
        """Return g_{m,i}."""


class Coupling(Enum):
    """How B_i is taken: at one and the same s, or as the product L_i E_i (simple mode)."""

    SAME_POINT = auto()
    SIMPLE = auto()


class Division(Enum):
    """F_i* divided term by term, or the paper's undivided (61)-(62) with one g_m."""

    DIVIDED = auto()
    PRINTED = auto()


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainRules:
    """Which of the equivalent-looking forms the chain evaluates."""

    coupling: Coupling = Coupling.SAME_POINT
    division: Division = Division.DIVIDED


@dataclass(frozen=True, slots=True, kw_only=True)
class Loads(Generic[T]):
    """What tight bounds put in place of D_i / g_{m,i} + s_{i+1}, and of D_n.

    ``model.tight.TightBounds`` in any number type (docs/theory.md section 9).
    """

    load: tuple[T, ...]
    rate: T


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainInput(Generic[T]):
    """What one evaluation starts from.

    ``half_widths`` p_1..p_n, ``r_bound`` sup|r_i|, ``feed`` s_2..s_{n+1}; ``v``, ``v_rate``,
    ``v_start`` the feedforward bounds; ``delta`` the measurement error bounds; ``hold`` is
    h + tau, ``delay`` tau, ``actuator_error`` delta_u. ``earlier`` bounds the commands of the
    laws that this one takes over from (docs/theory.md section 8), None where it is the first.
    """

    shapes: tuple[GenericShape[T], ...]
    half_widths: tuple[T, ...]
    r_bound: tuple[T, ...]
    feed: tuple[T, ...]
    v: T
    v_rate: T
    v_start: T
    delta: tuple[T, ...]
    hold: T
    delay: T
    actuator_error: T
    earlier: T | None = None


def chain_input(
    shapes: tuple[GenericShape[T], ...],
    half_widths: tuple[T, ...],
    center: CenterBounds,
    conditions: Conditions,
    numbers: Numbers[T],
) -> ChainInput[T]:
    """Turn the float records of center and conditions into numbers of type T."""
    number = numbers.number
    bound = zip(center.r_lower, center.r_upper, strict=True)
    # Only with a delay are commands of an earlier law still on their way.
    in_flight = center.earlier if conditions.delay > 0.0 else 0.0
    return ChainInput(
        shapes=shapes,
        half_widths=half_widths,
        r_bound=tuple(number(max(-lower, upper)) for lower, upper in bound),
        feed=tuple(map(number, center.feed)),
        v=number(center.v),
        v_rate=number(center.v_rate),
        v_start=number(max(center.v_start, in_flight)),
        delta=tuple(map(number, conditions.delta)),
        hold=number(conditions.hold),
        delay=number(conditions.delay),
        actuator_error=number(conditions.actuator_error),
        earlier=number(center.earlier) if center.earlier > 0.0 else None,
    )


def evaluate_chain(
    start: ChainInput[T],
    residual: Residual[T],
    numbers: Numbers[T],
    rules: ChainRules,
    tight: Loads[T] | None = None,
) -> ChainBounds[T]:
    """Evaluate every constant from X_1 to U.

    Parameters
    ----------
    start : ChainInput[T]
        Shapes, half-widths, center, measurement and timing.
    residual : Residual[T]
        W_i, maj g_i*, g_{m,i}.
    numbers : Numbers[T]
        Functions of the number type.
    rules : ChainRules
        Same-point or simple coupling; divided or printed F_i*.
    tight : Loads[T], optional
        Loads that F_i* and D_n are made of instead; W_i, B_i and the other D_i stay termwise.

    Returns
    -------
    ChainBounds[T]
        The recursion X, xi, A, L, W, B, D, F* of section 2 and eta, Lambda, zeta, V, U of
        section 3, in the units of the states (rates per second).

    Raises
    ------
    ShapeError
        If the tuples differ in length.

    References
    ----------
    docs/theory.md sections 2 and 3; the paper's (61)-(62), (69).
    """
    order = len(start.shapes)
    if not len(start.half_widths) == len(start.r_bound) == len(start.feed) == order:
        raise ShapeError(f"the chain needs {order} half-widths, bounds of r and feeds")
    keep = numbers.record
    p: tuple[Any, ...] = start.half_widths
    columns: dict[str, list[Any]] = {
        name: [] for name in ("X", "xi", "A", "L", "W", "B", "D", "G", "g", "F", "eta", "Lambda")
    }
    add = columns.__getitem__
    for i, shape in enumerate(start.shapes):
        xi: Any = p[i] if i == 0 else p[i] + add("A")[i - 1]
        add("xi").append(keep("xi", i, xi))
        add("X").append(keep("X", i, start.r_bound[i] + add("xi")[i]))
        reach = tuple(add("xi"))
        add("A").append(keep("A", i, feedback(shape, p[i], numbers)))
        add("L").append(keep("L", i, largest_slope(shape, p[i], numbers)))
        add("W").append(keep("W", i, residual.disturbance(i, reach)))
        add("G").append(keep("G", i, residual.gain_upper(i, reach)))
        add("g").append(keep("g_min", i, residual.gain_lower(i, reach)))
        own_load: Any = add("W")[i] if i == 0 else add("W")[i] + add("B")[i - 1]
        if tight is not None and i == order - 1:
            own_load = tight.rate
        add("D").append(keep("D", i, own_load))
        ahead: Any = numbers.number(0.0) if i == order - 1 else p[i + 1] + start.feed[i]
        add("B").append(
            numbers.number(0.0)
            if i == order - 1
            else keep("B", i, _rate(shape, i, columns, p[i], ahead, numbers, rules.coupling))
        )
        add("F").append((add("D")[i], ahead))
        noise: Any = start.delta[i] if i == 0 else start.delta[i] + add("Lambda")[i - 1]
        add("eta").append(keep("eta", i, noise))
        add("Lambda").append(
            keep("Lambda", i, measurement_growth(shape, p[i], add("eta")[i], numbers))
        )
    least: Any = add("g")[0]
    for other in add("g")[1:]:
        least = numbers.minimum(least, other)
    demand = []
    for i, (load, ahead) in enumerate(add("F")):
        if rules.division is Division.PRINTED:
            value = (load + add("G")[i] * ahead) / least
        else:
            value = load / add("g")[i] + ahead
        if tight is not None:
            own: Any = tight.load[i]
            value = own if i == order - 1 else own + p[i + 1]
        demand.append(keep("F_star", i, value))
    return _close(start, columns, tuple(demand), numbers)


def _rate(
    shape: GenericShape[Any],
    i: int,
    columns: dict[str, list[Any]],
    p: Any,
    ahead: Any,
    numbers: Numbers[Any],
    coupling: Coupling,
) -> Any:
    load, gain = columns["D"][i], columns["G"][i]
    if coupling is Coupling.SIMPLE:
        return columns["L"][i] * (load + gain * (ahead + columns["A"][i]))
    return coupled_rate(shape, p, load + gain * ahead, gain, numbers)


def _close(
    start: ChainInput[Any],
    columns: dict[str, list[Any]],
    demand: tuple[Any, ...],
    numbers: Numbers[Any],
) -> ChainBounds[Any]:
    """Add the constants of section 3 that belong to the input: V_n, zeta, U."""
    keep = numbers.record
    last = len(demand) - 1
    shape, p, eta = start.shapes[last], start.half_widths[last], columns["eta"][last]
    delta_v = keep("delta_v", last, start.hold * start.v_rate)
    force = feedback(shape, p + eta, numbers)
    held = numbers.maximum(force + delta_v, start.v_start)
    command = start.v + force
    if start.earlier is not None:
        command = numbers.maximum(command, start.earlier)
    V = keep("V", last, columns["D"][last] + columns["G"][last] * (held + start.actuator_error))
    return ChainBounds(
        X=tuple(columns["X"]),
        xi=tuple(columns["xi"]),
        A=tuple(columns["A"]),
        L=tuple(columns["L"]),
        W=tuple(columns["W"]),
        s=start.feed,
        B=tuple(columns["B"]),
        D=tuple(columns["D"]),
        G=tuple(columns["G"]),
        g_min=tuple(columns["g"]),
        F_star=demand,
        eta=tuple(columns["eta"]),
        Lambda=tuple(columns["Lambda"]),
        zeta=keep("zeta", last, eta + start.hold * V),
        V=V,
        U=keep("U", last, command + start.actuator_error),
        slope=columns["L"][last],
        delta_v=delta_v,
    )
