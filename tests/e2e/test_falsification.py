"""Random adversaries against what is committed in generated/: the certificate tried in practice."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.simulation.loop import coverage, load_controller, simulate_adversaries
from bfppc_synth.simulation.scheme import Coverage
from bfppc_synth.synthesis.synthesize import restore

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(
    path.stem for path in (ROOT / "examples").glob("*.yaml") if not path.stem.endswith("_printed")
)
PAPER = ("paper_example_1", "paper_example_2")

# A quantized law proved for continuous time is simulated in steps that nothing is proved of.
COVERAGE = {"theorem1_example_1": Coverage.NOT_COVERED}

# Not the seed of the plant files: these adversaries have never been met before.
SEED = 7919


@cache
def committed(name):
    """Read a committed design, with adversaries of another seed."""
    design = restore(ROOT / "generated" / name)
    simulation = replace(design.spec.simulation, seed=SEED)
    return replace(design, spec=replace(design.spec, simulation=simulation))


def worst(runs, half_widths):
    """Return the largest |e_i| / p_i over all runs and errors."""
    return max(e / p for run in runs for e, p in zip(run.max_abs_e, half_widths, strict=True))


def weaken(design, factor):
    """Scale k, M and c of every step; the tube stays."""
    gains = tuple(
        replace(shape, k=shape.k * factor, M=shape.M * factor, c=shape.c * factor)
        for shape in design.gains
    )
    return replace(design, gains=gains)


@pytest.mark.parametrize("name", EXAMPLES)
def test_random_adversaries_never_leave_the_tube(name):
    design = committed(name)
    controller = load_controller(ROOT / "generated" / name / "controller.py")
    runs = simulate_adversaries(design, controller, runs=10)
    assert coverage(design) is COVERAGE.get(name, Coverage.COVERED)
    assert [run for run in runs if not run.within_bounds] == []
    # They do try: an adversary that moved nothing would prove nothing.
    assert worst(runs, design.omega) > 0.05


@pytest.mark.parametrize("name", PAPER)
def test_weakened_gains_lose_the_tube(name, tmp_path, capsys, request):
    design = committed(name)
    path = tmp_path / "controller.py"
    lost = None
    for factor in (0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1):
        weak = weaken(design, factor)
        path.write_text(render_controller(build_law(weak), make_provenance(weak)))
        runs = simulate_adversaries(weak, load_controller(path), runs=5)
        if not all(run.within_bounds for run in runs):
            lost = factor
            break
    assert lost is not None
    assert worst(runs, design.omega) > 1.0
    terminal = request.config.pluginmanager.get_plugin("terminalreporter")
    with capsys.disabled():
        terminal.write_line(f"{name}: the tube is lost with gains weakened to {lost} of certified")
