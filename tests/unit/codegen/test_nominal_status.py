"""Center nominal at the door: what is screened, latched and told, in Python, C and the texts."""

from __future__ import annotations

import importlib.util
import math
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller

NAN, INF = math.nan, math.inf
OK, OUTSIDE, BAD_INPUT, BAD_TIME = range(4)
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Wundef", "-Wvla"]
WARNINGS += ["-Wfloat-conversion", "-Wcast-qual", "-Wdouble-promotion", "-Werror", "-Iinclude"]
C99 = ["gcc", "-std=c99", "-Wmissing-prototypes", "-Wstrict-prototypes"]
CPP = ["g++", "-x", "c++", "-std=c++11"]
SUPPLIED = (0.2, 0.1, -0.1, 0.3)


def _designs():
    path = Path(__file__).with_name("handmade_nominal.py")
    spec = importlib.util.spec_from_file_location("handmade_nominal", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


nominal = _designs()
NAMES = sorted(nominal.DESIGNS)


def texts(design):
    law, provenance = build_law(design), make_provenance(design)
    return {"controller.py": render_controller(law, provenance), **render_c(law, provenance)}


def write(design, folder):
    for path, text in texts(design).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)


@pytest.fixture
def compiled_in(module_of):
    return module_of(nominal.pendulum())


@pytest.fixture
def supplied(module_of):
    return module_of(nominal.supplied())


def test_a_passed_reference_is_screened_and_not_used(compiled_in):
    ours, other = compiled_in.Controller(), compiled_in.Controller()
    for t in (0.0, 0.4, 3.0):
        x = [0.3 * math.cos(t), 0.1]
        u = ours.step(t, x)
        assert other.step(t, x, 0.9) == u
        assert u != 0.0
    limit = compiled_in.y_d_limit
    assert limit == pytest.approx(1.01)
    for y_d, wanted in ((limit, OK), (math.nextafter(limit, INF), BAD_INPUT), (NAN, BAD_INPUT)):
        ours.step(3.0, [-0.2, 0.1], y_d)
        assert (ours.status == BAD_INPUT) == (wanted == BAD_INPUT)


def test_every_passed_derivative_is_screened_by_its_own_bound(supplied):
    names = ["y_d_limit", "y_d_limit_1", "y_d_limit_2", "y_d_limit_3"]
    limits = [getattr(supplied, name) for name in names]
    bounds = (0.5, 0.6, 0.7, 0.9)
    assert limits == pytest.approx([1.01 * bound for bound in bounds], rel=1e-8)
    assert all(limit > 1.01 * bound for limit, bound in zip(limits, bounds, strict=True))
    for k, limit in enumerate(limits):
        for sign in (1.0, -1.0):
            controller = supplied.Controller()
            passed = [0.0] * 4
            for value, refused in ((limit, False), (math.nextafter(limit, INF), True)):
                passed[k] = sign * value
                controller.step(0.0, [0.1, 0.0, 0.0], passed)
                assert (controller.status == BAD_INPUT) == refused
            for bad in (NAN, INF, -INF):
                passed[k] = bad
                controller.step(0.0, [0.1, 0.0, 0.0], passed)
                assert controller.status == BAD_INPUT


def test_a_reference_without_its_derivatives_is_no_reference(supplied):
    controller = supplied.Controller()
    assert controller.step(0.0, [0.1, 0.0, 0.0]) == 0.0
    assert controller.status == BAD_INPUT
    with pytest.raises(ValueError, match="unpack"):
        controller.step(0.0, [0.1, 0.0, 0.0], SUPPLIED[:3])


def test_a_refused_first_sample_latches_nothing(supplied, compiled_in):
    for module, reference in ((supplied, SUPPLIED), (compiled_in, None)):
        spoiled, fresh = module.Controller(), module.Controller()
        x = [0.1] * module.Controller.ORDER
        spoiled.step(-5.0, [INF, *x[1:]], reference)
        spoiled.step(-5.0, x, (NAN,) * 4 if reference else NAN)
        spoiled.step(INF, x, reference)
        for t in (0.0, 0.1):
            assert spoiled.step(t, x, reference) == fresh.step(t, x, reference)
            assert fresh.status != BAD_INPUT


def test_a_reset_in_flight_begins_anew(compiled_in, supplied):
    for module, reference in ((supplied, SUPPLIED), (compiled_in, None)):
        used, fresh = module.Controller(), module.Controller()
        order = module.Controller.ORDER
        for t in (0.0, 0.3, 0.6):
            used.step(t, [0.4] * order, reference)
        before = used.step(1.0, [-0.2] * order, reference)
        used.reset()
        restarted = used.step(1.0, [-0.2] * order, reference)
        assert restarted == fresh.step(1.0, [-0.2] * order, reference)
        assert restarted != before
        assert used.status == OK
        x = [-0.15] * order
        assert used.step(1.25, x, reference) == fresh.step(1.25, x, reference)


def test_time_is_told_as_before(compiled_in):
    controller = compiled_in.Controller()
    held = controller.step(7.0, [0.5, 0.1])
    for t in (6.9, 7.0 + 1.1e6, 2.0**40):
        assert controller.step(t, [0.5, 0.1]) == held
        assert controller.status == BAD_TIME
    controller.step(7.0, [0.5, 0.1])
    assert controller.status == OK
    controller.step(7.0 + 9.9e5, [0.0, 0.0])
    assert controller.status in (OK, OUTSIDE)


@pytest.mark.parametrize("index", [0, 1])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_first_sample_outside_the_initial_set_is_outside_for_the_whole_run(
    compiled_in, index, sign
):
    end = getattr(compiled_in, f"start_upper_{index + 1}")
    for value, wanted in ((end, OK), (math.nextafter(end, INF), OUTSIDE)):
        controller = compiled_in.Controller()
        x = [0.0, 0.0]
        x[index] = sign * value
        controller.step(0.0, x)
        assert controller.status == wanted
        # On the center itself, so that no tube is left.
        controller.step(1e-9, x)
        assert controller.status == wanted


def test_a_first_reference_beyond_the_declared_offset_is_outside(supplied):
    assert supplied.offset_limit == pytest.approx(0.52, abs=1e-9)
    for gap, wanted in ((0.519, OK), (0.521, OUTSIDE)):
        controller = supplied.Controller()
        controller.step(0.0, [0.2 + gap, 0.0, 0.0], (0.2, 0.0, 0.0, 0.0))
        assert controller.status == wanted


def test_an_error_outside_its_tube_is_outside_while_it_lasts(compiled_in):
    controller = compiled_in.Controller()
    controller.step(0.0, [0.5, 0.1])
    controller.step(0.0, [0.5, 0.1 + 1.01 * compiled_in.tube_2])
    assert controller.status == OUTSIDE
    controller.step(0.0, [0.5, 0.1])
    assert controller.status == OK


def test_a_command_held_because_the_feedforward_has_no_value_is_not_ok(module_of):
    design = nominal.integrator()
    late = replace(design, plant=replace(design.plant, reference=1 / sp.cosh(nominal.T)))
    controller = module_of(late).Controller()
    held = [controller.step(t, [y]) for t, y in ((0.0, 1.0), (2.0, 0.3), (700.0, 0.2))]
    assert controller.status == OK
    # Here cosh is infinite and its reciprocal 0, but the derivative is infinity times 0.
    assert controller.step(720.0, [0.1]) == held[-1]
    assert controller.status == OUTSIDE


def test_a_start_whose_center_is_no_number_commands_nothing(module_of):
    module = module_of(nominal.vanishing())
    # g^_1 vanishes at 4, and e^(3 x_1) is infinite at 300.
    for x_1 in (4.0, 300.0):
        controller = module.Controller()
        assert abs(controller.step(0.0, [x_1, 0.1])) <= controller.U_MAX
        assert controller.status == OUTSIDE
    assert controller.step(0.5, [0.0, 0.0]) == 0.0


@pytest.mark.parametrize("compiler", [C99, CPP], ids=["c99", "c++11"])
@pytest.mark.parametrize("name", NAMES)
def test_the_compiler_has_nothing_to_say(tmp_path, name, compiler):
    write(nominal.DESIGNS[name](), tmp_path)
    for source in (f"src/{name}.c", "example/main.c"):
        command = [*compiler, "-O2", *WARNINGS, "-ffp-contract=off", "-c", source, "-o", "out.o"]
        done = subprocess.run(
            command, cwd=tmp_path / "c", capture_output=True, text=True, check=False, timeout=60
        )
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("name", ["pendulum", "supplied"])
def test_the_example_runs(tmp_path, name):
    write(nominal.DESIGNS[name](), tmp_path)
    done = subprocess.run(
        ["make", "--silent", "run"],
        cwd=tmp_path / "c",
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("  OK\n") == 5


def test_the_c_code_has_neither_loops_nor_arrays_of_its_own():
    for name, make in nominal.DESIGNS.items():
        source = texts(make())[f"c/src/{name}.c"]
        for word in ("for (", "while (", "malloc", "goto"):
            assert word not in source
        assert not re.search(r"_real \w+\[\d", source)


def test_the_texts_say_what_y_d_is():
    passed = texts(nominal.supplied())
    for path in ("controller.py", "c/include/supplied.h", "c/README.md"):
        assert "exact derivatives of order 1 to 3" in passed[path], path
    assert "y_d[supplied_ORDER + 1]" in passed["c/include/supplied.h"]
    compiled = texts(nominal.pendulum())
    for path in ("controller.py", "c/include/pendulum.h", "c/README.md"):
        assert "screened and not used" in compiled[path], path
    assert "pendulum_real y_d," in compiled["c/include/pendulum.h"]


def test_the_readme_tells_how_long_the_transition_takes():
    design = nominal.pendulum()
    readme = " ".join(texts(design)["c/README.md"].split())
    assert "to the reference in 2.0 s; after `pendulum_reset`" in readme
    slower = replace(design, nominal=replace(design.nominal, transition=7.5))
    assert "to the reference in 7.5 s" in " ".join(texts(slower)["c/README.md"].split())


def test_equal_designs_give_equal_bytes():
    for make in nominal.DESIGNS.values():
        assert texts(make()) == texts(make())
