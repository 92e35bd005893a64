"""A funnel that the file's own numbers contradict, and certificates that claim another one."""

from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING, Any

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.errors import NoDesignError, PlantFileError
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.gains.funnel import longest_kept
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.prepare import prepare
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bfppc_synth.model.spec import PlantSpec

FORCED = """\
name: forced
states: [x1]
dynamics: {x1: {f: 0.2*sin(x1)}}
reference: REFERENCE
initial: {x1: [0.4, 0.5]}
performance: {accuracy: 0.1, RHOfunnel: "FUNNEL"}
measurement: {noise: 0.01}
synthesis: {SYNTHESIS}
"""
RATE = "rho: {kind: exponential, rate: 1}, "
# a_0 + delta_0 = 0.51: from 0.5 and the noise 0.01.
STARTS = "0.51*exp(-t)"


def written(
    funnel: str, *, rho: str = RATE, synthesis: str = "center: performance", reference: str = "0"
) -> str:
    text = FORCED.replace("FUNNEL", funnel).replace("RHO", rho)
    return text.replace("SYNTHESIS", synthesis).replace("REFERENCE", reference)


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., PlantSpec]:
    def run(funnel: str, **chosen: str) -> PlantSpec:
        path = tmp_path / "plant.yaml"
        path.write_text(written(funnel, **chosen), encoding="utf-8")
        return load_spec(path)

    return run


def refusal(spec: PlantSpec) -> str:
    with pytest.raises(PlantFileError) as caught:
        prepare(spec)
    (mistake,) = caught.value.mistakes
    assert mistake.path == "performance.funnel"
    assert spec.source.splitlines()[mistake.line - 1][mistake.column - 1 :].startswith('"')
    return f"{mistake.message}; fix: {mistake.fix}"


@pytest.mark.parametrize(
    ("funnel", "synthesis"),
    [
        (f"0.1 + {STARTS}", "center: performance"),
        (f"0.1 + {STARTS}", "center: performance, anchor: exact"),
        ("max(0.15, 0.7 - 0.2*t)", "center: performance"),
        ("min(3 - t/(1 + t), 0.7)", "center: performance"),
    ],
)
def test_a_funnel_wide_enough_is_certified(read, funnel: str, synthesis: str) -> None:
    design = synthesize(read(funnel, synthesis=synthesis))
    design.certificate.require()
    (entry,) = (e for e in design.certificate.inequalities if e.id == "funnel")
    assert entry.holds
    assert entry.lhs[0] >= entry.rhs[0] * (1.0 - 1e-12)


@pytest.mark.parametrize(
    ("funnel", "words"),
    [
        # Narrower than the start by a thousandth: t = 0, and 0.61 in front of 0.609.
        ("0.109 + 0.5*exp(-t)", ["0.609 at t = 0 s", "0.61 there", "raise it"]),
        (f"0.1 + {STARTS.replace('-t', '-2*t')}", ["t = 0.69", "accuracy", "faster rho"]),
        (f"0.0999 + {STARTS}", ["0.0999", "below the accuracy 0.1", "at or above 0.1"]),
        ("0.3 + 0.4*cos(t)", ["-0.1 at t = 3.14", "below the accuracy 0.1"]),
        ("0.7 + 0.1*t", ["no bound for all t", "settles"]),
        ("log(t)", ["no bound for all t", "settles"]),
        ("Piecewise((1, t < 2), (0.2, True))", ["no bound for all t", "settles"]),
    ],
)
def test_a_funnel_that_the_file_contradicts_is_refused_with_both_numbers(
    read, funnel: str, words: list[str]
) -> None:
    said = refusal(read(funnel))
    for word in words:
        assert word in said, said


def test_the_fix_of_a_funnel_does_it(read) -> None:
    narrow = "0.1 + 0.51*exp(-2*t)"
    said = refusal(read(narrow))
    raised = said.partition("raise it by ")[2].partition(",")[0]
    synthesize(read(f"{narrow} + {raised}")).certificate.require()
    assert "raise it" in refusal(read(f"{narrow} + {0.97 * float(raised)}"))


@pytest.mark.parametrize("method", ["theorem2", "theorem1"])
def test_other_methods_prove_the_funnel_too(tmp_path: Path, method: str) -> None:
    text = FORCED.replace("REFERENCE", "0").replace("RHO", RATE)
    text = text.replace("SYNTHESIS", f"center: performance, method: {method}").replace(
        "noise: 0.01", "noise: 0"
    )
    path = tmp_path / "plant.yaml"
    path.write_text(text.replace("FUNNEL", "0.1 + 0.5*exp(-t)"), encoding="utf-8")
    design = synthesize(load_spec(path))
    design.certificate.require()
    assert any(entry.id == "funnel" for entry in design.certificate.inequalities)
    path.write_text(text.replace("FUNNEL", "0.1 + 0.49*exp(-t)"), encoding="utf-8")
    assert "raise it by" in refusal(load_spec(path))


NOMINAL = {"synthesis": "center: nominal", "reference": "sin(t)"}


def test_a_given_transition_that_leaves_the_funnel_names_one_that_keeps_it(read) -> None:
    said = refusal(read("0.1 + 0.6*exp(-t)", rho="transition: 6, ", **NOMINAL))
    assert "with T_s = 6 s" in said
    kept = said.partition("`transition: ")[2].partition("`")[0]
    assert 1.0 < float(kept) < 6.0
    synthesize(
        read("0.1 + 0.6*exp(-t)", rho=f"transition: {kept}, ", **NOMINAL)
    ).certificate.require()
    longer = f"transition: {1.05 * float(kept)}, "
    assert "with T_s" in refusal(read("0.1 + 0.6*exp(-t)", rho=longer, **NOMINAL))


def test_a_free_transition_stays_in_the_funnel(read) -> None:
    design = synthesize(read("0.1 + 0.6*exp(-5*t)", rho="", **NOMINAL))
    design.certificate.require()
    assert design.nominal is not None
    assert design.nominal.transition <= longest_kept(design.plant, 32.0) < 1.0
    assert longest_kept(build_plant(read("2", rho="", **NOMINAL)), 32.0) == 32.0


def test_without_a_transition_that_keeps_the_funnel_the_nearest_miss_is_told(tmp_path) -> None:
    text = FORCED.replace("[x1]", "[x1, x2]").replace("sin(x1)}}", "sin(x1)}, x2: {f: 0}}")
    # The start moves away from the reference, and the funnel is no wider than the start.
    text = text.replace("x1: [0.4, 0.5]", "x1: 0.5, x2: 2").replace("RHO", "")
    text = text.replace("REFERENCE", "0").replace("SYNTHESIS", "center: nominal")
    path = tmp_path / "plant.yaml"
    path.write_text(text.replace("FUNNEL", "0.1 + 0.51*exp(-t)"), encoding="utf-8")
    with pytest.raises(NoDesignError) as caught:
        prepare(load_spec(path))
    said = str(caught.value)
    assert "no transition from" in said
    assert "nearest miss: with T_s" in said
    raised = said.partition("a funnel higher by ")[2].partition(" ")[0]
    path.write_text(text.replace("FUNNEL", f"0.1 + {raised} + 0.51*exp(-t)"), encoding="utf-8")
    assert longest_kept(build_plant(load_spec(path)), 32.0) < 32.0


def test_a_start_outside_the_funnel_is_a_mistake_for_any_transition(read) -> None:
    assert "0.6 at t = 0 s" in refusal(read("0.6*exp(-t) + 0.1*tanh(t)", rho="", **NOMINAL))


# --- certificates -----------------------------------------------------------------------------

Documents = tuple[dict[str, Any], dict[str, Any]]


@pytest.fixture(scope="module", params=["performance", "nominal"])
def made(request: pytest.FixtureRequest, tmp_path_factory) -> Documents:
    chosen = {"rho": "transition: 1, ", **NOMINAL} if request.param == "nominal" else {}
    path = tmp_path_factory.mktemp("made") / "plant.yaml"
    path.write_text(written("0.1 + 0.6*exp(-t)", **chosen), encoding="utf-8")
    design = synthesize(load_spec(path))
    design.certificate.require()
    return json.loads(plant_json(design.spec)), json.loads(design.certificate.document)


@pytest.fixture
def documents(made: Documents) -> Documents:
    return copy.deepcopy(made)


def test_the_documents_are_proved_by_themselves(documents: Documents) -> None:
    report = checker.check_documents(*documents)
    assert report.verdict == "proved"
    (claim,) = (entry for entry in report.claims if entry.id == "funnel")
    assert "funnel(t) for all t >= 0" in claim.statement


def again(plant: dict[str, Any], certificate: dict[str, Any]) -> checker.Report:
    """Make the certificate anew for a changed plant: nothing in it is stale."""
    design = checker.read_design(certificate["design"])
    derived = design.obligations(plant)
    for claim, obligation in zip(certificate["claims"], derived.claims, strict=True):
        first = obligation.comparisons[0] if obligation.comparisons else None
        if first:
            claim["lhs"], claim["rhs"] = checker.hex_pair(first.lhs), checker.hex_pair(first.rhs)
    return checker.check_documents(plant, certificate)


@pytest.mark.parametrize(
    "funnel",
    ["0.1 + 0.4*exp(-t)", "0.0999999999 + 0.6*exp(-t)", "0.1 + 0.6*exp(-9*t)", "0.1", "0"],
)
def test_a_narrower_funnel_is_refuted_for_the_same_design(
    documents: Documents, funnel: str
) -> None:
    plant, certificate = documents
    plant["plant"]["performance"]["funnel"] = funnel
    stale = checker.check_documents(plant, copy.deepcopy(certificate))
    assert (stale.verdict, [c.id for c in stale.claims if c.verdict != "proved"]) == (
        "refuted",
        ["funnel"],
    )
    assert again(plant, certificate).verdict == "refuted"


def test_a_dropped_claim_is_missed(documents: Documents) -> None:
    plant, certificate = documents
    kept = [claim for claim in certificate["claims"] if claim["id"] != "funnel"]
    assert len(kept) == len(certificate["claims"]) - 1
    report = checker.check_documents(plant, {**certificate, "claims": kept})
    assert report.verdict == "undecided"
    assert any(failure.startswith("funnel: undecided") for failure in report.failures)


def test_a_claim_without_a_funnel_in_the_plant_is_malformed(documents: Documents) -> None:
    plant, certificate = documents
    del plant["plant"]["performance"]["funnel"]
    assert checker.check_documents(plant, certificate).verdict == "malformed"


@pytest.mark.parametrize("side", ["lhs", "rhs"])
def test_stated_numbers_of_the_funnel_are_compared(documents: Documents, side: str) -> None:
    plant, certificate = documents
    claim = next(claim for claim in certificate["claims"] if claim["id"] == "funnel")
    claim[side] = ["0x1.0p-3", "0x1.0p-3"]
    assert checker.check_documents(plant, certificate).verdict == "malformed"


@pytest.mark.parametrize("uses", [[], ["fixed"], ["accuracy", "accuracy"]])
def test_the_funnel_rests_on_the_accuracy(documents: Documents, uses: list[str]) -> None:
    plant, certificate = documents
    claim = next(claim for claim in certificate["claims"] if claim["id"] == "funnel")
    claim["uses"] = uses
    assert checker.check_documents(plant, certificate).verdict == "malformed"


@pytest.mark.parametrize("funnel", ["1 + t", "sign(t)", "Piecewise((1, t < 1), (2, True))", "1/t"])
def test_a_funnel_without_an_enclosure_is_undecided(documents: Documents, funnel: str) -> None:
    plant, certificate = documents
    plant["plant"]["performance"]["funnel"] = funnel
    assert checker.check_documents(plant, certificate).verdict == "undecided"


def test_a_start_that_fades_more_slowly_leaves_the_funnel(documents: Documents) -> None:
    plant, certificate = documents
    if "T_s" not in certificate["design"]:
        plant["plant"]["performance"]["rho"]["rate"] = "0.25"
    else:
        plant["plant"]["performance"]["transition"] = "8"
        certificate["design"]["T_s"] = (8.0).hex()
    claims = checker.read_design(certificate["design"]).obligations(plant).claims
    (funnel,) = (claim for claim in claims if claim.id == "funnel")
    assert [comparison.verdict() for comparison in funnel.comparisons] == ["refuted"]
