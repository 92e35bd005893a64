"""The law as a record: what is decided before any language."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from fractions import Fraction

import pytest

from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.limits import time_limit
from bfppc_synth.codegen.statements import StatementBuilder
from bfppc_synth.model.law import Literal, Operator, Variable

BOX = (("0", "0"),)


def values(law):
    return {constant.name: constant.value for constant in law.certified}


def operators(statements):
    return [statement.operator for statement in statements]


@pytest.mark.parametrize("period", [1e-4, 1e-3, 0.01, 0.0003, 16.0, 1.0, 1e-9])
def test_the_time_limit_is_where_an_ulp_passes_a_sixteenth_of_the_period(period):
    limit = time_limit(period)
    assert math.frexp(limit)[0] == 0.5
    assert math.ulp(limit) > period / 16 >= math.ulp(math.nextafter(limit, 0.0))


def test_there_is_no_time_limit_without_a_period(handmade):
    assert time_limit(0.0) is None
    assert build_law(handmade.kinked()).time_limit is None


def test_every_certified_number_is_listed_once_and_in_order(handmade):
    law = build_law(handmade.everyday())
    stems = ("k", "M", "epsilon", "c", "N", "p")
    assert list(values(law)) == [f"{s}_{i}" for i in (1, 2) for s in stems] + ["U_MAX"]
    assert values(law)["epsilon_2"] == 2.0
    assert values(law)["N_2"] == 5
    assert values(law)["p_1"] == 1.0


def test_the_clamp_is_not_below_the_certified_peak_and_hardly_above(handmade):
    design = handmade.everyday()
    law = build_law(design)
    assert design.bounds.U < law.u_max <= design.bounds.U * (1 + 1e-12)


@pytest.mark.parametrize(("room", "clipped"), [(0.0, True), (1e-3, False)])
def test_the_clamp_keeps_the_actuator_limit(handmade, room, clipped):
    design = handmade.everyday()
    limit = design.bounds.U * (1 + room)
    constant = handmade.constant(str(Fraction(limit)))
    actuator = replace(design.spec.actuator, limit=constant)
    law = build_law(replace(design, spec=replace(design.spec, actuator=actuator)))
    assert law.u_max <= limit
    assert (law.u_max == limit) == clipped


def test_terms_with_a_zero_gain_are_left_out(handmade):
    linear = build_law(handmade.make_design(gains=(handmade.shape(k=2.0),), p=(0.1,), initial=BOX))
    assert operators(linear.feedback) == [Operator.SUB, Operator.MUL, Operator.SUB]
    bent = build_law(
        handmade.make_design(gains=(handmade.shape(k=0.0, M=2.0),), p=(0.1,), initial=BOX)
    )
    assert operators(bent.feedback).count(Operator.TANH) == 1
    assert Variable(name="k_1") not in {o for s in bent.feedback for o in s.operands}


def test_the_terms_of_the_feedback_stand_in_one_order(handmade):
    gains = (handmade.shape(M=2.0, c=3.0),)
    law = build_law(handmade.make_design(gains=gains, p=(0.1,), initial=BOX))
    known = {statement.target: statement for statement in law.feedback}

    def first_factor(operand):
        return known[operand.name].operands[0].name

    phi = known["phi_1"]
    linear_and_tanh, power = phi.operands
    assert phi.operator is known[linear_and_tanh.name].operator is Operator.ADD
    linear, bent = known[linear_and_tanh.name].operands
    assert [first_factor(o) for o in (linear, bent, power)] == ["k_1", "M_1", "c_1"]
    assert known["u"].operands == (Literal(value=0.0), Variable(name="phi_1"))


@pytest.mark.parametrize("exponent", [1, 2, 3, 4, 5, 7, 9, 11, 31])
def test_powers_are_products(exponent):
    builder = StatementBuilder("test")
    result = builder.power(Variable(name="x"), exponent)
    assert set(operators(builder.statements)) <= {Operator.MUL}
    assert len(builder.statements) <= 2 * exponent.bit_length()
    known = {"x": 3}
    for statement in builder.statements:
        left, right = (known[operand.name] for operand in statement.operands)
        known[statement.target] = left * right
    assert known[result.name] == 3**exponent


def test_an_equal_rho_is_computed_once(handmade):
    law = build_law(handmade.everyday())
    assert operators(law.center.statements).count(Operator.COS) == 1
    mixed = build_law(handmade.run_time())
    assert operators(mixed.center.statements).count(Operator.COS) == 1
    assert operators(mixed.center.statements).count(Operator.EXP) == 1


def test_every_target_is_assigned_once(handmade):
    for make in handmade.DESIGNS.values():
        law = build_law(make())
        blocks = (law.derived, law.center.statements, law.feedback)
        targets = [statement.target for block in blocks for statement in block]
        assert len(targets) == len(set(targets))


def test_the_center_is_a_block_of_its_own(handmade):
    law = build_law(handmade.run_time())
    assert [operand.name for operand in law.center.r] == ["r_1", "r_2", "r_3"]
    assert law.center.v == Literal(value=0.0)
    assert law.center.latched == ("start_2", "start_3")
    read = {o.name for s in law.feedback for o in s.operands if isinstance(o, Variable)}
    assert not read & {"elapsed", "y_d", "offset", "start_2", "start_3", "rho_1"}


def test_irrational_ends_of_the_initial_set_are_widened(handmade):
    design = handmade.make_design(initial=(("1/2", "1/2"), ("0", "0")))
    end = handmade.irrational(math.pi / 60)
    box = replace(design.spec.initial[0], lower=end, upper=end)
    spec = replace(design.spec, initial=(box, design.spec.initial[1]))
    limits = {c.name: c.value for c in build_law(replace(design, spec=spec)).limits}
    assert limits["start_lower_1"] < math.pi / 60 < limits["start_upper_1"]
    assert limits["start_upper_1"] - limits["start_lower_1"] < 1e-15


def test_a_law_can_be_made_twice(handmade):
    assert build_law(handmade.kinked()) == build_law(handmade.kinked())


def test_the_clamp_is_the_certified_one_where_there_is_a_proof(handmade):
    design = handmade.everyday()
    peak = design.bounds.U * 1.01
    document = json.dumps({"design": {"U_MAX": peak.hex()}})
    proved = replace(design, certificate=replace(design.certificate, document=document))
    assert build_law(proved).u_max == peak
