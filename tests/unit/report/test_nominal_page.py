"""Center nominal in report.json, on the page and in the README."""

from __future__ import annotations

import dataclasses
import json
import re

import numpy as np
import pytest
import sympy as sp

from bfppc_synth.model.nominal import NominalModel, NominalSplit
from bfppc_synth.model.spec import CenterKind, ReferenceKind
from bfppc_synth.report.derivation import derivation
from bfppc_synth.report.figures import draw
from bfppc_synth.report.nominal_page import center_texts, splits
from bfppc_synth.report.numbers import shown
from bfppc_synth.report.obligations import obligation, term_sentence
from bfppc_synth.report.render import render_html, render_readme
from bfppc_synth.report.sentences import performance_sentences, promise, reference_sentence
from bfppc_synth.report.summary import summary
from bfppc_synth.report.tables import report_document

TRANSITION = 0.625
NUMBER = re.compile(r'data-json-path="([^"]+)" data-value="([^"]+)">([^<]*)<')


def with_center(design):
    """The hand-made design around a center that a model of it follows."""
    spec, order = design.spec, design.spec.order
    synthesis = dataclasses.replace(spec.synthesis, center=CenterKind.NOMINAL)
    states = design.plant.states
    rough = sp.Abs(states[0]) / 10
    sources = tuple(
        (("model error along the center", 1.25 + i), (f"deviation of x{i + 1}", 0.75))
        for i in range(order)
    )
    W = tuple(sum(size for _, size in each) for each in sources)
    return dataclasses.replace(
        design,
        spec=dataclasses.replace(spec, synthesis=synthesis),
        center=dataclasses.replace(
            design.center, feed=(0.0,) * order, v=70.5, v_rate=12.25, v_start=3.5
        ),
        bounds=dataclasses.replace(design.bounds, W=W, s=(0.0,) * order, U=95.5, delta_v=0.001225),
        nominal=NominalModel(
            states=states,
            f=tuple(x**2 - sp.sin(x) * sp.Rational(321, 5000) for x in states),
            g=(sp.Integer(2) + sp.sin(states[0]), *(sp.Integer(1) for _ in states[1:])),
            left_out=((rough,), *(() for _ in states[1:])),
            transition=TRANSITION,
        ),
        nominal_split=NominalSplit(
            feedforward=70.5,
            tube=24.75,
            actuator_error=0.25,
            disturbance=sources,
            parameters=((("mass", 1.125),), *(() for _ in states[1:])),
        ),
    )


@pytest.fixture(scope="module")
def nominal(design):
    return with_center(design)


@pytest.fixture(scope="module")
def document(nominal, run, adversaries):
    text = json.dumps(report_document(nominal, run, adversaries), allow_nan=False)
    return json.loads(text)


@pytest.fixture(scope="module")
def page(document, nominal, run):
    return render_html(document, nominal, run)


def rows_of(design, document):
    return {row.keys[1:]: row for step in derivation(design, document) for row in step.rows}


def places(markup):
    return re.findall(r'data-json-path="([^"]+)"', markup)


def resolve(document, path):
    for key in re.findall(r"[^.\[\]]+", path):
        document = document[int(key)] if isinstance(document, list) else document[key]
    return document


def test_report_json_says_how_long_the_start_is_felt(document):
    performance = document["performance"]
    assert performance["transition"] == TRANSITION
    assert performance["rho"] == []
    assert performance["final_error"] == performance["accuracy"] == document["omega"]["p"][0]


def test_report_json_has_the_model_and_what_everything_consists_of(document):
    found = document["nominal"]
    assert found["transition"] == TRANSITION
    assert found["parameters"] == {"mass": 1.0}
    assert found["model"][0]["g"] == "sin(x1) + 2"
    assert found["left_out"] == [["Abs(x1)/10"], []]
    assert found["feedforward"] + found["tube"] + found["actuator_error"] == 95.5
    assert found["sources"][1][1] == {"source": "deviation of x2", "size": 0.75}
    assert found["parameter_errors"] == [[{"parameter": "mass", "size": 1.125}], []]
    bounds = document["bounds"]
    assert (bounds["v"], bounds["v_rate"], bounds["v_start"]) == (70.5, 12.25, 3.5)


def test_center_performance_has_none_of_it(design, run):
    document = report_document(design, run, ())
    assert "nominal" not in document
    assert "transition" not in document["performance"]
    assert len(document["performance"]["rho"]) == 2
    assert not {"v", "v_rate", "v_start"} & set(document["bounds"])
    assert center_texts(design, document) == ()
    assert splits(design) == ()
    assert 'id="center"' not in render_html(document, design, run)


def test_every_number_on_the_page_is_that_of_report_json(document, page):
    found = NUMBER.findall(page)
    assert len(found) > 150
    for path, full, text in found:
        value = resolve(document, path)
        assert text == shown(value), path
        assert json.loads(full) == value, path
    paths = {path for path, _, _ in found}
    assert {"performance.transition", "nominal.transition", "nominal.feedforward"} <= paths
    assert {"nominal.sources[1][1].size", "nominal.parameter_errors[0][0].size"} <= paths
    assert {"bounds.v", "bounds.v_rate", "bounds.v_start", "bounds.delta_v"} <= paths


def test_the_page_says_what_the_model_leaves_out_and_why(page):
    text = re.sub(r"<[^>]+>", " ", page)
    assert "leaves out" in text
    assert "does not have. It stays in" in text
    assert page.count('<section aria-labelledby="center">') == 1
    assert "None" not in page
    assert "\\" not in page


def test_a_model_that_leaves_nothing_out_says_so(nominal, document):
    whole = dataclasses.replace(nominal.nominal, left_out=((), ()))
    (text,) = center_texts(dataclasses.replace(nominal, nominal=whole), document)
    assert text.remarks == ("No known term of the plant was left out of the model.",)


def test_a_drift_or_gain_that_is_known_by_bounds_only_is_named(nominal, document):
    first, second = nominal.plant.channels
    blind = dataclasses.replace(second, f=None, g=None, g_bound=sp.Integer(2), g_min=sp.Integer(1))
    plant = dataclasses.replace(nominal.plant, channels=(first, blind))
    (text,) = center_texts(dataclasses.replace(nominal, plant=plant), document)
    assert [remark.split(":")[0] for remark in text.remarks[1:2]] == [r"$\hat{f}_{2} = 0$"]
    assert "mean of the declared bounds" in text.remarks[2]


@pytest.mark.parametrize("order", [1, 2, 4])
def test_the_center_has_a_line_for_every_state_and_one_for_v(design_of, run_of, order):
    made = with_center(design_of(order))
    document = report_document(made, run_of(made), ())
    (text,) = center_texts(made, document)
    assert len(text.path) == order + 1
    assert len(text.model) == 2 * order
    assert f"<mn>{order + 2}</mn>" in text.transition[0]
    assert places(text.transition[2]) == ["nominal.transition"]


def test_the_chain_feeds_v_forward_and_has_no_s(nominal, document):
    rows = rows_of(nominal, document)
    assert places(rows["W", 1].numbers[0]) == [
        "nominal.sources[1][0].size",
        "nominal.sources[1][1].size",
    ]
    assert places(rows["F_star", 0].numbers[0]) == ["bounds.D[0]", "bounds.g_min[0]", "omega.p[1]"]
    assert "bounds.v" in places(rows["U",].numbers[0])
    assert {"bounds.v_start", "bounds.delta_v"} <= set(places(rows["V",].numbers[0]))
    assert places(rows["delta_v",].numbers[0]) == ["sampling.hold", "bounds.v_rate"]
    for row in rows.values():
        for text in row.numbers:
            letters = set(re.findall(r"<mi>([^<]+)</mi>", text))
            assert letters <= {"\N{GREEK SMALL LETTER SIGMA}"}, (row.keys, letters)


def test_no_inequality_adds_the_next_center(nominal, design, document):
    sides = obligation(nominal, document, "U1[x1]").sides
    assert "bounds.s[0]" not in places(sides[1].numbers)
    assert "bounds.s[0]" in places(obligation(design, document, "U1[x1]").sides[1].numbers)


def test_the_promise_is_about_the_reference_and_the_transition(nominal):
    output, tracking, command = promise(nominal)
    assert r"\left|y - y_d - b(t)\right| \le p_1$ = #omega/p/0#" in output
    assert "#performance/transition#" in tracking
    assert r"\left|y - y_d\right| \le$#performance/final_error#" in tracking
    assert "#bounds/U#" in command
    (sentence,) = performance_sentences(nominal)
    assert "rho" not in sentence


def test_the_law_adds_the_feedforward(page, document, design, run):
    nominal_law, other = (
        re.sub(r"<[^>]+>", "", text[text.index('id="gains"') :][:4000])
        for text in (page, render_html(report_document(design, run, ()), design, run))
    )
    assert "u=v-" in re.sub(r"\s", "", nominal_law).replace("\N{MINUS SIGN}", "-")
    assert "u=-" in re.sub(r"\s", "", other).replace("\N{MINUS SIGN}", "-")
    readme = render_readme(document)
    assert f"|y - y_d - b(t)| <= {document['omega']['p'][0]:.6g}" in readme
    assert f"T_s = {TRANSITION:.6g} s" in readme
    assert "rho_1" not in readme
    assert "derivatives" not in readme


def test_a_supplied_reference_comes_with_its_derivatives(nominal, run):
    spec = nominal.spec
    bound = spec.performance.accuracy
    reference = dataclasses.replace(
        spec.reference, kind=ReferenceKind.RUNTIME, expression=None, bounds=(bound,) * 4
    )
    supplied = dataclasses.replace(
        nominal,
        spec=dataclasses.replace(spec, reference=reference),
        plant=dataclasses.replace(nominal.plant, reference=None),
    )
    document = report_document(supplied, run, ())
    assert document["reference"]["bounds"] == [0.15] * 4
    assert "exact derivatives up to order 2" in reference_sentence(supplied)
    page, readme = render_html(document, supplied, run), render_readme(document)
    for text in (page, readme):
        assert "its exact derivatives, order 1 to 2." in text
    assert {"reference.bounds[0]", "reference.bounds[3]"} <= set(places(page))
    assert "controller.step(t, x, y_d)" in readme


def test_the_bars_are_shares_from_the_largest_down(nominal):
    command, *others = splits(nominal)
    assert [bar.keys[-1] for bar in command.bars] == ["feedforward", "tube", "actuator_error"]
    assert [bar.width for bar in command.bars] == ["0.7382", "0.2592", "0.0026"]
    assert [len(split.bars) for split in others] == [2, 1, 2]
    for split in (command, *others):
        widths = [float(bar.width) for bar in split.bars]
        assert widths == sorted(widths, reverse=True)
        assert all(0.0 < width <= 1.0 for width in widths)


def test_an_exact_actuator_has_no_bar(nominal):
    exact = dataclasses.replace(nominal.nominal_split, actuator_error=0.0)
    command = splits(dataclasses.replace(nominal, nominal_split=exact))[0]
    assert [bar.keys[-1] for bar in command.bars] == ["feedforward", "tube"]


def test_the_center_is_drawn_against_the_reference_for_twice_the_transition(nominal, run):
    plot, *others = draw(nominal, run)
    assert [each.key for each in (plot, *others)] == ["center", "output", "errors", "input"]
    assert float(plot.x_ticks[-1].label) <= 2.0 * TRANSITION
    assert float(others[0].x_ticks[-1].label) == 2.0
    assert len(plot.bands) == 1
    assert [curve.style for curve in plot.curves] == ["curve-1", "curve-2 dashed", "start"]
    low, high = (point.split(",") for point in plot.curves[-1].points.split())
    assert low[0] == high[0] == plot.left
    # The declared starts are [0, 1]: heights in pixels grow downward.
    assert float(high[1]) < float(low[1])


def test_a_transition_shorter_than_a_step_or_longer_than_the_run_is_drawn(nominal, run):
    for transition, last in ((1e-9, float(run.t[1])), (100.0, 2.0)):
        moved = dataclasses.replace(
            nominal, nominal=dataclasses.replace(nominal.nominal, transition=transition)
        )
        plot = draw(moved, run)[0]
        assert np.isfinite([float(tick.at) for tick in plot.x_ticks]).all()
        assert float(plot.x_ticks[-1].label.replace("\N{MINUS SIGN}", "-")) <= last


@pytest.mark.parametrize("stage", [1, 2, 11])
@pytest.mark.parametrize(
    ("family", "sentence"),
    [
        (
            "T3.stage",
            "Between two samples no error leaves the widened tube of this free stage.",
        ),
        ("T3.handover", "The last tube contains every jump out of this stage."),
    ],
)
def test_the_claims_of_a_stage_have_words_for_every_stage(
    design, document, family, stage, sentence
):
    found = obligation(design, document, f"{family}{stage}[x1]")
    assert found.meaning == sentence
    assert found.sides == ()


def test_another_claim_of_theorem_3_keeps_the_general_words(design, document):
    other = obligation(design, document, "unheard of").meaning
    assert obligation(design, document, "T3.unheard1[x1]").meaning == other


@pytest.mark.parametrize(
    ("term", "sentence"),
    [
        ("deviation of x1", "deviation of `x1` from the center"),
        ("model error along the center", "model error along the center"),
        ("disturbance", "disturbance"),
    ],
)
def test_a_source_of_the_residual_is_put_into_words(term, sentence):
    assert term_sentence(term) == sentence


def test_the_command_line_says_what_u_consists_of(document):
    lines = summary(document)
    assert "  of it feedforward 70.5, tube 24.75; transition 0.625 s" in lines


@pytest.mark.parametrize(("shift", "branch"), [(0, "x_{1}"), (1, "1 - x_{1}")])
def test_an_abs_in_a_gain_that_is_followed_on_one_side_is_named(nominal, document, shift, branch):
    first, second = nominal.plant.channels
    # The starts are in [0, 1]: the side is that of the middle.
    kinked = dataclasses.replace(second, g=3 + sp.Abs(nominal.plant.states[0] - shift))
    plant = dataclasses.replace(nominal.plant, channels=(first, kinked))
    (text,) = center_texts(dataclasses.replace(nominal, plant=plant), document)
    (remark,) = [remark for remark in text.remarks if "kink" in remark]
    assert remark.startswith(rf"$\hat{{g}}_{{2}}$ has ${branch}$ in place of ")
    assert r"\left|{" in remark
    assert f"${branch} > 0$" in remark
    (plain,) = center_texts(nominal, document)
    assert not any("kink" in remark for remark in plain.remarks)


def test_majorants_of_f_and_g_are_shown_where_they_are_used(page, design, run, adversaries):
    other = json.loads(json.dumps(report_document(design, run, adversaries), allow_nan=False))
    assert "<h3>Majorants</h3>" in render_html(other, design, run)
    assert "ajorant" not in page
    assert "largest input gain" in page
