"""Portable arithmetic with center nominal: C and Python give the same bits, in both types."""

from __future__ import annotations

import ctypes
import importlib.util
import struct
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.portable import CALLS, require_portable
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.errors import UsageError
from bfppc_synth.model.arithmetic import Arithmetic, Mathematics, Real
from bfppc_synth.model.law import Literal, Operator, Statement, Variable
from bfppc_synth.synthesis.synthesize import restore

if TYPE_CHECKING:
    from types import ModuleType

    from bfppc_synth.model.law import Law, Provenance

ROOT = Path(__file__).parents[2]
FLAGS = ["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wconversion", "-Werror"]


def load(path: Path, name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


nominal = load(ROOT / "tests" / "unit" / "codegen" / "handmade_nominal.py", "nominal_of_portable")


def portable(name: str, real: Real) -> Law:
    arithmetic = Arithmetic(real=real, mathematics=Mathematics.PORTABLE)
    return build_law(replace(nominal.DESIGNS[name](), arithmetic=arithmetic))


def write(law: Law, provenance: Provenance, folder: Path) -> None:
    files = {"controller.py": render_controller(law, provenance), **render_c(law, provenance)}
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)


class Native:
    """The C controller, called with numbers of its own type."""

    def __init__(self, folder: Path, law: Law) -> None:
        library = folder / "controller.so"
        source = f"c/src/{law.name}.c"
        command = ["gcc", *FLAGS, "-shared", "-fPIC", "-Ic/include", source, "-o", str(library)]
        subprocess.run(command, cwd=folder, check=True, timeout=60)
        self._real = ctypes.c_float if law.arithmetic.single else ctypes.c_double
        self._library, self._name = ctypes.CDLL(str(library)), law.name
        self._step = getattr(self._library, f"{law.name}_step")
        self._state = ctypes.create_string_buffer(4096)
        self._passed = len(law.derivatives)

    def step(self, t: float, x: list[float], y_d: list[float]) -> tuple[float, int]:
        u = self._real(0.0)
        given = (self._real * self._passed)(*y_d) if self._passed else self._real(y_d[0])
        status = self._step(
            self._state, self._real(t), (self._real * len(x))(*x), given, ctypes.byref(u)
        )
        return u.value, status

    def stage(self) -> int:
        return getattr(self._library, f"{self._name}_stage")(self._state)


@pytest.mark.parametrize("real", list(Real))
@pytest.mark.parametrize("name", ["integrator", "pendulum", "supplied", "joint"])
def test_c_and_python_agree_in_every_bit(name: str, real: Real, tmp_path: Path) -> None:
    law = portable(name, real)
    write(law, make_provenance(nominal.DESIGNS[name]()), tmp_path)
    native, module = Native(tmp_path, law), load(tmp_path / "controller.py", f"{name}_{real}")
    controller, random = module.Controller(), np.random.default_rng(4)
    limits = [getattr(module, f"x_limit_{i + 1}") for i in range(law.order)]
    bounds = [getattr(module, test.upper) for test in law.reference_ranges]
    begins = [
        [getattr(module, f"start_{side}_{i + 1}") for i in range(law.order)]
        for side in ("lower", "upper")
    ]
    statuses, commands = set(), set()
    for k in range(300):
        t = 0.02 * k
        x = (0.05 * random.normal(size=law.order) * limits).tolist()
        if k == 0:
            x = random.uniform(*begins).tolist()
        y_d = (random.uniform(-0.9, 0.9, len(bounds)) * bounds).tolist()
        passed = y_d if len(bounds) > 1 else y_d[0]
        u, (theirs, status) = controller.step(t, x, passed), native.step(t, x, y_d)
        assert struct.pack("d", u) == struct.pack("d", theirs), (k, u, theirs)
        assert status == controller.status
        statuses.add(status)
        commands.add(u)
    assert statuses & {0, 1}
    assert len(commands) > 20


@pytest.mark.parametrize("real", list(Real))
def test_laws_in_stages_agree_in_every_bit_over_a_switch(real: Real, tmp_path: Path) -> None:
    arithmetic = Arithmetic(real=real, mathematics=Mathematics.PORTABLE)
    design = replace(restore(ROOT / "generated" / "switching_example_2"), arithmetic=arithmetic)
    law = build_law(design)
    write(law, make_provenance(design), tmp_path)
    native, module = Native(tmp_path, law), load(tmp_path / "controller.py", f"stages_{real}")
    random = np.random.default_rng(5)
    stages = set()
    for _ in range(6):
        controller, native = module.Controller(), Native(tmp_path, law)
        start = np.array([0.5, 2.0])
        for k in range(60):
            t = 0.001 * k
            x = (start + k * np.array([0.01, -0.05]) + 0.02 * random.normal(size=2)).tolist()
            y_d = module.Controller.reference(t)
            u, (theirs, status) = controller.step(t, x, y_d), native.step(t, x, [y_d])
            assert struct.pack("d", u) == struct.pack("d", theirs), (k, u, theirs)
            assert (status, native.stage()) == (controller.status, controller.stage)
            stages.add(controller.stage)
    assert stages == {1, 2}


@pytest.mark.parametrize("function", ["log", "tan", "atan", "sinh", "cosh", "asinh", "sqrt", "pow"])
def test_a_function_without_a_portable_form_is_named_with_its_place(function: str) -> None:
    operands = (Variable(name="t"), Literal(value=1.5))[: 1 + (function == "pow")]
    foreign = Statement(target="y", operator=Operator(function), operands=operands)
    with pytest.raises(UsageError, match=f"{function} in dynamics.x1.f has no portable form"):
        require_portable([("dynamics.x1.f", (foreign,))])


def test_the_four_functions_and_plain_operations_have_a_portable_form() -> None:
    operators = [o for o in Operator if o in CALLS or o.value in {"+", "-", "*", "/", "neg", "abs"}]
    assert len(operators) == 10
    one = Variable(name="t")
    program = [Statement(target="y", operator=o, operands=(one, one)) for o in operators]
    assert require_portable([("here", program)]) is None
