"""The chain of Theorem 1, docs/theory.md section 7, once for every number type."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from bfppc_synth.errors import ShapeError

if TYPE_CHECKING:
    from bfppc_synth.bounds.chain import Residual
    from bfppc_synth.bounds.feedback import Numbers
    from bfppc_synth.model.bounds import CenterBounds

T = TypeVar("T")

# H_i is kept above this rate [1/s] times p_i: Definition 1 wants H_i > 0 even for f = 0.
LEAST_HEIGHT = 1e-3
# Nodes of rho at which a scheduled H_i is fitted and judged; the checker bisects instead.
SCHEDULE_NODES = tuple(j / 8 for j in range(9))
CONSTANT_NODES = (1.0,)


class Facet(Enum):
    """Whether the motion of p_i(rho) and of H_{i-1}(rho) is counted."""

    MOVING = auto()
    IGNORED = auto()  # the paper's text


@dataclass(frozen=True, slots=True, kw_only=True)
class Step1(Generic[T]):
    """One step of Theorem 1: what is fixed or tried.

    ``H`` are polynomial coefficients, None where H_i follows from the chain; ``p`` the
    half-width at rho = 1 or None, ``epsilon`` the room eps_i or None: p wins, one is needed.
    ``H_star`` is read by the printed (39) only.
    """

    gamma: T
    H: tuple[T, ...] | None
    H_star: T | None
    c: T
    N: int
    p: T | None
    epsilon: T | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain1Input(Generic[T]):
    """What one evaluation starts from.

    ``nodes`` are values of rho, the last one 1; ``noise`` is delta_{M,i} per state;
    ``feed`` are |x_2(0)|..|x_n(0)|, 0 (times rho they bound r_{i+1}); ``rate`` is rho_M;
    ``room`` the relative amount by which a free H_i exceeds what it must dominate.
    """

    steps: tuple[Step1[T], ...]
    c_0: T
    nodes: tuple[float, ...]
    noise: tuple[float, ...]
    feed: tuple[float, ...]
    rate: float
    room: float
    facet: Facet


@dataclass(frozen=True, slots=True, kw_only=True)
class Node1(Generic[T]):
    """Every constant of one step at one rho.

    ``D`` bounds |ê_i - e_i|, ``delta`` bounds the change of alpha_i that it makes (with c_0
    for the power term); ``needed`` is H_i^0(rho), which ``H`` must dominate; ``load`` is
    H_i^0 without the facet's motion; ``B`` bounds |d alpha_{i-1}|; ``W``, ``xi``, ``A``,
    ``L`` as in section 2; the slopes are derivatives in rho.
    """

    p: T
    D: T
    delta: T
    needed: T
    H: T
    load: T
    W: T
    xi: T
    A: T
    L: T
    B: T
    D_slope: T
    delta_slope: T


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain1(Generic[T]):
    """All steps: ``tables[i][j]`` is step i at ``nodes[j]``; ``H`` the coefficients of H_i.

    ``epsilon`` are the rooms eps_i = p_i - D_i; ``peak`` bounds |u| and ``slope`` phi_n' on
    the tube, both at rho = 1.
    """

    nodes: tuple[float, ...]
    tables: tuple[tuple[Node1[T], ...], ...]
    H: tuple[tuple[T, ...], ...]
    epsilon: tuple[T, ...]
    peak: T
    slope: T


def faded(center: CenterBounds, rho: float) -> CenterBounds:
    """Bound the center r_i = rho x_i(0) for all performance values up to ``rho``.

    Nested in rho: the box contains 0, so what it bounds is nondecreasing in rho.
    """
    if rho == 1.0:
        return center
    return replace(
        center,
        r_lower=tuple(rho * min(0.0, lower) for lower in center.r_lower),
        r_upper=tuple(rho * max(0.0, upper) for upper in center.r_upper),
    )


def evaluate_theorem1(
    start: Chain1Input[T], residuals: tuple[Residual[T], ...], numbers: Numbers[T]
) -> Chain1[T]:
    """Evaluate the chain in the order H_1, delta_1, p_2, H_2, ..

    Parameters
    ----------
    start : Chain1Input[T]
        Gains, half-widths or rooms, measurement errors, starts.
    residuals : tuple[Residual[T], ...]
        W_i at every node, from ``faded`` centers.
    numbers : Numbers[T]
        Functions of the number type.

    Returns
    -------
    Chain1[T]
        Every constant at every node, in the units of the states (rates per second).

    Raises
    ------
    ShapeError
        If a step has neither p nor epsilon, or there is not one residual per node.

    References
    ----------
    docs/theory.md section 7; the paper's (14), (17)-(37), (41)-(42).
    """
    if len(residuals) != len(start.nodes):
        raise ShapeError(f"the chain needs {len(start.nodes)} residuals, one per node of rho")
    rows: list[tuple[Node1[Any], ...]] = []
    heights: list[tuple[Any, ...]] = []
    rooms: list[Any] = []
    zero: Any = numbers.number(0.0)
    for i, step in enumerate(start.steps):
        behind = rows[-1] if rows else None
        spread = [
            (zero + start.noise[i], zero)
            if behind is None
            else (behind[j].delta + start.noise[i], behind[j].delta_slope)
            for j in range(len(start.nodes))
        ]
        if step.p is not None:
            room: Any = step.p - spread[-1][0]
        elif step.epsilon is not None:
            room = step.epsilon
        else:
            raise ShapeError(f"step {i + 1} has neither p nor epsilon")
        rooms.append(room)
        partial = [
            _load(start, i, j, spread[j], room, rows, heights, residuals[j], zero)
            for j in range(len(start.nodes))
        ]
        H = step.H
        if H is None:
            least = [node.needed + LEAST_HEIGHT * node.p for node in partial]
            H = _cover(least, start.nodes, start.room, numbers)
        heights.append(H)
        rows.append(
            tuple(
                _close(step, H, node, rho, start.c_0)
                for node, rho in zip(partial, start.nodes, strict=True)
            )
        )
    top, last = rows[-1][-1], start.steps[-1]
    reach: Any = top.p + top.D
    gain: Any = last.gamma
    power: Any = last.c
    return Chain1(
        nodes=start.nodes,
        tables=tuple(rows),
        H=tuple(heights),
        epsilon=tuple(rooms),
        peak=gain * top.H * reach + power * reach**last.N,
        slope=top.L,
    )


def polynomial(H: tuple[Any, ...], rho: float) -> Any:
    """Evaluate H(rho) by Horner's rule."""
    value: Any = H[-1]
    for coefficient in reversed(H[:-1]):
        value = value * rho + coefficient
    return value


def polynomial_slope(H: tuple[Any, ...], rho: float, zero: Any) -> Any:
    """Evaluate H'(rho); nonnegative as every coefficient is."""
    value: Any = zero
    for power in range(len(H) - 1, 0, -1):
        value = value * rho + power * H[power]
    return value


def _load(
    start: Chain1Input[Any],
    i: int,
    j: int,
    spread: tuple[Any, Any],
    room: Any,
    rows: list[tuple[Node1[Any], ...]],
    heights: list[tuple[Any, ...]],
    residual: Residual[Any],
    zero: Any,
) -> Node1[Any]:
    """H_i^0 at one node; what depends on H_i itself is filled in by ``_close``."""
    rho, (D, D_slope) = start.nodes[j], spread
    p = D + room
    B: Any = zero
    xi = p
    if i > 0:
        before, step = rows[i - 1][j], start.steps[i - 1]
        # phi' and the speed of e_{i-1} are both largest at the corner e_{i-1} = p_{i-1}.
        B = before.L * (before.load + p + before.A)
        if start.facet is Facet.MOVING:
            B = B + step.gamma * polynomial_slope(heights[i - 1], rho, zero) * start.rate * before.p
        xi = p + before.A
    reach = (*(row[j].xi for row in rows), xi)
    W: Any = residual.disturbance(i, reach)
    load = W + B + rho * start.feed[i]
    needed = load
    if start.facet is Facet.MOVING:
        needed = load + start.rate * D_slope
    return Node1(
        p=p,
        D=D,
        delta=zero,
        needed=needed,
        H=zero,
        load=load,
        W=W,
        xi=xi,
        A=zero,
        L=zero,
        B=B,
        D_slope=D_slope,
        delta_slope=zero,
    )


def _close(
    step: Step1[Any], H: tuple[Any, ...], node: Node1[Any], rho: float, c_0: Any
) -> Node1[Any]:
    height = polynomial(H, rho)
    steep = polynomial_slope(H, rho, node.H)
    linear = step.gamma * height
    return replace(
        node,
        H=height,
        A=linear * node.p + step.c * node.p**step.N,
        L=linear + step.c * step.N * node.p ** (step.N - 1),
        delta=linear * node.D + c_0,
        delta_slope=step.gamma * (steep * node.D + height * node.D_slope),
    )


def _cover(
    least: list[Any], nodes: tuple[float, ...], room: float, numbers: Numbers[Any]
) -> tuple[Any, ...]:
    """Choose H_i: a constant, or a line through its value at 0 above every other node."""
    if len(nodes) == 1:
        return (least[0] * (1.0 + room),)
    base = least[0] * (1.0 + room)
    steep: Any = numbers.number(0.0)
    for value, rho in zip(least[1:], nodes[1:], strict=True):
        steep = numbers.maximum(steep, (value * (1.0 + room) - base) / rho)
    return base, steep
