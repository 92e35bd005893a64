"""The number that decides an inequality, and the value of it that would do."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from bfppc_synth.audit.completion import complete
from bfppc_synth.audit.judging import form_judge, holds
from bfppc_synth.audit.remedies import _nearest, c_0_path, knobs, remedies
from bfppc_synth.spec.load import load_spec

PLANT = """
name: remedied
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2}
initial: {x1: 1, x2: 0}
performance: {accuracy: 0.15}
measurement: {quantizer: {kind: uniform, step: STEP}}
sampling: {period: PERIOD}
synthesis: {gains: {x1: {X1}, x2: {X2}}, p: {x2: 2}}
"""


@pytest.fixture
def audited(tmp_path):
    """Judge, candidate, what it judges, and the file."""

    def make(x1, x2, step="0.001", period="0"):
        path = tmp_path / "plant.yaml"
        text = PLANT.replace("X1", x1).replace("X2", x2).replace("STEP", step)
        path.write_text(text.replace("PERIOD", period), encoding="utf-8")
        spec = load_spec(path)
        candidate = complete(spec, lambda _message: None).candidate
        judge = form_judge(spec)
        return judge, candidate, judge.judge(candidate), spec

    return make


def demand_of(judged, name, step):
    return next(d for d in judged.demands if (d.name, d.step) == (name, step))


@pytest.mark.parametrize(
    ("have", "least", "need"),
    [(4.0, 24.4, 24.4), (30.0, 24.4, 24.4), (0.0, 24.4, 24.4), (1e-9, 24.4, 24.4)],
)
def test_a_lower_limit_is_found_from_either_side(have, least, need):
    found = _nearest(lambda value: value >= least, have, 1.0)
    assert found >= least
    assert found == pytest.approx(need, rel=1e-8)


def test_an_upper_limit_is_found_from_above():
    found = _nearest(lambda value: value <= 0.7, 5.0, 1.0)
    assert found <= 0.7
    assert found == pytest.approx(0.7, rel=1e-8)


def test_of_a_limit_on_either_side_the_nearer_one_is_named():
    assert _nearest(lambda v: v <= 1.0 or v >= 100.0, 2.0, 1.0) == pytest.approx(1.0)
    assert _nearest(lambda v: v <= 1.0 or v >= 100.0, 50.0, 1.0) == pytest.approx(100.0)


def test_what_any_value_meets_needs_none_and_what_none_meets_has_none():
    assert _nearest(lambda _value: True, 3.0, 1.0) == 0.0
    assert _nearest(lambda value: value > 0.0, 3.0, 1.0) == 0.0
    assert _nearest(lambda _value: False, 3.0, 1.0) is None
    assert _nearest(lambda value: value == 0.0, 3.0, 1.0) == 0.0


@pytest.mark.parametrize(
    ("gain", "symbol"),
    [("k: 3, M: 0.1, epsilon: 1", "k_1"), ("k: 0.1, M: 2, epsilon: 1", "M_1"), ("c: 9", "c_1")],
)
def test_the_term_that_does_most_is_named(audited, gain, symbol):
    judge, candidate, judged, spec = audited(gain, "k: 500")
    demand = demand_of(judged, "U1", 0)
    assert knobs(candidate, demand, spec)[0].symbol == symbol
    remedy = remedies(judge, candidate, judged, demand, spec)[0]
    assert remedy.path == f"synthesis.gains.x1.{symbol[0]}"
    better = replace(candidate.gains[0], **{symbol[0]: remedy.need * (1 + 1e-8)})
    worse = replace(candidate.gains[0], **{symbol[0]: remedy.need * (1 - 1e-6)})
    for gain_1, met in ((better, True), (worse, False)):
        turned = judge.judge(replace(candidate, gains=(gain_1, candidate.gains[1])))
        assert holds(demand_of(turned, "U1", 0), ">") is met


def test_a_gain_that_cannot_do_it_alone_is_followed_by_the_half_width(audited):
    # phi_1 grows with p_1 and the load hardly does: a wider tube does what no gain 0 can.
    judge, candidate, judged, spec = audited("k: 30", "k: 9000", step="0.2")
    demand = demand_of(judged, "U0", 0)
    assert holds(demand, ">")
    judge, candidate, judged, spec = audited("k: 30", "k: 9000", step="0.25")
    demand = demand_of(judged, "U0", 1)
    assert not holds(demand, ">")
    (remedy,) = remedies(judge, candidate, judged, demand, spec)
    assert (remedy.symbol, remedy.path) == ("p_2", "synthesis.p.x2")
    assert remedy.need == pytest.approx(demand.rhs, rel=1e-6)


def test_sampling_that_no_gain_can_make_up_for_has_no_remedy(audited):
    judge, candidate, judged, spec = audited("k: 40", "k: 9000", period="0.1")
    found = next(d for d in judged.demands if d.name.startswith("U2") and d.name[-4:] == "room")
    assert not holds(found, ">")
    assert all(r.need is None for r in remedies(judge, candidate, judged, found, spec))


def test_c_0_stands_where_the_file_decides_it(tmp_path):
    text = PLANT.replace("STEP", "0.1").replace("PERIOD", "0")
    head = text[: text.index("synthesis:")]
    gains = "gains: {x1: {gamma: 4, H: [5], c: 0}, x2: {gamma: 1, H: [9], c: 0}}, p: {x2: 3}"
    places = {}
    for options in ("epsilon: {x2: 1}", "c_0: 0.1, epsilon: {x2: 1}", "H: constant"):
        path = tmp_path / "plant.yaml"
        body = f"synthesis: {{method: theorem1, {gains}, theorem1: {{{options}}}}}\n"
        path.write_text(head + body, encoding="utf-8")
        places[options] = c_0_path(load_spec(path))
    assert list(places.values()) == [
        "synthesis.p.x2", "synthesis.theorem1.c_0", "synthesis.theorem1.c_0",
    ]  # fmt: skip


def test_a_number_that_is_not_finite_meets_nothing():
    assert _nearest(lambda value: math.isfinite(value) and value > 1e40, 1.0, 1.0) is None
