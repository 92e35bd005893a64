"""What an audit takes for the numbers that a file leaves open, and the file in its other form."""

from __future__ import annotations

import json

import pytest

from bfppc_synth.audit.completion import complete
from bfppc_synth.audit.judging import form_judge, holds
from bfppc_synth.audit.records import Origin
from bfppc_synth.audit.variants import open_keys, pinned, variant, without_absent_terms
from bfppc_synth.errors import NoDesignError
from bfppc_synth.model.spec import Form
from bfppc_synth.model.stages import Handover
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec

PLANT = """
name: open
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2}
initial: {x1: 1, x2: 0}
performance: {accuracy: 0.15}
"""
HEIGHTS = (
    "synthesis: {method: theorem1, FORM gains: {x1: {gamma: 4, H: [5], c: 0.1},"
    " x2: {gamma: 0.4, H: [10], c: 1.5}}, p: {x2: 3.1}, theorem1: {OPTIONS}}\n"
)
STAGED = """
synthesis:
  method: theorem3
  form: printed
  stages: [{p: {x1: 0.1, x2: 1}, gains: {x1: {k: 2}, x2: {k: 2}}}]
  gains: {x1: {k: 40}, x2: {k: 9000}}
"""


@pytest.fixture
def read(tmp_path):
    def load(text):
        path = tmp_path / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        return load_spec(path)

    return load


def quiet(message):
    del message


def gains(x1, x2, p=""):
    return PLANT + f"synthesis: {{gains: {{x1: {{{x1}}}, x2: {{{x2}}}}}{p}}}\n"


def test_a_file_without_synthesis_leaves_everything_open(read):
    terms = ("k", "M", "c", "epsilon")
    wanted = [f"synthesis.gains.x1.{term}" for term in terms]
    wanted += [f"synthesis.gains.x2.{term}" for term in terms]
    assert open_keys(read(PLANT)) == (*wanted, "synthesis.p.x2")


@pytest.mark.parametrize(
    ("x1", "zeros", "left"),
    [
        ("k: 40", ["M", "c"], []),
        ("M: 3, epsilon: 1", ["k", "c"], []),
        ("M: 3", ["k", "c"], ["epsilon"]),
        # A tanh is named by its epsilon; a term that is 0 names nothing.
        ("k: 2, epsilon: 0.5", ["c"], ["M"]),
        ("M: 0", [], ["k", "c"]),
        ("k: 1, M: 0, c: 0", [], []),
    ],
)
def test_terms_beside_those_that_a_step_names_are_0(read, x1, zeros, left):
    spec, paths = without_absent_terms(read(gains(x1, "k: 1, M: 0, c: 0", ", p: {x2: 1}")))
    assert list(paths) == [f"synthesis.gains.x1.{name}" for name in zeros]
    assert list(open_keys(spec)) == [f"synthesis.gains.x1.{name}" for name in left]
    given = spec.synthesis.gains[0]
    assert all(getattr(given, name).approximate == 0.0 for name in zeros)


def test_given_numbers_are_audited_as_they_are(read):
    found = complete(read(gains("k: 3", "k: 5", ", p: {x2: 0.5}")), quiet)
    assert found.origin is Origin.GIVEN
    assert found.filled == ()
    assert [gain.k for gain in found.candidate.gains] == [3.0, 5.0]
    assert found.candidate.half_widths == (0.15, 0.5)


def test_an_open_half_width_is_solved_for_where_one_does(read):
    spec = read(gains("k: 40", "k: 9000"))
    found = complete(spec, quiet)
    assert (found.origin, found.filled) == (Origin.SOLVED, ("synthesis.p.x2",))
    judge = form_judge(spec)
    judged = judge.judge(found.candidate)
    assert all(holds(demand, judge.relation(demand)) for demand in judged.demands)


def test_an_open_half_width_is_the_closest_where_none_does(read):
    spec = read(gains("k: 3", "k: 5"))
    found = complete(spec, quiet)
    assert (found.origin, found.filled) == (Origin.CLOSEST, ("synthesis.p.x2",))
    judge = form_judge(spec)

    def worst(p):
        widths = (0.15, p)
        demands = judge.judge(
            type(found.candidate)(gains=found.candidate.gains, half_widths=widths)
        ).demands
        return max((d.rhs - d.lhs) / max(abs(d.lhs), abs(d.rhs)) for d in demands)

    p = found.candidate.half_widths[1]
    assert worst(p) <= min(worst(p * 10.0**k) for k in range(-4, 5))
    assert worst(p) < min(worst(p * 1.1), worst(p / 1.1))


def test_open_gains_without_a_solution_are_named(read):
    with pytest.raises(NoDesignError, match=r"synthesis\.gains\.x2\.k"):
        complete(read(gains("k: 3", "M: 0") + "actuator: {limit: 0.1}\n"), quiet)


def test_the_printed_p_2_leaves_c_0_no_choice(read):
    quantized = PLANT + "measurement: {quantizer: {kind: uniform, step: 0.1}}\n"
    text = quantized + HEIGHTS.replace("FORM", "form: printed,")
    found = complete(read(text.replace("OPTIONS", "epsilon: {x2: 1}")), quiet)
    assert (found.origin, found.filled, found.candidate.c_0) == (Origin.GIVEN, (), 0.0)
    found = complete(read(text.replace("OPTIONS", "epsilon: {x2: 0.75}")), quiet)
    assert found.candidate.c_0 == pytest.approx(0.25, rel=1e-12)
    found = complete(read(text.replace("OPTIONS", "c_0: 0.2")), quiet)
    assert (found.origin, found.candidate.c_0) == (Origin.GIVEN, 0.2)


def test_the_sound_c_0_is_open_and_found(read):
    quantized = PLANT + "measurement: {quantizer: {kind: uniform, step: 0.1}}\n"
    text = quantized + HEIGHTS.replace("FORM", "").replace("OPTIONS", "H: constant")
    found = complete(read(text), quiet)
    assert (found.origin, found.filled) == (Origin.CLOSEST, ("synthesis.theorem1.c_0",))
    assert found.candidate.c_0 > 0.0


def test_a_pinned_file_leaves_nothing_open_and_keeps_what_it_gave(read):
    spec = read(gains("k: 40", "k: 9000"))
    found = complete(spec, quiet)
    fixed = pinned(spec, found.candidate)
    assert open_keys(fixed) == ()
    assert fixed.synthesis.gains[0].k is spec.synthesis.gains[0].k
    assert fixed.synthesis.p[0] is None
    assert fixed.synthesis.p[1].approximate == found.candidate.half_widths[1]
    assert fixed.document == spec.document


def test_the_other_form_is_in_the_document_too(read):
    text = gains("k: 40", "k: 9000").replace("synthesis: {", "synthesis: {method: theorem2, ")
    spec = read(text)
    assert variant(spec, Form.SOUND) is spec
    printed = variant(spec, Form.PRINTED)
    assert printed.synthesis.form is Form.PRINTED
    assert json.loads(plant_json(printed))["plant"]["synthesis"]["form"] == "printed"
    back = variant(printed, Form.SOUND)
    assert json.loads(plant_json(back))["plant"]["synthesis"]["form"] == "sound"
    assert back.synthesis.gains == spec.synthesis.gains


def test_the_sound_form_of_a_printed_switch_is_that_of_the_same_law(read):
    spec = read(PLANT + STAGED)
    assert spec.synthesis.handover is Handover.REANCHOR
    sound = variant(spec, Form.SOUND)
    assert sound.synthesis.handover is Handover.CONTAINMENT
    synthesis = json.loads(plant_json(sound))["plant"]["synthesis"]
    assert (synthesis["form"], synthesis["handover"]) == ("sound", "containment")
    again = read(PLANT + STAGED.replace("printed", "sound"))
    assert variant(again, Form.SOUND).synthesis.handover is Handover.REANCHOR
