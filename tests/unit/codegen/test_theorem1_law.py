"""Theorem 1's controller: gamma H(rho) e + c e^N, in Python and in C, bit for bit."""

from __future__ import annotations

import math
import shutil
import subprocess
from dataclasses import replace

import pytest

from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.model.shapes import Theorem1Gain

CONSTANT = (
    Theorem1Gain(gamma=4.3, H=(5.1,), H_star=5.0, c=0.1, N=3),
    Theorem1Gain(gamma=0.4, H=(10.7,), H_star=10.0, c=0.0, N=5),
)
SCHEDULED = (
    Theorem1Gain(gamma=4.3, H=(5.1, 0.7, 0.3), H_star=5.0, c=0.1, N=3),
    Theorem1Gain(gamma=0.4, H=(10.7, 2.3), H_star=10.0, c=0.0, N=5),
)


def design_of(handmade, gains):
    return replace(handmade.everyday(), gains=gains)


def test_the_constants_are_gamma_h_c_n_and_p(handmade):
    law = build_law(design_of(handmade, SCHEDULED))
    assert [constant.name for constant in law.certified] == [
        "gamma_1", "H_1_0", "H_1_1", "H_1_2", "c_1", "N_1", "p_1",
        "gamma_2", "H_2_0", "H_2_1", "c_2", "N_2", "p_2", "U_MAX",
    ]  # fmt: skip
    assert [c.name for c in law.certified if not c.used] == ["N_1", "c_2", "N_2"]
    assert "rho" in law.formula
    assert "rho" not in build_law(design_of(handmade, CONSTANT)).formula


def test_a_constant_height_is_read_and_rho_is_not(handmade):
    law = build_law(design_of(handmade, CONSTANT))
    read = {o.name for s in law.feedback for o in s.operands if hasattr(o, "name")}
    assert {"gamma_1", "H_1_0", "c_1", "gamma_2", "H_2_0"} <= read
    assert not {"rho", "c_2", "k_1"} & read


@pytest.mark.parametrize("gains", [CONSTANT, SCHEDULED])
@pytest.mark.parametrize("t", [0.0, 0.4, 2.9, 3.5])
def test_python_computes_the_formula_in_the_order_of_the_record(handmade, module_of, gains, t):
    design = design_of(handmade, gains)
    module = module_of(design)
    controller = module.Controller()
    first = [0.5 * (low + high) for low, high in starts(module, design)]
    controller.step(0.0, first, 0.0)
    x = [value + 0.01 for value in first]
    u = controller.step(t, x, 0.0)
    rho = 0.5 * (1.0 + math.cos(t)) if t < math.pi else 0.0
    e_1 = x[0] - (0.0 + rho * first[0])
    slopes = [gain.gamma * gain.height(rho) for gain in gains]
    e_2 = (x[1] - rho * first[1]) + (slopes[0] * e_1 + gains[0].c * (e_1 * (e_1 * e_1)))
    assert u == pytest.approx(max(-module.U_MAX, min(module.U_MAX, -slopes[1] * e_2)), rel=1e-15)


def starts(module, design):
    return [
        (getattr(module, f"start_lower_{i}"), getattr(module, f"start_upper_{i}"))
        for i in range(1, len(design.gains) + 1)
    ]


MAIN = """
#include <stdio.h>
#include "NAME.h"
int main(void)
{
    static NAME_state s;
    double t, x[2], u;
    while (scanf("%lf %lf %lf", &t, &x[0], &x[1]) == 3) {
        NAME_step(&s, t, x, 0.0, &u);
        printf("%a\\n", u);
    }
    return 0;
}
"""


@pytest.mark.parametrize("gains", [CONSTANT, SCHEDULED])
def test_c_and_python_agree_in_every_bit(handmade, module_of, tmp_path, gains):
    design = design_of(handmade, gains)
    module = module_of(design)
    name = design.spec.name
    for path, text in render_c(build_law(design), make_provenance(design)).items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    (tmp_path / "main.c").write_text(MAIN.replace("NAME", name))
    compiler = shutil.which("gcc") or "cc"
    build = [compiler, "-O2", "-std=c99", "-ffp-contract=off", "-I", "c/include"]
    sources = ["main.c", f"c/src/{name}.c"]
    subprocess.run([*build, *sources, "-o", "run", "-lm"], cwd=tmp_path, check=True, timeout=60)
    first = [0.5 * (low + high) for low, high in starts(module, design)]
    samples = [
        (0.05 * k, first[0] * math.cos(k) + 0.01 * k, first[1] + 0.02 * math.sin(k))
        for k in range(80)
    ]
    lines = "\n".join(" ".join(repr(value) for value in sample) for sample in samples)
    done = subprocess.run(
        [str(tmp_path / "run")], input=lines, capture_output=True, text=True, check=True, timeout=60
    )
    controller = module.Controller()
    expected = [controller.step(t, x, 0.0).hex() for t, *x in samples]
    assert [float.fromhex(line).hex() for line in done.stdout.split()] == expected
    assert len(set(expected)) > 40
