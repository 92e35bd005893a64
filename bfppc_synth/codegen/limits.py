"""The constants of a controller: certified gains, screening limits, and what is tested by them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

from bfppc_synth.codegen.switching import largest_state, stage_constants, stage_limits
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.law import NamedConstant, Operator, Range, Statement, Variable
from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.model.spec import Anchor

if TYPE_CHECKING:
    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.expression import Constant

#: t - t_0 beyond this is refused: the elapsed time then has a resolution of 0.1 ns [s].
ELAPSED_LIMIT = 1e6
#: Longest run in binary32 where no period says what its clock must resolve [s].
_SINGLE_RUN = 64.0
#: What a measured reference may exceed 1.01 Y_0 by, so that Y_0 = 0 admits rounding.
_TINY = Fraction(1, 10**9)
_FEW_ULP = Fraction(1, 2**50)
#: Room for the rounding of U on its way here: the clamp must not cut a command inside Omega.
_PEAK_ROOM = 1.0 + 2.0**-40


def nearest(constant: Constant) -> float:
    """Return the nearest binary64 of a plant file's number (of an irrational one, to a few ulp)."""
    return constant.approximate if constant.exact is None else float(constant.exact)


def time_limit(period: float, arithmetic: Arithmetic = DEFAULT) -> float | None:
    """Find the first power of two at which one ulp of t exceeds period/16 [s].

    Parameters
    ----------
    period : float
        Declared sample period [s]; 0 is continuous.
    arithmetic : Arithmetic
        Of the clock.

    Returns
    -------
    float | None
        abs(t) must stay below it; None for period 0 in binary64. SPEC section 3, BAD_TIME.
    """
    if period == 0.0:
        return _SINGLE_RUN if arithmetic.single else None
    _, exponent = math.frexp(period / 16.0)
    most = 20 if arithmetic.single else 1023
    return math.ldexp(1.0, min(exponent + arithmetic.bits - 1, most))


def elapsed_limit(period: float, arithmetic: Arithmetic) -> float:
    """Longest time since the first sample [s]; in binary32 what the clock resolves."""
    limit = time_limit(period, arithmetic)
    return limit if arithmetic.single and limit is not None else ELAPSED_LIMIT


def certified_constants(design: Design) -> tuple[NamedConstant, ...]:
    """List the numbers that the certificate is about, in the order of the files."""
    constants: list[NamedConstant] = []
    for i, (shape, p) in enumerate(zip(design.gains, design.omega, strict=True), start=1):
        bent, curved = shape.M != 0.0, shape.c != 0.0
        if isinstance(shape, Theorem1Gain):
            constants += [
                NamedConstant(name=f"gamma_{i}", value=shape.gamma),
                *(NamedConstant(name=f"H_{i}_{j}", value=h) for j, h in enumerate(shape.H)),
                NamedConstant(name=f"c_{i}", value=shape.c, used=curved),
                NamedConstant(name=f"N_{i}", value=shape.N, used=False),
                NamedConstant(name=f"p_{i}", value=p),
            ]
            continue
        constants += [
            NamedConstant(name=f"k_{i}", value=shape.k, used=shape.k != 0.0),
            NamedConstant(name=f"M_{i}", value=shape.M, used=bent),
            NamedConstant(name=f"epsilon_{i}", value=shape.epsilon, used=bent),
            NamedConstant(name=f"c_{i}", value=shape.c, used=curved),
            NamedConstant(name=f"N_{i}", value=shape.N, used=False),
            NamedConstant(name=f"p_{i}", value=p),
        ]
    constants += stage_constants(design)
    if design.nominal is not None:
        constants.append(NamedConstant(name="T_s", value=design.nominal.transition))
    return (*constants, NamedConstant(name="U_MAX", value=_clamp(design)))


def _clamp(design: Design) -> float:
    """Take the clamp that was certified; without a proof, U rounded up."""
    if design.certificate.document:
        certified = json.loads(design.certificate.document)["design"]["U_MAX"]
        return float.fromhex(certified)
    peak = design.arithmetic.above(design.bounds.U * _PEAK_ROOM)
    limit = design.spec.actuator.limit
    if limit is None or nearest(limit) < design.bounds.U:
        return peak
    # A command at the clamp must not pass the limit that the design keeps.
    return min(peak, design.arithmetic.below(nearest(limit)))


def screening_limits(design: Design) -> tuple[NamedConstant, ...]:
    """List the screening limits of SPEC section 3; nothing is certified about them."""
    spec, delta, arithmetic = design.spec, _resolutions(design), design.arithmetic
    constants: list[NamedConstant] = []
    for i in range(1, spec.order + 1):
        reach = Fraction(largest_state(design, i - 1)) + delta[i - 1]
        constants.append(NamedConstant(name=f"x_limit_{i}", value=_above(4 * reach)))
        eta, box = design.bounds.eta[i - 1], spec.initial[i - 1]
        if eta != 0.0:
            constants.append(NamedConstant(name=f"eta_{i}", value=_room(design, i, eta)))
        lower = -_widened(-exact(box.lower), box.lower, delta[i - 1])
        upper = _widened(exact(box.upper), box.upper, delta[i - 1])
        constants += [
            # Not a sign in front: a start at 0 would be printed as -0.0.
            NamedConstant(name=f"start_lower_{i}", value=0.0 - _above(-lower)),
            NamedConstant(name=f"start_upper_{i}", value=_above(upper)),
        ]
    if spec.offset is not None:
        offset = _widened(exact(spec.offset), spec.offset, delta[0])
        constants.append(NamedConstant(name="offset_limit", value=_above(offset)))
    constants += stage_limits(design)
    constants += (
        NamedConstant(name=test.upper, value=_above(Fraction(101, 100) * Fraction(bound) + _TINY))
        for test, bound in zip(reference_ranges(design), _reference_bounds(design), strict=True)
    )
    period = nearest(spec.sampling.period)
    elapsed = elapsed_limit(period, arithmetic)
    constants.append(NamedConstant(name="elapsed_limit", value=elapsed))
    limit = time_limit(period, arithmetic)
    if limit is not None:
        constants.append(NamedConstant(name="time_limit", value=limit))
    return tuple(_outward(constant, arithmetic) for constant in constants)


def _outward(constant: NamedConstant, arithmetic: Arithmetic) -> NamedConstant:
    """Move a limit outward to a number of the code."""
    move = arithmetic.below if constant.name.startswith("start_lower") else arithmetic.above
    return replace(constant, value=move(constant.value))


def _room(design: Design, i: int, eta: float) -> float:
    """Round eta_i up; in binary32 so far that p_i + eta_i, rounded there, is not too small."""
    own = design.arithmetic.single * 2.0**-22 * (design.omega[i - 1] + eta)
    return math.nextafter(eta + own, math.inf)


def _resolutions(design: Design) -> tuple[Fraction, ...]:
    """delta_{0,i}: how far a measured start may lie outside the declared one."""
    # The exact anchor doubles delta_0 in the chain (1 + rho_M, rho_M = 1), not in the sensor.
    anchored = 2 if design.spec.synthesis.anchor is Anchor.EXACT else 1
    return tuple(Fraction(delta) / anchored for delta in design.conditions.delta)


def exact(constant: Constant) -> Fraction:
    """Value of a plant file's number (of an irrational one, to a few ulp)."""
    return Fraction(constant.approximate) if constant.exact is None else constant.exact


def _widened(end: Fraction, constant: Constant, delta: Fraction) -> Fraction:
    """Move an upper end outward by delta, and by what rounding may have added to it."""
    # A quantizer multiplies and a sensor adds in binary64: a sample at the very edge of the
    # initial set must not count as outside. A rational start measured exactly has no such error.
    measured_exactly = constant.exact is not None and delta == 0
    return end if measured_exactly else end + delta + _FEW_ULP * (abs(end) + delta)


def _above(value: Fraction) -> float:
    """Smallest binary64 that is not below a rational."""
    near = float(value)
    return near if Fraction(near) >= value else math.nextafter(near, math.inf)


def input_ranges(design: Design) -> tuple[Range, ...]:
    """Say what every measured state is screened by."""
    return tuple(
        Range(variable=f"x_{i}", upper=f"x_limit_{i}") for i in range(1, design.spec.order + 1)
    )


def reference_ranges(design: Design) -> tuple[Range, ...]:
    """Say what a passed reference is screened by, its derivatives too where they are passed."""
    if not _passes_derivatives(design):
        return (Range(variable="y_d", upper="y_d_limit"),)
    numbers = range(1, design.spec.order + 1)
    rates = (Range(variable=f"y_d_{k}", upper=f"y_d_limit_{k}") for k in numbers)
    return (Range(variable="y_d_0", upper="y_d_limit"), *rates)


def _passes_derivatives(design: Design) -> bool:
    """Tell whether center nominal needs y_d, dy_d, .., y_d^(n) with every sample."""
    return design.nominal is not None and design.plant.reference is None


def _reference_bounds(design: Design) -> tuple[float | Fraction, ...]:
    """Bounds on what is passed: Y_0, or Y_0..Y_n."""
    if not _passes_derivatives(design):
        return (design.signals.Y_0,)
    return tuple(exact(bound) for bound in design.spec.reference.bounds[: design.spec.order + 1])


def start_ranges(design: Design) -> tuple[Range, ...]:
    """Say where the first sample must lie; an offset where the plant file bounds it."""
    box = tuple(
        Range(variable=f"x_{i}", lower=f"start_lower_{i}", upper=f"start_upper_{i}")
        for i in range(1, design.spec.order + 1)
    )
    if design.spec.offset is None:
        return box
    return (*box, Range(variable="offset", upper="offset_limit"))


def tube_ranges(design: Design) -> tuple[Range, ...]:
    """Say where the measured errors lie while the true ones are in Omega."""
    return tuple(
        Range(variable=f"e_{i}", upper=f"p_{i}" if eta == 0.0 else f"tube_{i}")
        for i, eta in enumerate(design.bounds.eta, start=1)
    )


def tube_statements(design: Design) -> tuple[Statement, ...]:
    """Compute tube_i = p_i + eta_i: |ê_i| <= p_i + eta_i wherever |e_i| <= p_i."""
    return tuple(
        Statement(
            target=f"tube_{i}",
            operator=Operator.ADD,
            operands=(Variable(name=f"p_{i}"), Variable(name=f"eta_{i}")),
        )
        for i, eta in enumerate(design.bounds.eta, start=1)
        if eta != 0.0
    )
