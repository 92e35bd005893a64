"""From a design to the controller as a straight-line program: all decisions are made here.

Everything that a printed language could get wrong (order of operations, powers, limits, what is
left out) is settled in the ``Law``; the printers and templates only write it down.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.codegen.center import performance_center, reanchored_center
from bfppc_synth.codegen.limits import (
    certified_constants,
    elapsed_limit,
    input_ranges,
    nearest,
    reference_ranges,
    screening_limits,
    start_ranges,
    time_limit,
    tube_ranges,
    tube_statements,
)
from bfppc_synth.codegen.portable import functions_of
from bfppc_synth.codegen.statements import StatementBuilder
from bfppc_synth.codegen.switching import (
    handover_ranges,
    monitor_ranges,
    reanchors,
    stage_prefix,
)
from bfppc_synth.model.law import (
    SHAPE_FORMULA,
    CenterBlock,
    Law,
    Literal,
    Operator,
    StageLaw,
    Switching,
    Variable,
)
from bfppc_synth.model.shapes import Theorem1Gain

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.law import Operand, ReferenceBlock, Statement
    from bfppc_synth.model.shapes import Gain


def build_law(design: Design) -> Law:
    """Write the controller of a design as statements over binary64 constants.

    Parameters
    ----------
    design : Design
        Gains, tube, bounds and plant file; any center, any method.

    Returns
    -------
    Law
        What ``codegen.python`` and ``codegen.c`` print.

    Raises
    ------
    UsageError
        If the reference expression contains more than the time.
    EnvelopeError
        If the reference, or what center nominal follows, has a subexpression without a rule.

    References
    ----------
    docs/theory.md sections 2 and 3; SPEC section 3 for screening and status.
    """
    spec, arithmetic = design.spec, design.arithmetic
    center = make_center(design)
    feedback = write_feedback(design.gains, center)
    law = Law(
        name=spec.name,
        title=spec.title,
        order=spec.order,
        states=spec.states,
        units=spec.units,
        accuracy=design.omega[0],
        period=arithmetic.nearest(nearest(spec.sampling.period)),
        certified=certified_constants(design),
        limits=screening_limits(design),
        derived=tube_statements(design),
        inputs=input_ranges(design),
        reference_ranges=reference_ranges(design),
        start=start_ranges(design),
        tube=tube_ranges(design),
        time_limit=time_limit(nearest(spec.sampling.period), arithmetic),
        elapsed_limit=elapsed_limit(nearest(spec.sampling.period), arithmetic),
        reference=_reference(design),
        center=center,
        feedback=feedback,
        formula=_formula(design.gains),
        switching=switching_of(design, center),
        arithmetic=arithmetic,
    )
    return replace(law, functions=functions_of(law))


def make_center(design: Design) -> CenterBlock:
    """Write the center that the design's method takes its errors around."""
    if design.nominal is not None:
        # sympy is needed for expressions only, and is loaded by then.
        from bfppc_synth.codegen.nominal import nominal_center

        return nominal_center(design.nominal, design.plant.reference, design.plant.time)
    rhos = design.spec.performance.rho
    if reanchors(design):
        return reanchored_center(rhos, len(design.stages))
    return performance_center(rhos)


def switching_of(design: Design, center: CenterBlock) -> Switching | None:
    """Write every stage of a switching law; None where there is one law only."""
    if not design.stages:
        return None
    numbered = enumerate(design.stages, start=1)
    free = (
        (write_feedback(stage.gains, center, stage_prefix(number)), number)
        for number, stage in numbered
    )
    return Switching(
        stages=(
            *(
                StageLaw(
                    feedback=feedback,
                    stays=monitor_ranges(design, number),
                    expected=handover_ranges(design, number),
                )
                for feedback, number in free
            ),
            StageLaw(feedback=write_feedback(design.gains, center), stays=(), expected=()),
        ),
        anchors=len(design.stages) if reanchors(design) else 0,
    )


def _formula(gains: tuple[Gain, ...]) -> str:
    if not isinstance(gains[0], Theorem1Gain):
        return SHAPE_FORMULA
    if all(isinstance(gain, Theorem1Gain) and len(gain.H) == 1 for gain in gains):
        return "phi_i(e) = gamma_i H_i_0 e + c_i e^N_i"
    return "phi_i(e) = gamma_i (H_i_0 + H_i_1 rho + ..) e + c_i e^N_i"


def _reference(design: Design) -> ReferenceBlock | None:
    if design.plant.reference is None:
        return None
    # sympy is needed for a declared expression only, and is loaded by then.
    from bfppc_synth.codegen.reference import compile_reference

    return compile_reference(design.plant.reference, design.plant.time)


def write_feedback(
    gains: tuple[Gain, ...], center: CenterBlock, stage: str = ""
) -> tuple[Statement, ...]:
    """ê_i = x_i - r_i + phi_{i-1}(ê_{i-1}), u = v - phi_n(ê_n)."""
    builder = StatementBuilder("feedback")
    phi: Variable | None = None
    for i, shape in enumerate(gains, start=1):
        x_i, r_i = Variable(name=f"x_{i}"), center.r[i - 1]
        if phi is None:
            e_i = builder.name(f"e_{i}", Operator.SUB, x_i, r_i)
        else:
            e_i = builder.name(f"e_{i}", Operator.ADD, builder.emit(Operator.SUB, x_i, r_i), phi)
        phi = _phi(builder, shape, i, e_i, stage)
    # v = 0 stays as 0 - phi_n: a command of -0.0 would only puzzle.
    builder.name("u", Operator.SUB, center.v, Variable(name=f"phi_{len(gains)}"))
    return builder.statements


def _phi(builder: StatementBuilder, shape: Gain, i: int, e: Variable, stage: str) -> Variable:
    """phi_i(e) = k e + M tanh((M/epsilon) e) + c e^N, in this order; zero terms left out."""
    if isinstance(shape, Theorem1Gain):
        return _phi_of_theorem1(builder, shape, i, e)
    k, M, epsilon, c = (Variable(name=f"{stage}{gain}_{i}") for gain in ("k", "M", "epsilon", "c"))
    factors: list[tuple[Operand, Operand]] = []
    if shape.k != 0.0:
        factors.append((k, e))
    if shape.M != 0.0:
        # Two constants in front: a compiler divides them once, and no step does.
        bend = builder.emit(Operator.MUL, builder.emit(Operator.DIV, M, epsilon), e)
        factors.append((M, builder.emit(Operator.TANH, bend)))
    if shape.c != 0.0:
        factors.append((c, builder.power(e, shape.N)))
    if len(factors) < 2:
        left, right = factors[0] if factors else (Literal(value=0.0), e)
        return builder.name(f"phi_{i}", Operator.MUL, left, right)
    *first, last = (builder.emit(Operator.MUL, left, right) for left, right in factors)
    total: Operand = first[0]
    for term in first[1:]:
        total = builder.emit(Operator.ADD, total, term)
    return builder.name(f"phi_{i}", Operator.ADD, total, last)


def _phi_of_theorem1(
    builder: StatementBuilder, gain: Theorem1Gain, i: int, e: Variable
) -> Variable:
    """phi_i(e) = (gamma H(rho)) e + c e^N, H(rho) by Horner's rule."""
    *others, last = (Variable(name=f"H_{i}_{j}") for j in range(len(gain.H)))
    height: Operand = last
    for coefficient in reversed(others):
        faded = builder.emit(Operator.MUL, height, Variable(name="rho"))
        height = builder.emit(Operator.ADD, faded, coefficient)
    slope = builder.emit(Operator.MUL, Variable(name=f"gamma_{i}"), height)
    if gain.c == 0.0:
        return builder.name(f"phi_{i}", Operator.MUL, slope, e)
    linear = builder.emit(Operator.MUL, slope, e)
    power = builder.emit(Operator.MUL, Variable(name=f"c_{i}"), builder.power(e, gain.N))
    return builder.name(f"phi_{i}", Operator.ADD, linear, power)
