"""Certificates of center nominal with something false in them; docs/attacks.md."""

from __future__ import annotations

import copy
import hashlib
import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import produce_certificate
from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from bfppc_synth.model.design import Design

# Parameters that the code's f^ contains in their middle, an abs that f^ leaves out, a delay.
PENDULUM = """\
name: pendulum
parameters: {a: [0.9, 1.1], max_drag: [0.1, 0.2]}
states: [x1, x2]
dynamics:
  x1: {f: 0}
  x2: {f: -a*sin(x1) - max_drag*x2 - 0.1*x2*abs(x2), g: 2 + cos(x1)}
reference: 0.5*sin(t)
initial: {x1: 0.125, x2: 0}
performance: {accuracy: 0.1, transition: 2}
sampling: {period: 0.0001, delay: 0.0001}
synthesis: {center: nominal, p: {x2: 0.0188}, gains: {x1: {k: 0.22, M: 0, c: 0}, x2: {M: 0, c: 0}}}
"""
# b is over before the second of most samples; y_d, dy_d are passed at run time.
TANK = """\
name: tank
parameters: {a: [0.9, 1.1]}
states: [x1]
dynamics: {x1: {f: -a*x1**2 - 0.1*x1*abs(x1), g: 2 + sin(x1)}}
reference: REFERENCE
initial: {x1: [0.1, 0.2]}
performance: {accuracy: 0.1, transition: 0.01}
synthesis: {center: nominal, gains: {x1: {M: 0, c: 0}}}
"""
PLANTS = {
    "pendulum": PENDULUM,
    "tank": TANK.replace("REFERENCE", "sin(t)"),
    "passed": TANK.replace("REFERENCE", "{bounds: [1, 1, 1]}"),
}


@pytest.fixture(scope="module")
def designs(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Design]:
    known: dict[str, Design] = {}

    def design(case: str) -> Design:
        if case not in known:
            path = tmp_path_factory.mktemp(case) / "plant.yaml"
            path.write_text(PLANTS[case], encoding="utf-8")
            known[case] = synthesize(load_spec(path))
        return known[case]

    return design


def documents(design: Design, **changes: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """plant.json, keys of its plant replaced, and a certificate made for it."""
    plant = json.loads(plant_json(design.spec))
    assert design.nominal is not None
    parts = {"gains": design.gains, "T_s": design.nominal.transition}
    parts |= {key: changes.pop(key) for key in list(changes) if key in parts}
    plant["plant"] |= changes
    made = produce_certificate(
        plant, parts["gains"], design.omega, tool="test", transition=parts["T_s"]
    )
    return plant, made


def answer(design: Design, **changes: Any) -> checker.Report:
    return checker.check_documents(*documents(design, **changes))


def failed(report: checker.Report) -> list[str]:
    return [failure.partition(":")[0] for failure in report.failures]


@pytest.mark.parametrize("case", sorted(PLANTS))
def test_the_design_that_is_attacked_is_proved_by_itself(designs, case: str) -> None:
    report = answer(designs(case))
    assert report.failures == ()
    assert report.verdict == "proved"


def test_each_claim_deleted_is_named(designs) -> None:
    plant, made = documents(designs("pendulum"))
    assert len(made["claims"]) >= 7
    for index, claim in enumerate(made["claims"]):
        fewer = {**made, "claims": made["claims"][:index] + made["claims"][index + 1 :]}
        report = checker.check_documents(plant, fewer)
        assert report.verdict == "undecided"
        assert any(
            line.startswith(f"{claim['id']}:".replace("'", "")) and "no proof is given" in line
            for line in report.failures
        )


def test_each_enclosure_spoiled_is_refused(designs) -> None:
    plant, made = documents(designs("pendulum"))
    for key, (low, high) in made["enclosures"].items():
        spoiled = copy.deepcopy(made)
        spoiled["enclosures"][key] = [low, (float.fromhex(high) * 0.999 - 1e-300).hex()]
        report = checker.check_documents(plant, spoiled)
        assert report.verdict == "malformed"
        assert key in report.failures[0]


@pytest.mark.parametrize("case", ["tank", "passed"])
def test_half_the_gains_are_refused(designs, case: str) -> None:
    design = designs(case)
    half = tuple(replace(s, k=0.5 * s.k, M=0.5 * s.M, c=0.5 * s.c) for s in design.gains)
    report = answer(design, gains=half)
    assert report.verdict in ("refuted", "undecided")
    assert any(name.startswith(("U1", "U2")) for name in failed(report))


@pytest.mark.parametrize(
    ("case", "parameters"),
    [
        ("pendulum", {"a": ["0.8", "1.2"], "max_drag": ["0.05", "0.25"]}),
        ("tank", {"a": ["0.8", "1.2"]}),
        ("passed", {"a": ["0.8", "1.2"]}),
    ],
)
def test_twice_the_declared_error_refuses_the_same_gains(designs, case, parameters) -> None:
    report = answer(designs(case), parameters=parameters)
    assert report.verdict in ("refuted", "undecided")
    assert any(name.startswith(("U1", "U2")) for name in failed(report))


def test_what_f_leaves_out_stays_in_the_residual(designs) -> None:
    design = designs("tank")
    plant, made = documents(design)
    for force in ("-a*x1**2 - 0.3*x1*abs(x1)", "-a*x1**2"):
        dynamics = copy.deepcopy(plant["plant"]["dynamics"])
        dynamics["x1"]["f"] = force
        other, again = documents(design, dynamics=dynamics)
        report = checker.check_documents(other, again)
        assert report.verdict == ("proved" if "abs" not in force else "undecided"), report.failures
        # The certificate that leaves the term out says nothing about the plant that has it.
        if "abs" not in force:
            assert checker.check_documents(plant, again).verdict != "proved"
    table = checker.read_design(made["design"]).obligations(plant).enclosures
    reach = checker.to_doubles(table["X[x1]"])[1]
    assert checker.to_doubles(table["left_out[x1]"])[1] == pytest.approx(0.1 * reach**2, rel=1e-9)


@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_another_duration_is_not_the_files(designs, factor: float) -> None:
    design = designs("tank")
    report = answer(design, T_s=0.01 * factor)
    assert report.verdict != "proved"
    assert "fixed" in failed(report)
    plant, made = documents(design)
    made["design"]["T_s"] = (0.01 * factor).hex()
    assert checker.check_documents(plant, made).verdict != "proved"


def test_a_free_duration_is_proved_for_the_one_that_is_stated(designs) -> None:
    design = designs("tank")
    free = {"accuracy": "0.1"}
    plant, made = documents(design, performance=free)
    assert checker.check_documents(plant, made).verdict == "proved"
    made["design"]["T_s"] = (0.005).hex()
    assert checker.check_documents(plant, made).verdict != "proved"
    # A shorter way to the reference moves faster: these gains do not bear it.
    report = answer(design, performance=free, T_s=0.005)
    assert report.verdict in ("refuted", "undecided")
    assert any(name.startswith(("U1", "U2")) for name in failed(report))


@pytest.mark.parametrize("duration", [0.0, -2.0, 1e-7, 2e6])
def test_a_duration_out_of_range_is_malformed(designs, duration: float) -> None:
    plant, made = documents(designs("pendulum"))
    made["design"]["T_s"] = duration.hex()
    assert checker.check_documents(plant, made).verdict == "malformed"


def test_a_duration_belongs_to_center_nominal_only(designs) -> None:
    plant, made = documents(designs("pendulum"))
    without = copy.deepcopy(made)
    del without["design"]["T_s"]
    assert checker.check_documents(plant, without).verdict == "malformed"
    plant["plant"]["synthesis"]["center"] = "performance"
    assert checker.check_documents(plant, made).verdict == "malformed"


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({"reference": {"value": "0.5*sin(t)", "bound": "1", "rate": "1"}}, "malformed"),
        ({"reference": {"bounds": ["1", "1", "1"]}}, "malformed"),
        ({"synthesis": {"center": "nominal", "method": "theorem2"}}, "malformed"),
        ({"synthesis": {"center": "nominal", "anchor": "exact"}}, "malformed"),
        ({"synthesis": {"center": "nominal", "bounds": "tight"}}, "malformed"),
        ({"performance": {"accuracy": "0.1", "funnel": "x1"}}, "malformed"),
        ({"performance": {"accuracy": "0.1", "transition": "2", "funnel": "1 + t"}}, "undecided"),
        ({"performance": {"accuracy": "0.1", "transition": "2", "funnel": "0.1"}}, "refuted"),
        ({"reference": "abs(sin(t))"}, "undecided"),
        ({"reference": "max(sin(t), 0)"}, "undecided"),
        pytest.param({"reference": "sin(t) + sin(pi*t)"}, "refuted", marks=pytest.mark.full),
        ({"reference": "sin(t**2)"}, "undecided"),
        pytest.param({"reference": "0.1*t"}, "undecided", marks=pytest.mark.full),
        ({"initial": {"x1": ["-2", "2"], "x2": "0"}}, "undecided"),
    ],
)
def test_a_plant_that_center_nominal_cannot_follow_is_refused(designs, changes, verdict) -> None:
    report = answer(designs("pendulum"), **changes)
    assert report.verdict == verdict, report.failures


@pytest.mark.parametrize(
    ("gain", "verdict"),
    [
        ("2 + abs(x1 + 2)", "undecided"),
        ("2 + abs(x1)", "center"),
        ("max(2, x1)", "center"),
        ("2 + sign(x1)", "center"),
        ("x1", "center"),
    ],
)
def test_a_gain_with_a_kink_on_the_way_has_no_center(designs, gain: str, verdict: str) -> None:
    design = designs("pendulum")
    plant, _ = documents(design)
    plant["plant"]["dynamics"]["x2"]["g"] = gain
    problem = checker.read_plant(plant)
    if verdict == "center":
        with pytest.raises(checker.UndecidedError):
            checker.nominal_center(problem, 2)
    else:
        assert checker.nominal_center(problem, 2).following is not None


def test_a_parameter_whose_name_begins_like_a_function_stays_in_f(designs) -> None:
    plant, _ = documents(designs("pendulum"))
    model = checker.follower(checker.read_plant(plant), checker.Fraction(2))
    assert "x2" in model.f[1].text
    assert "max_drag" in model.smooth[1].text
    assert model.left[1].text == "-1/10*signed2(x2)" or "signed2" in model.left[1].text


def test_a_reference_passed_at_run_time_is_assumed_to_obey_all_of_its_bounds(designs) -> None:
    report = answer(designs("passed"))
    assert any(
        "derivatives exist, are passed exactly, and obey 1.0" in a for a in report.assumptions
    )
    for short in (["1"], ["1", "1"]):
        assert answer(designs("passed"), reference={"bounds": short}).verdict == "malformed"
    wider = answer(designs("passed"), reference={"bounds": ["1", "2", "1"]})
    assert wider.verdict in ("refuted", "undecided")


# --- folders ----------------------------------------------------------------------------------


@pytest.fixture(autouse=True, scope="module")
def _remember_what_was_derived() -> Iterator[None]:
    """Most of these tests change a file that nothing is derived from."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("derive", "screening_limits"):
            patch.setattr(checker, name, remembering(getattr(checker, name)))
        yield


def remembering(function: Callable[..., Any]) -> Callable[..., Any]:
    known: dict[str, Any] = {}

    def remembered(*args: Any, **named: Any) -> Any:
        key = repr((args, named))
        if key not in known:
            known[key] = function(*args, **named)
        return known[key]

    return remembered


@pytest.fixture
def verify(designs, tmp_path: Path) -> Callable[..., checker.Report]:
    """Write a folder with some changes, its manifest made anew, and check it."""

    def run(case: str, name: str = "", *changes: tuple[str, str]) -> checker.Report:
        design = designs(case)
        law, provenance = build_law(design), make_provenance(design)
        texts = {
            "plant.yaml": design.spec.source,
            "plant.json": plant_json(design.spec),
            "certificate.json": design.certificate.document,
            "controller.py": render_controller(law, provenance),
            **render_c(law, provenance),
        }
        for old, new in changes:
            assert old in texts[name], old
            texts[name] = texts[name].replace(old, new, 1)
        for path, text in texts.items():
            (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / path).write_text(text, encoding="utf-8")
        hashes = {
            path: hashlib.sha256(text.encode()).hexdigest() for path, text in sorted(texts.items())
        }
        manifest = {
            "format": "bfppc-synth/manifest/1",
            "name": design.spec.name,
            "status": "certified",
            "files": hashes,
        }
        (tmp_path / "manifest.json").write_text(json.dumps(manifest))
        return checker.verify_folder(tmp_path)

    return run


@pytest.mark.parametrize("case", sorted(PLANTS))
def test_an_untouched_folder_is_proved(verify, case: str) -> None:
    report = verify(case)
    assert report.failures == ()
    assert report.verdict == "proved"
    assert "200 commands" in report.tests[-1]


@pytest.mark.parametrize(
    ("name", "constant"),
    [
        ("controller.py", ("T_s = 2.0", "T_s = 2.0000000001")),
        ("c/src/pendulum.c", ("pendulum_T_s = 2.0;", "pendulum_T_s = 2.0000000001;")),
        ("controller.py", ("T_s = 2.0\n", "")),
    ],
)
def test_another_duration_in_the_code_is_refused(verify, name: str, constant) -> None:
    report = verify("pendulum", name, constant)
    assert report.verdict == "malformed"
    assert "T_s" in report.failures[0]


CHANGES = [
    # The sign of v, or of the feedback; v or the feedback left out.
    ("u = v - phi_2", "u = -v - phi_2"),
    ("u = v - phi_2", "u = v + phi_2"),
    ("u = v - phi_2", "u = -phi_2"),
    ("u = v - phi_2", "u = v"),
    # The latch: dropped, its start taken as 0, or its numbers exchanged.
    ("self._b_0 = b_0 = start_1", "b_0 = start_1"),
    ("self._b_1 = b_1 =", "b_1 ="),
    ("self._started = True", "self._started = False"),
    ("b_1 = self._b_1", "b_1 = self._b_0"),
    # The transition: another coefficient, over too early or never.
    ("(4.0 * start_1)", "(4.001 * start_1)"),
    ("(-4.0) * center_4", "(-3.0) * center_4"),
    ("(6.0 * center_3)", "(6.01 * center_3)"),
    ("(T_s * T_s)", "T_s"),
    ("elapsed if elapsed < T_s else T_s", "T_s"),
    ("elapsed if elapsed < T_s else T_s", "elapsed"),
    # The reference and the model: a derivative, a parameter that is not in its middle.
    ("y_1 = cos(elapsed) / 2.0", "y_1 = -cos(elapsed) / 2.0"),
    ("y_2 + center_8", "y_2 - center_8"),
    ("sin(r_1)", "sin(r_2)"),
    ("0.15", "0.16"),
    ("cos(r_1) + 2.0", "cos(r_1) + 2.001"),
    ("r_2 = y_1 +", "r_2 = 1.001 * y_1 +"),
]


@pytest.mark.parametrize("change", CHANGES, ids=range(len(CHANGES)))
def test_a_changed_center_is_refused_although_every_constant_is_right(verify, change) -> None:
    report = verify("pendulum", "controller.py", change)
    assert report.verdict == "malformed"
    assert "controller.py" in report.failures[0]


@pytest.mark.parametrize("case", ["tank", "passed"])
def test_a_short_transition_is_sampled_too(verify, designs, case: str) -> None:
    text = render_controller(build_law(designs(case)), make_provenance(designs(case)))
    line = next(line for line in text.splitlines() if "center_1 = 1.0 - " in line)
    # Right at the start, where b is what is latched, and from T_s on, where it is 0.
    between = line.replace("= 1.0 - ", "= 1.0 - 1.1 * ") + "\n        center_1 = max(center_1, 0.0)"
    between = between.replace("max(center_1, 0.0)", "center_1 if center_1 > 0.0 else 0.0")
    report = verify(case, "controller.py", (line, between))
    assert report.verdict == "malformed"
    assert "not the certified law" in report.failures[0]
