"""What the chain of bounds starts from and ends in (docs/theory.md sections 2 and 3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    import sympy as sp

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelMajorants:
    """What bounds channel i, as sympy expressions in the states and parameters.

    ``f_star`` is the expression whose envelope gives maj f_i* (the declared f_bound, else f);
    ``g_star`` and ``g_min`` likewise for g. ``f_text``, ``g_text`` are the majorants over
    |x_j| <= z_j as printable sympy expressions in z1..zi; ``g_min_text`` the lower envelope.
    """

    f_star: sp.Expr
    g_star: sp.Expr
    g_min: sp.Expr
    disturbance: sp.Expr
    f_text: sp.Expr
    g_text: sp.Expr
    g_min_text: sp.Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class Majorants:
    """One record per channel; ``magnitudes`` are z1..zn, the symbols of the texts."""

    channels: tuple[ChannelMajorants, ...]
    magnitudes: tuple[sp.Symbol, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CenterBounds:
    """Rigorous float bounds on the center r_1..r_n, v over all t and declared starts.

    ``r_lower``, ``r_upper`` enclose r_i(t); ``rate`` bounds |dr_i|; ``feed`` is s_2..s_{n+1}
    (sup |r_{i+1}| for center performance, 0 for nominal), so feed[i] belongs to channel i+1
    in the paper's counting; ``v``, ``v_rate``, ``v_start`` bound |v|, |dv| and |v| on
    [0, delay]; ``earlier`` bounds the commands of the laws that this one takes over from.
    """

    r_lower: tuple[float, ...]
    r_upper: tuple[float, ...]
    rate: tuple[float, ...]
    feed: tuple[float, ...]
    v: float
    v_rate: float
    v_start: float
    earlier: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalBounds:
    """Bounds on the reference and the performance functions.

    Y_0, Y_1 bound |y_d|, |dy_d|; ``offset_lower/upper`` enclose the latched a = q(x_1(0)) -
    y_d(0) (or the exact one, as the anchor says); a_0 its largest magnitude; ``rho_floor``
    is inf rho_i and ``rho_rate`` bounds |drho_i|, one per state.
    """

    Y_0: float
    Y_1: float
    a_0: float
    offset_lower: float
    offset_upper: float
    rho_floor: tuple[float, ...]
    rho_rate: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """Measurement, sampling and actuator data as upward-rounded floats.

    ``delta`` is delta_{0,i} (quantization plus noise, times 1 + rho_M for the exact anchor);
    ``hold`` is h + tau [s], ``delay`` tau [s], ``actuator_error`` delta_u.
    """

    delta: tuple[float, ...]
    hold: float
    delay: float
    actuator_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainBounds(Generic[T]):
    """Every constant of docs/theory.md sections 2 and 3 for one design.

    Index i-1 holds the constant of step i. T is float in a finished design; the search and
    the report run the same chain on CasADi and sympy numbers. ``s`` is s_2..s_{n+1}; ``B``
    and ``L`` have one entry per step (the last of B is 0, nothing uses it); ``G`` is
    maj g_i*; ``zeta`` is that of U2; ``slope`` is sup |phi_n'| on the tube.
    """

    X: tuple[T, ...]
    xi: tuple[T, ...]
    A: tuple[T, ...]
    L: tuple[T, ...]
    W: tuple[T, ...]
    s: tuple[T, ...]
    B: tuple[T, ...]
    D: tuple[T, ...]
    G: tuple[T, ...]
    g_min: tuple[T, ...]
    F_star: tuple[T, ...]
    eta: tuple[T, ...]
    Lambda: tuple[T, ...]
    zeta: T
    V: T
    U: T
    slope: T
    delta_v: T
