"""A law in stages: C against Python bit by bit, and what latches, switches and gives up."""

from __future__ import annotations

import ctypes
import importlib.util
import math
import random
import shutil
import subprocess
from pathlib import Path

import pytest

from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

PLANT = (Path(__file__).parents[1] / "plants" / "switching.yaml").read_text(encoding="utf-8")
CONTAINED = ("method: theorem3", "method: theorem3\n  handover: containment")
NARROW = ("p: {x1: 0.04, x2: 1}", "p: {x1: 0.01, x2: 1}")
MORE = (
    "  stages:\n",
    "  stages:\n    - p: {x1: 0.03, x2: 0.8}\n      gains: {x1: {k: 2}, x2: {k: 1}}\n",
)
FADING = ("{kind: cosine, t_s: 1}", "{kind: exponential, rate: 0.5, floor: 0.1}")
PRINTED = ("method: theorem3", "method: theorem3\n  form: printed\n  p: {x2: 2}")
CASES = {
    "reanchor": (),
    "fading": (FADING,),
    "three": (MORE,),
    "containment": (CONTAINED, NARROW),
    "printed": (PRINTED,),
}
OK, OUTSIDE, BAD_INPUT = 0, 1, 2


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Design, Python class and C library of a case."""
    known = {}

    def make(case):
        if case not in known:
            text = PLANT
            for old, new in CASES[case]:
                assert old in text
                text = text.replace(old, new)
            folder = tmp_path_factory.mktemp(case)
            (folder / "plant.yaml").write_text(text, encoding="utf-8")
            design = synthesize(load_spec(folder / "plant.yaml"))
            law, provenance = build_law(design), make_provenance(design)
            for path, content in render_c(law, provenance).items():
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_text(content, encoding="utf-8")
            (folder / "controller.py").write_text(render_controller(law, provenance))
            known[case] = design, _class(folder, case), _library(folder)
        return known[case]

    return make


def _class(folder, case):
    found = importlib.util.spec_from_file_location(f"staged_{case}", folder / "controller.py")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module.Controller


def _library(folder):
    target = folder / "switching.so"
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
    command = [shutil.which("cc"), "-O2", *strict, "-ffp-contract=off", "-fPIC", "-shared"]
    source = folder / "c" / "src" / "switching.c"
    subprocess.run(
        [*command, f"-I{folder / 'c' / 'include'}", source, "-o", target, "-lm"], check=True
    )
    library = ctypes.CDLL(str(target))
    library.switching_reference.restype = ctypes.c_double
    library.switching_reference.argtypes = [ctypes.c_double]
    return library


class Native:
    """The C controller with the interface of the Python one."""

    def __init__(self, library):
        self._library = library
        self._state = ctypes.create_string_buffer(512)
        self.status = OK

    def step(self, t, x, y_d):
        u = ctypes.c_double()
        states = (ctypes.c_double * 2)(*x)
        self.status = self._library.switching_step(
            self._state, ctypes.c_double(t), states, ctypes.c_double(y_d), ctypes.byref(u)
        )
        return u.value

    @property
    def stage(self):
        return self._library.switching_stage(self._state)


def walk(seed, count=120):
    """Samples that start in the initial set and wander through every stage."""
    draw = random.Random(seed)  # noqa: S311 -- reproducible samples
    t, x = 3.0, [0.5, 2.0]
    for k in range(count):
        y_d = math.sin(t - 3.0)
        if k == 90 and seed % 3 == 0:
            yield t, [math.nan, 1e300], y_d
        yield t, list(x), y_d
        t += draw.choice((0.0, 1e-3, 0.07, 0.5))
        size = 10.0 ** draw.uniform(-3.0, -0.5)
        x = [math.sin(t - 3.0) + 0.3 + draw.uniform(-size, size), draw.uniform(-3.0, 3.0)]


@pytest.mark.parametrize("case", sorted(CASES))
def test_both_controllers_switch_at_the_same_samples_and_agree_in_every_bit(made, case):
    design, controller, library = made(case)
    reached = set()
    for seed in range(12):
        python, native = controller(), Native(library)
        for t, x, y_d in walk(seed):
            ours, theirs = python.step(t, x, y_d), native.step(t, x, y_d)
            assert ours.hex() == theirs.hex()
            assert (int(python.status), python.stage) == (native.status, native.stage)
        reached.add(python.stage)
    assert len(design.stages) + 1 in reached


@pytest.mark.parametrize("case", ["reanchor", "containment"])
def test_a_stage_is_left_outside_its_half_widths_only_and_never_entered_again(made, case):
    design, controller, _ = made(case)
    (stage,) = design.stages
    for share, expected in ((0.999, 1), (1.001, 2)):
        law = controller()
        law.step(0.0, (0.5, 2.0))
        assert law.stage == 1
        law.step(0.0, (0.5, 2.0 + share * stage.omega[1]))
        assert law.stage == expected
        law.step(0.0, (0.5, 2.0))
        assert law.stage == expected
        law.reset()
        assert law.stage == 1


def test_a_reanchored_switch_begins_with_no_error_and_no_command(made):
    design, controller, _ = made("reanchor")
    law = controller()
    law.step(0.0, (0.5, 2.0))
    assert law.step(0.0, (0.5, 2.0 + design.stages[0].widened[1])) == 0.0
    assert law.status == OK
    # From now on x_2 fades from where it was measured.
    assert law.step(0.0, (0.5, 2.0 + design.stages[0].widened[1])) == 0.0


def test_a_handover_from_beyond_the_widened_tube_is_outside_for_the_whole_run(made):
    design, controller, library = made("reanchor")
    for law in (controller(), Native(library)):
        law.step(0.0, (0.5, 2.0), 0.0)
        law.step(0.0, (0.5, 2.0 + 1.01 * design.stages[0].measured_limits[1]), 0.0)
        assert law.stage == 2
        assert law.status == OUTSIDE
        law.step(0.0, (0.5, 2.0 + 1.01 * design.stages[0].measured_limits[1]), 0.0)
        assert law.status == OUTSIDE


def test_leaving_the_last_stage_is_a_fault_and_its_law_stays(made):
    design, controller, _ = made("reanchor")
    law = controller()
    law.step(0.0, (0.5, 2.0))
    law.step(0.0, (0.5, 2.0 + design.stages[0].widened[1]))
    law.step(0.0, (0.5, 2.0 + 1.5 + 1.1 * design.omega[1]))
    assert (law.stage, law.status) == (2, OUTSIDE)
    law.step(0.0, (0.5, 3.0))
    assert (law.stage, law.status) == (2, OK)


def test_three_stages_never_cascade_where_every_switch_takes_a_new_center(made):
    design, controller, _ = made("three")
    law = controller()
    law.step(0.0, (0.5, 2.0))
    law.step(0.0, (0.5, 2.0 + 1.0000005 * design.stages[0].omega[1]))
    assert law.stage == 2


def test_a_sample_that_is_refused_switches_nothing(made):
    _, controller, library = made("reanchor")
    for law in (controller(), Native(library)):
        law.step(0.0, (0.5, 2.0), 0.0)
        law.step(0.0, (math.nan, 2.0), 0.0)
        assert (law.status, law.stage) == (BAD_INPUT, 1)
