"""The center of the errors as statements: r_i = rho_i x_i(0), and what handovers add to it."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

from bfppc_synth.codegen.limits import exact, nearest
from bfppc_synth.codegen.statements import StatementBuilder
from bfppc_synth.model.law import CenterBlock, Literal, Operator, Variable
from bfppc_synth.model.spec import RhoKind

if TYPE_CHECKING:
    from bfppc_synth.model.law import Operand
    from bfppc_synth.model.spec import RhoSpec

ELAPSED = Variable(name="elapsed")
_Y_D = Variable(name="y_d")
_OFFSET = Variable(name="offset")


def performance_center(rhos: tuple[RhoSpec, ...]) -> CenterBlock:
    """Write r_1 = y_d + rho_1 a, r_i = rho_i x_i(0), v = 0 (50)-(51)."""
    builder = StatementBuilder("center")
    values: dict[tuple[object, ...], Operand] = {}
    r: list[Operand] = []
    latched: list[str] = []
    for i, rho in enumerate(rhos, start=1):
        key = _rho_key(rho)
        if key not in values:
            name = "rho" if len({_rho_key(other) for other in rhos}) == 1 else f"rho_{i}"
            values[key] = _rho(builder, rho, name, ELAPSED)
        if i == 1:
            fade = builder.emit(Operator.MUL, values[key], _OFFSET)
            r.append(builder.name("r_1", Operator.ADD, _Y_D, fade))
        else:
            start = Variable(name=f"start_{i}")
            latched.append(start.name)
            r.append(builder.name(f"r_{i}", Operator.MUL, values[key], start))
    return CenterBlock(
        statements=builder.statements, r=tuple(r), v=Literal(value=0.0), latched=tuple(latched)
    )


def reanchored_center(rhos: tuple[RhoSpec, ...], switches: int) -> CenterBlock:
    """Write the center of docs/theory.md section 8 for every number of switches so far.

    r_1 = y_d + rho_1(elapsed) a + sum over l of rho_1(since_l) anchor_l, where the anchor of a
    switch that has not happened is 0; r_i = rho_i(since) start_i, with ``since`` and
    ``start_i`` those of the last switch.

    Parameters
    ----------
    rhos : tuple[RhoSpec, ...]
        One performance function per state; rhobar is the same function.
    switches : int
        K - 1.

    Returns
    -------
    CenterBlock
        It reads ``elapsed``, ``since``, ``since_l``, ``anchor_l``, ``y_d``, ``offset`` and
        ``start_i``; all times in seconds.
    """
    builder = StatementBuilder("center")
    first = _rho(builder, rhos[0], "rho_1", ELAPSED)
    total: Operand = builder.emit(Operator.ADD, _Y_D, builder.emit(Operator.MUL, first, _OFFSET))
    for number in range(1, switches + 1):
        since = Variable(name=f"since_{number}")
        faded = _rho(builder, rhos[0], f"rhobar_{number}", since)
        moved = builder.emit(Operator.MUL, faded, Variable(name=f"anchor_{number}"))
        if number < switches:
            total = builder.emit(Operator.ADD, total, moved)
        else:
            total = builder.name("r_1", Operator.ADD, total, moved)
    r: list[Operand] = [total]
    latched = tuple(f"start_{i}" for i in range(2, len(rhos) + 1))
    last = Variable(name="since")
    for i, (rho, start) in enumerate(zip(rhos[1:], latched, strict=True), start=2):
        level = _rho(builder, rho, f"rho_{i}", last)
        r.append(builder.name(f"r_{i}", Operator.MUL, level, Variable(name=start)))
    return CenterBlock(
        statements=builder.statements, r=tuple(r), v=Literal(value=0.0), latched=latched
    )


def _rho_key(rho: RhoSpec) -> tuple[object, ...]:
    numbers = (rho.t_s, rho.rate, rho.floor)
    return (rho.kind, *(None if number is None else nearest(number) for number in numbers))


def _rho(builder: StatementBuilder, rho: RhoSpec, name: str, time: Variable) -> Variable:
    """(52): (1 + cos(s/t_s))/2 up to pi t_s, then 0. (53): (1 - floor) exp(-rate s) + floor."""
    if rho.kind is RhoKind.COSINE and rho.t_s is not None:
        t_s = nearest(rho.t_s)
        phase = builder.emit(Operator.DIV, time, Literal(value=t_s))
        lifted = builder.emit(Operator.ADD, Literal(value=1.0), builder.emit(Operator.COS, phase))
        wave = builder.emit(Operator.MUL, Literal(value=0.5), lifted)
        end = Literal(value=math.pi * t_s)
        zero = Literal(value=0.0)
        return builder.name(name, Operator.SELECT_LESS, time, end, wave, zero)
    rate = 0.0 if rho.rate is None else nearest(rho.rate)
    floor = Fraction(0) if rho.floor is None else exact(rho.floor)
    exponent = builder.emit(Operator.MUL, Literal(value=-rate), time)
    if floor == 0:
        return builder.name(name, Operator.EXP, exponent)
    decay = builder.emit(Operator.EXP, exponent)
    scaled = builder.emit(Operator.MUL, Literal(value=float(1 - floor)), decay)
    return builder.name(name, Operator.ADD, scaled, Literal(value=float(floor)))
