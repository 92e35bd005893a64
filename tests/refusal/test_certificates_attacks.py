"""Attempts to make the checker say "proved" for something false; listed in docs/attacks.md."""

from __future__ import annotations

import copy
import math
import time
from typing import Any

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import produce_certificate
from bfppc_synth.model.shapes import Shape

STRONG = 4000.0


def document(f: str = "x1", **keys: Any) -> dict[str, Any]:
    """A plant of order 1, dx = f + u, from x(0) = 0.5, accuracy 0.25; keys replace its own."""
    plant: dict[str, Any] = {
        "name": "attacked",
        "states": ["x1"],
        "dynamics": {"x1": {"f": f}},
        "initial": {"x1": "0.5"},
        "performance": {"accuracy": "0.25"},
    }
    plant.update(keys)
    return {"format": checker.PLANT_FORMAT, "plant_sha256": "ab" * 32, "plant": plant}


def certified(plant: dict[str, Any], *, k: float = STRONG, p: float = 0.25) -> dict[str, Any]:
    shape = Shape(k=k, M=0.0, epsilon=1.0, c=0.0, N=3)
    return produce_certificate(plant, (shape,), (p,), tool="test")


def answer(plant: dict[str, Any], **design: float) -> checker.Report:
    try:
        certificate = certified(plant, **design)
    except checker.MalformedError as error:
        return checker.Report("malformed", failures=(str(error),))
    return checker.check_documents(plant, certificate)


def channel(**keys: str) -> dict[str, Any]:
    return {"x1": keys}


def test_the_plant_that_is_attacked_is_proved_by_itself() -> None:
    assert answer(document()).verdict == "proved"


# --- false bounds -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("f", "f_bound"),
    [
        ("x1", "0.9*Abs(x1)"),
        ("sin(x1)", "0.99*Abs(x1)"),
        ("x1**2", "x1**2 - 1e-9"),
        ("0.001/(1 + 1e8*(x1 - 0.3)**2)", "0.0001"),
        ("Piecewise((1, x1 > 0.3), (0, True))*Piecewise((1, x1 < 0.301), (0, True))", "0.5"),
        ("exp(a*x1)", "exp(0.5*Abs(x1))"),
        ("x1*Abs(x1)", "0.9*x1**2"),
        ("sign(x1)", "tanh(1e6*Abs(x1))"),
        ("(x1)**(1/3)", "Abs(x1)"),
    ],
)
def test_a_false_f_bound_is_refuted_or_undecided(f: str, f_bound: str) -> None:
    plant = document(dynamics=channel(f=f, f_bound=f_bound), parameters={"a": ["0.4", "0.6"]})
    report = answer(plant)
    assert report.verdict in ("refuted", "undecided")
    assert any(line.startswith("f_bound[x1]") for line in report.failures)


@pytest.mark.parametrize(
    ("f", "f_bound"),
    [
        ("x1", "Abs(x1)"),
        ("sin(x1)", "Abs(x1)"),
        ("x1**2 - sin(x1)", "x1**2 + 1"),
        ("x1 + x1*exp(-0.5*x1)", "Abs(x1) + Abs(x1)*exp(0.5*Abs(x1))"),
        ("exp(a*x1)", "exp(0.6*Abs(x1))"),
        ("x1*Abs(x1)", "x1**2"),
        ("(x1)**(1/3)", "Abs(x1)**(1/3)"),
        ("tanh(x1)*cos(x1)", "Abs(x1)"),
    ],
)
def test_a_true_f_bound_without_any_room_is_proved(f: str, f_bound: str) -> None:
    plant = document(dynamics=channel(f=f, f_bound=f_bound), parameters={"a": ["0.4", "0.6"]})
    assert answer(plant).failures == ()


def test_the_weaker_form_cannot_hide_a_bound_that_is_false_somewhere() -> None:
    # sup|f| = 0.75 over the box is below sup f_bound = 0.76, but f(0.2) > f_bound(0.2).
    plant = document(dynamics=channel(f="x1", f_bound="Abs(x1) + 0.05*(Abs(x1) - 0.55)"))
    certificate = certified(plant)
    forged = copy.deepcopy(certificate)
    for claim in forged["claims"]:
        if claim["id"] == "f_bound[x1]":
            claim["proof"] = {"kind": "corner", "trees": [[-1], [-1]]}
    report = checker.check_documents(plant, forged)
    assert report.verdict == "refuted"
    witness = dict(next(c for c in report.claims if c.id == "f_bound[x1]").witness)
    assert abs(witness["x1"]) > abs(witness["x1"]) + 0.05 * (abs(witness["x1"]) - 0.55)


SECOND_ORDER = {
    "name": "tangent",
    "states": ["x1"],
    "dynamics": {"x1": {"f": "0", "g": "1 + sin(x1**2)", "g_bound": "2", "g_min": "1"}},
    "performance": {"accuracy": "0.25"},
}


@pytest.mark.parametrize(("start", "verdict"), [("1.2", "proved"), ("1.6", "refuted")])
def test_g_min_that_is_tight_on_the_box_is_proved_exactly_and_refuted_beyond_it(
    start: str, verdict: str
) -> None:
    # 1 + sin(x^2) >= 1 as long as x^2 <= pi, x <= 1.772; at the start 1.6 the box ends at 1.85.
    plant = document(**{**SECOND_ORDER, "initial": {"x1": start}})
    report = answer(plant)
    assert report.verdict == verdict
    if verdict == "refuted":
        point = dict(next(c for c in report.claims if c.id == "g_min[x1]").witness)["x1"]
        assert 1.0 + math.sin(point**2) < 1.0
        assert abs(point) <= 1.85


@pytest.mark.parametrize(
    ("g", "g_min", "g_bound"),
    [("2 + x1", "2", "3"), ("2 + x1", "1.4", "2.5"), ("x1", "0.1", "1"), ("-1", "1", "1")],
)
def test_false_bounds_of_g_are_refused(g: str, g_min: str, g_bound: str) -> None:
    report = answer(document(dynamics=channel(f="0", g=g, g_min=g_min, g_bound=g_bound)))
    assert report.verdict == "refuted"


@pytest.mark.parametrize("g", ["x1", "sin(9*x1)", "0", "x1**2"])
def test_a_gain_that_may_vanish_is_refused(g: str) -> None:
    report = answer(document(dynamics=channel(f="0", g=g)))
    assert report.verdict in ("refuted", "undecided")


@pytest.mark.parametrize("g_min", ["0", "-1", "x1 - 1"])
def test_a_g_min_that_is_not_positive_is_refused(g_min: str) -> None:
    report = answer(document(dynamics=channel(f="0", g="2", g_min=g_min)))
    assert report.verdict in ("refuted", "undecided")


# --- poles, domains, jumps --------------------------------------------------------------------


@pytest.mark.parametrize(
    "f",
    [
        "1/x1",
        "1/(x1 - 0.6)",
        "tan(3*x1)",
        "log(x1)",
        "sqrt(x1 - 0.5)",
        "x1**(-2)",
        "x1**(-1/3)",
        "1/sin(x1)",
        "1/(1 - cos(x1))",
        "exp(1/x1)",
        "(x1 - 0.5)**(3/4)",
    ],
)
def test_a_pole_or_a_domain_inside_the_box_is_refused(f: str) -> None:
    report = answer(document(f))
    assert report.verdict == "undecided"
    assert "reachable box" in report.failures[0]


@pytest.mark.parametrize(
    "f",
    [
        "x1/x1",
        "x1**2/x1",
        "1/x1 - 1/x1",
        "0/x1",
        "0*log(x1)",
        "log(x1) - log(x1)",
        "sqrt(x1 - 0.5)**2",
        "tan(9*x1)/tan(9*x1)",
        "(1/x1)**0",
        "x1*(1/x1)**2*x1",
    ],
)
def test_a_pole_that_cancels_is_refused_all_the_same(f: str) -> None:
    assert answer(document(f)).verdict == "undecided"


@pytest.mark.parametrize("f", ["(x1 + 2)/(x1 + 2)", "sqrt(x1 + 1)**2", "log(x1 + 2)", "1/(3 + x1)"])
def test_what_is_defined_on_the_whole_box_is_not_refused(f: str) -> None:
    assert answer(document(f)).verdict == "proved"


def test_a_jump_between_two_faces_is_not_mistaken_for_a_monotone_function() -> None:
    # The slope is 0 on both sides of the jump: collapsing to a face would miss the 1.
    jumping = "Piecewise((0, x1 < 0.1), (0, x1 > 0.2), (1, True))"
    tape = checker.Tape(checker.parse(jumping, {"x1": checker.sym("x1")}), ("x1",))
    upper = tape.bound(((0, checker.ONE),)).upper
    assert upper >= checker.ONE


def test_odd_roots_of_negative_numbers_are_the_increasing_ones() -> None:
    tape = checker.Tape(checker.parse("x1**(1/3)", {"x1": checker.sym("x1")}), ("x1",))
    assert tape.value(((-8 * checker.ONE, -8 * checker.ONE),)) == (-2 * checker.ONE,) * 2
    even = checker.Tape(checker.parse("x1**(2/3)", {"x1": checker.sym("x1")}), ("x1",))
    assert even.value(((-8 * checker.ONE, checker.ONE),)) == (0, 4 * checker.ONE)


# --- references -------------------------------------------------------------------------------


def test_a_narrow_spike_of_the_reference_is_enclosed() -> None:
    problem = checker.read_plant(document(reference="sin(t) + 1/(1 + 1e8*(t - 7.3)**2)"))
    center = checker.performance_center(problem)
    assert checker.to_doubles(center.high[0])[1] > math.sin(7.3) + 1.0
    assert 6490.0 < checker.to_doubles(center.rate[0])[1] < 6500.0


@pytest.mark.parametrize(
    "reference",
    ["t", "exp(t)", "1/(t - 5)", "tan(t)", "sqrt(t)", "sign(sin(t))", "sin(t**2)", "log(t + 1)"],
)
def test_a_reference_that_cannot_be_enclosed_is_refused(reference: str) -> None:
    assert answer(document(reference=reference)).verdict == "undecided"


def test_incommensurate_frequencies_do_not_hide_the_common_peak() -> None:
    # sin t + sin sqrt(2) t comes near 2 only after long times.
    problem = checker.read_plant(document(reference="sin(t) + sin(sqrt(2)*t)"))
    assert checker.performance_center(problem).low[0][1] <= -2 * checker.ONE + 2**40


def test_declared_reference_bounds_are_printed_as_assumptions() -> None:
    plant = document(reference={"value": "sin(t)", "bound": "1", "rate": "1"})
    report = answer(plant)
    assert report.verdict == "proved"
    assert any("declared bounds" in line for line in report.assumptions)


# --- plants that ask for something else -------------------------------------------------------


@pytest.mark.parametrize(
    "keys",
    [
        {"synthesis": {"form": "printed"}},
        {"synthesis": {"method": "theorem1"}},
        {"synthesis": {"method": "theorem3"}},
        {"synthesis": {"center": "nominal"}},
        {"synthesis": {"bounds": "tight"}},
        {"synthesis": {"method": "theorem3", "stages": []}},
        {"synthesis": {"stagess": []}},
        {"performance": {"accuracy": "0.25", "funnel": "x1"}},
        {"performance": {"accuracy": "0.25", "funel": "1"}},
        {"disturbance": "1"},
        {"dynamics": {"x1": {"f": "0", "disturbence": "100"}}},
        {"dynamics": {"x1": {"f": "0", "f_boud": "1"}}},
        {"sampling": {"periode": "1"}},
        {"measurement": {"quantizer": {"kind": "uniform", "stepp": "1"}}},
        {"measurement": {"quantizer": {"kind": "lattice", "step": "1"}}},
        {"measurement": {"quantizer": {"kind": "uniform"}}},
        {"synthesis": {"method": "theorem2"}, "sampling": {"period": "0.001"}},
        {"synthesis": {"method": "theorem2"}, "measurement": {"noise": "0.001"}},
        {"initial": {"x1": ["1", "0.5"]}},
        {"initial": {}},
        {"initial": {"x1": "0.5", "x2": "0"}},
        {"parameters": {"a": ["2", "1"]}},
        {"parameters": {"x1": "1"}},
        {"parameters": {"sin": "1"}},
        {"states": ["x1", "x1"]},
        {"states": []},
        {"name": "../../elsewhere"},
        {"performance": {"accuracy": "0"}},
        {"performance": {"accuracy": "0.25", "rho": {"kind": "cosine", "t_s": "-1"}}},
        {"actuator": {"error": "-1"}},
        {"sampling": {"period": "-0.1"}},
        {"dynamics": {"x1": {"f": "x2"}}},
        {"dynamics": {"x1": {"f": "u"}}},
        {"dynamics": {"x1": {"g": "1"}}},
        {"dynamics": {"x1": {"f": "0", "g_bound": "1"}}},
        {"dynamics": {"x1": {"f": 1.0}}},
        {"dynamics": []},
    ],
)
def test_a_plant_outside_of_what_is_proved_is_malformed(keys: dict[str, Any]) -> None:
    report = answer(document(**keys))
    assert report.verdict == "malformed"
    assert report.exit_code == 2


# Seconds of processor time: a bomb that goes off takes minutes or for ever.
HANG = 30.0


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "().__class__",
        "x1.real",
        "lambda: 1",
        "x1 if x1 else 1",
        "[1]",
        "x1 @ x1",
        "1e9999",
        "9**9**9",
        "x1**(10**10)",
        "x1**x1",
        "Piecewise((1, x1 < 1))",
        "Piecewise((1, 0 < x1 < 1), (2, True))",
        "sin()",
        "sin(x1, x1)",
        "min(x1)",
        "x1 x1",
        "(x1",
        "",
        "1" * 5000,
        "-" * 5000 + "1",
        "(" * 5000 + "1" + ")" * 5000,
        "x\u0031",
        "\u04451",
    ],
)
def test_what_is_no_expression_is_never_evaluated(text: str) -> None:
    begun = time.process_time()
    if text == "x\u0031":
        assert answer(document(text)).verdict == "proved"
    else:
        assert answer(document(text)).verdict in ("malformed", "undecided")
    assert time.process_time() - begun < HANG


@pytest.mark.parametrize(
    "f",
    [
        "(((((x1 + 1)**64)**64)**64)**64)**64",
        "exp(exp(exp(exp(x1 + 9))))",
        "exp(1e300*x1)",
        "sin(1e300*x1)",
        "tanh(1e300*x1)",
        "cosh(x1*1e5)",
        "*".join(["(x1 + sin(x1))"] * 200),
        "+".join(f"sin({j}*x1)" for j in range(300)),
        "(x1 + 2)**(63/64)" + "*(x1 + 3)**(61/997)" * 20,
    ],
)
def test_a_bomb_is_answered_in_time(f: str) -> None:
    begun = time.process_time()
    report = answer(document(f))
    assert time.process_time() - begun < HANG
    assert report.verdict in ("proved", "refuted", "undecided", "malformed")
    # sin and tanh are bounded by 1 wherever their arguments are.
    assert (report.verdict == "proved") >= f.startswith(("sin(1e300", "tanh("))


# --- designs ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("p", "verdict"), [(0.25, "proved"), (0.2501, "refuted")])
def test_a_tube_wider_than_the_accuracy_is_refuted(p: float, verdict: str) -> None:
    assert answer(document(), p=p).verdict == verdict


@pytest.mark.parametrize("p", [0.0, -0.25])
def test_a_tube_without_width_is_malformed(p: float) -> None:
    assert answer(document(), p=p).verdict == "malformed"


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("k", "nan"),
        ("k", "inf"),
        ("k", "-0x1.0000000000000p+12"),
        ("k", "0x1p+12"),
        ("k", "4000.0"),
        ("k", 4000),
        ("k", 4000.0),
        ("k", None),
        ("k", "0x1.0000000000000p+99999"),
        ("N", 2),
        ("N", 1),
        ("N", -3),
        ("N", True),
        ("N", 3.0),
        ("N", "3"),
        ("N", 10**9 + 1),
    ],
)
def test_a_gain_that_is_no_number_of_a_controller_is_malformed(key: str, value: object) -> None:
    plant = document()
    certificate = certified(plant)
    certificate["design"]["gains"][0][key] = value
    assert checker.check_documents(plant, certificate).verdict == "malformed"


def test_gains_all_zero_are_malformed() -> None:
    plant = document()
    certificate = certified(plant)
    certificate["design"]["gains"][0]["k"] = (0.0).hex()
    assert checker.check_documents(plant, certificate).verdict == "malformed"


def test_a_clamp_below_the_peak_input_is_malformed() -> None:
    plant = document()
    certificate = certified(plant)
    certificate["design"]["U_MAX"] = (STRONG * 0.25 * 0.99).hex()
    assert checker.check_documents(plant, certificate).verdict == "malformed"


def test_a_peak_input_above_the_limit_is_refuted() -> None:
    assert answer(document(actuator={"limit": "1001"})).verdict == "proved"
    report = answer(document(actuator={"limit": "999"}))
    assert report.verdict == "refuted"
    assert report.failures[0].startswith("limit")


def test_a_measurement_as_coarse_as_the_tube_is_refuted() -> None:
    assert answer(document(measurement={"noise": "0.2"})).verdict == "proved"
    report = answer(document(measurement={"noise": "0.25"}))
    assert report.verdict == "refuted"
    assert any(line.startswith("U0[x1]") for line in report.failures)


def test_samples_too_far_apart_for_the_gains_are_refuted() -> None:
    assert answer(document(sampling={"period": "0.0001"})).verdict == "proved"
    assert answer(document(sampling={"period": "0.001"})).verdict == "refuted"
    late = {"period": "0.0001", "delay": "0.001"}
    assert answer(document(sampling=late)).verdict == "refuted"


def test_the_exact_anchor_counts_the_measurement_twice() -> None:
    noisy = {"measurement": {"noise": "0.15"}}
    assert answer(document(**noisy)).verdict == "proved"
    report = answer(document(**noisy, synthesis={"anchor": "exact"}))
    assert report.verdict == "refuted"


def test_a_gain_or_width_that_the_file_fixes_cannot_be_another_one() -> None:
    fixed = {"gains": {"x1": {"k": "4000"}}}
    assert answer(document(synthesis=fixed)).verdict == "proved"
    report = answer(document(synthesis=fixed), k=4001.0)
    assert report.verdict == "refuted"
    assert report.failures[0].startswith("fixed")


# --- proofs -----------------------------------------------------------------------------------

SPREAD = {"f": "2*x1*cos(x1/8)", "f_bound": "x1**2 + 1.001"}


def with_proof(proof: object) -> str:
    plant = document(dynamics={"x1": SPREAD}, initial={"x1": ["-1", "1"]})
    certificate = certified(plant)
    assert checker.check_documents(plant, certificate).verdict == "proved"
    for claim in certificate["claims"]:
        if claim["id"] == "f_bound[x1]":
            claim["proof"] = proof
    return checker.check_documents(plant, certificate).verdict


@pytest.mark.parametrize(
    ("proof", "verdict"),
    [
        ({"kind": "eval"}, "undecided"),
        ({"kind": "rational"}, "malformed"),
        ({"kind": "trust"}, "malformed"),
        ({"kind": "bisect"}, "malformed"),
        ({"kind": "bisect", "trees": []}, "malformed"),
        ({"kind": "bisect", "trees": [[]] * 4}, "malformed"),
        ({"kind": "bisect", "trees": [[-1]] * 4}, "undecided"),
        ({"kind": "bisect", "trees": [[-1]] * 3}, "malformed"),
        ({"kind": "bisect", "trees": [[-1]] * 5}, "malformed"),
        ({"kind": "bisect", "trees": [[0, -1]] * 4}, "malformed"),
        ({"kind": "bisect", "trees": [[-1, -1]] * 4}, "malformed"),
        ({"kind": "bisect", "trees": [[1, -1, -1]] * 4}, "malformed"),
        ({"kind": "bisect", "trees": [[-2]] * 4}, "malformed"),
        ({"kind": "bisect", "trees": [[False, -1, -1]] * 4}, "malformed"),
        ({"kind": "bisect", "trees": [["-1"]] * 4}, "malformed"),
        ({"kind": "bisect", "trees": [[0.0, -1, -1]] * 4}, "malformed"),
        ({"kind": "bisect", "trees": [[0] * 5000] * 4}, "malformed"),
        ({"kind": "bisect", "trees": "none"}, "malformed"),
        ({"kind": "eval", "trees": [[-1]]}, "malformed"),
        ({}, "malformed"),
        (None, "malformed"),
        ([], "malformed"),
    ],
)
def test_a_proof_that_does_not_prove_is_refused(proof: object, verdict: str) -> None:
    assert with_proof(proof) == verdict


def test_a_claim_twice_or_of_something_else_is_malformed() -> None:
    plant = document()
    certificate = certified(plant)
    twice = {**certificate, "claims": [*certificate["claims"], certificate["claims"][-1]]}
    assert checker.check_documents(plant, twice).verdict == "malformed"
    other = {"id": "U9[x1]", "uses": [], "proof": {"kind": "eval"}}
    surplus = {**certificate, "claims": [*certificate["claims"], other]}
    assert checker.check_documents(plant, surplus).verdict == "malformed"


@pytest.mark.parametrize("nonsense", [None, 3, "text", [], {}, {"format": 1}, float("nan")])
def test_documents_that_are_none_are_malformed(nonsense: object) -> None:
    plant = document()
    assert checker.check_documents(nonsense, certified(plant)).verdict == "malformed"
    assert checker.check_documents(plant, nonsense).verdict == "malformed"


# --- the paper's second example ---------------------------------------------------------------


@pytest.mark.parametrize(("start", "verdict"), [("0.5", "proved"), ("1.2", "refuted")])
def test_the_gain_of_the_papers_second_example_is_at_least_one_only_near_its_start(
    start: str, verdict: str
) -> None:
    plant = document(
        states=["x1", "x2"],
        parameters={"a": "0.5"},
        dynamics={
            "x1": {
                "f": "x1 + x1*exp(-a*x1)",
                "g": "1 + sin(x1**2)",
                "f_bound": "Abs(x1) + Abs(x1)*exp(a*Abs(x1))",
                "g_bound": "2",
                "g_min": "1",
            },
            "x2": {"f": "x1*sin(x2) + x1*x2**2", "g": "3 + cos(x1)", "g_min": "2"},
        },
        reference="sin(t)",
        initial={"x1": start, "x2": "0"},
        performance={"accuracy": "0.05"},
    )
    shapes = (
        Shape(k=2.0, M=13.4, epsilon=0.5, c=0.1, N=3),
        Shape(k=8000.0, M=0.0, epsilon=1.0, c=0.0, N=3),
    )
    certificate = produce_certificate(plant, shapes, (0.05, 2.0), tool="test")
    report = checker.check_documents(plant, certificate)
    claim = next(c for c in report.claims if c.id == "g_min[x1]")
    assert claim.verdict == verdict
    if verdict == "refuted":
        assert 1.0 + math.sin(dict(claim.witness)["x1"] ** 2) < 1.0
    else:
        assert report.verdict == "proved"
