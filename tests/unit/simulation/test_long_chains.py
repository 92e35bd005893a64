"""Runs of laws with gains of many powers of ten: what is tried is not taken for the answer."""

from __future__ import annotations

import pytest

from bfppc_synth.artifacts import simulate_trajectory
from bfppc_synth.simulation.recorder import Recorder
from bfppc_synth.simulation.tracking import Start, Tracking
from bfppc_synth.spec.load import load_text
from bfppc_synth.synthesis.synthesize import synthesize

CHAIN = """\
name: chain_8
states: [x1, x2, x3, x4, x5, x6, x7, x8]
dynamics:
  x1: {f: 0.2*sin(x1)}
  x2: {f: 0.1*x1*x2}
  x3: {f: 0.2*sin(x3) + 0.1*x1*x3}
  x4: {f: 0.2*sin(x4) + 0.1*x1*x4}
  x5: {f: 0.2*sin(x5) + 0.1*x1*x5}
  x6: {f: 0.2*sin(x6) + 0.1*x1*x6}
  x7: {f: 0.2*sin(x7) + 0.1*x1*x7}
  x8: {f: 0.2*sin(x8) + 0.1*x1*x8}
initial: {x1: 0.1, x2: 0, x3: 0, x4: 0, x5: 0, x6: 0, x7: 0, x8: 0}
performance: {accuracy: 0.2}
synthesis: {center: performance, objective: peak-input}
simulation: {horizon: 0.2, period: 0.002}
"""


@pytest.fixture(scope="module")
def design():
    return synthesize(load_text(CHAIN, "chain_8.yaml"))


def test_a_step_of_a_steep_law_stays_in_the_tube(design):
    design.certificate.require()
    run = simulate_trajectory(design)
    assert run.within_bounds
    assert 0.0 < run.max_abs_u <= design.bounds.U


def test_a_state_is_lost_by_what_its_tube_allows(design):
    zero = (0.0,) * 8
    tracking = Tracking(design, Start(true=zero, measured=zero, reference=0.0))
    for sizes, alive in (((), False), ((1e14,) * 8, True), ((1e-6,) * 8, False)):
        recorder = Recorder(0.1, tracking, lambda _t: 0.0, stride=1, sizes=sizes)
        recorder.rows.append(((1e13,) * 8, zero, 0.0, 0))
        assert recorder.flush() is alive
