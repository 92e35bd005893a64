"""The law as functions without memory: the bits of controller.py in Python and in CasADi."""

from __future__ import annotations

import random
from dataclasses import replace

import casadi as ca
import pytest

from bfppc_synth.codegen.control import PlantText, render_control
from bfppc_synth.codegen.pure import render_casadi
from bfppc_synth.errors import UsageError
from bfppc_synth.simulation.loading import load_text

KINDS = [
    *("everyday", "kinked", "run_time", "overflowing"),
    *("integrator", "supplied", "joint", "single"),
]
NO_PLANT = PlantText(
    imports="from math import asinh, atan, cos, cosh, exp, log, pow, sin, sinh, sqrt, tan, tanh",
    functions="def coefficients_model(t, *x):\n    return x",
    arguments=("a1",),
    nominal=(0.5,),
)


def script(text: str, name: str):
    return load_text(text, name=name, origin=name)


def samples(one, kind: str, count: int):
    """Times, states and references near the start, of several runs."""
    rng, module = random.Random(kind), one.module  # noqa: S311
    numbers = range(1, one.law.order + 1)
    ends = [
        (getattr(module, f"start_lower_{i}"), getattr(module, f"start_upper_{i}")) for i in numbers
    ]
    passed = 0 if one.law.reference is not None else len(one.law.derivatives) or 1
    for _ in range(count):
        run, time = [], 0.0
        for k in range(20):
            x = [rng.uniform(*end) * (1.0 if k == 0 else rng.uniform(0.0, 1.2)) for end in ends]
            run.append((time, x, [rng.uniform(-0.3, 0.3) for _ in range(passed)]))
            time += rng.choice([0.001, 0.25, 3.0])
        yield run


@pytest.mark.parametrize("kind", KINDS)
def test_both_printed_laws_have_the_bits_of_the_controller(kind, made):
    one = made(kind)
    control = script(render_control(one.law, one.provenance, NO_PLANT), "control_law")
    functions = None
    if kind != "single":
        module = script(render_casadi(one.law, one.provenance), "casadi_law")
        functions = getattr(module, f"{one.law.name}_start"), getattr(module, one.law.name)
    compared = 0
    for run in samples(one, kind, 12):
        controller, memory, known = one.module.Controller(), None, None
        for time, x, y_d in run:
            passed = () if not y_d else (y_d[0],) if len(y_d) == 1 else (tuple(y_d),)
            u = controller.step(time, x, *passed)
            if controller.status > 1:
                continue
            if known is None:
                known = control.first_sample(tuple(x), *passed)
            assert control.law(time, tuple(x), *passed, known) == u
            if functions is not None:
                given = [ca.DM(y_d)] if y_d else []
                memory = functions[0](x, *given) if memory is None else memory
                assert float(functions[1](time, x, *given, memory)) == u
            compared += 1
    assert compared > 120


def test_a_command_beyond_the_clamp_is_clamped_in_both(made):
    one = made("everyday")
    control = script(render_control(one.law, one.provenance, NO_PLANT), "control_law")
    module = script(render_casadi(one.law, one.provenance), "casadi_law")
    peak, known = one.module.Controller.U_MAX, control.first_sample((0.0, 0.0))
    for sign in (1.0, -1.0):
        far = (sign * 1e6, sign * 1e6)
        assert control.law(0.1, far, known) == -sign * peak
        assert float(getattr(module, one.law.name)(0.1, far, known)) == -sign * peak


def test_nan_is_passed_on_by_a_function_that_holds_nothing(made):
    one = made("everyday")
    module = script(render_casadi(one.law, one.provenance), "casadi_law")
    function = getattr(module, one.law.name)
    value = float(function(0.1, [float("nan"), 0.0], [0.0, 0.0]))
    assert value != value  # noqa: PLR0124


def test_a_law_in_binary32_is_refused_for_casadi_and_not_for_control(made):
    one = made("single")
    with pytest.raises(UsageError, match="binary32"):
        render_casadi(one.law, one.provenance)
    assert "def single(" in render_control(one.law, one.provenance, NO_PLANT)


@pytest.mark.parametrize("name", ["ca", "law", "ct"])
def test_a_plant_may_have_any_name(name, made):
    one = made("everyday")
    law = replace(one.law, name=name)
    module = script(render_casadi(law, one.provenance), "casadi_law")
    assert getattr(module, name).name() == name
    assert getattr(module, f"{name}_start").size1_out(0) == len(law.center.latched) + 1
    assert callable(script(render_control(law, one.provenance, NO_PLANT), "law").sampled)
