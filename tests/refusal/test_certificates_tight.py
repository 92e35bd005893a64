"""Certificates of bounds tight with something false in them."""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING, Any

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import judge, produce_certificate
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.tight import TightBounds

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

SHA = "ab" * 32


def document(error: float = 0.1, **changes: Any) -> dict[str, Any]:
    """dx = z, dz = -a sin(x) - z/5 + 2 u with a known within 10 %."""
    plant = {
        "name": "swing",
        "parameters": {"a": [str(1 - error), str(1 + error)]},
        "states": ["x", "z"],
        "dynamics": {"x": {"f": "0"}, "z": {"f": "-a*sin(x) - 0.2*z", "g": "2"}},
        "reference": "sin(t)/2",
        "initial": {"x": "0.125", "z": "0"},
        "performance": {"accuracy": "0.1", "transition": "2"},
        "synthesis": {"center": "nominal", "bounds": "tight"},
        **changes,
    }
    return {"format": checker.PLANT_FORMAT, "plant_sha256": SHA, "plant": plant}


SHAPES = tuple(Shape(k=k, M=0.0, epsilon=1.0, c=0.0, N=3) for k in (0.5, 12.0))
WIDTHS = (0.1, 0.045)
# 2 % above the suprema 0.0851 and 0.1702; termwise it would be 0.1122 and 0.2244.
CLAIMS = TightBounds(load=(0.0, 0.0871), rate=0.1740)


def made(plant: dict[str, Any], claims: TightBounds = CLAIMS) -> dict[str, Any]:
    duration = 2.0 if plant["plant"]["synthesis"].get("center") == "nominal" else None
    return produce_certificate(
        plant, SHAPES, WIDTHS, tool="test", transition=duration, tight=claims
    )


@pytest.fixture(scope="module")
def valid() -> tuple[dict[str, Any], dict[str, Any]]:
    plant = document()
    return plant, made(plant)


def claim(certificate: dict[str, Any], name: str) -> dict[str, Any]:
    return next(entry for entry in certificate["claims"] if entry["id"] == name)


def test_the_certificate_is_proved_with_trees(valid: Any) -> None:
    plant, certificate = valid
    assert checker.check_documents(plant, certificate).verdict == "proved"
    for name in ("tight[z]", "tight.rate[z]"):
        assert claim(certificate, name)["proof"]["kind"] == "bisect"
    assert "tight[z]" in claim(certificate, "U2[z]")["uses"]
    assert "tight.rate[z]" in claim(certificate, "U2[z]")["uses"]


@pytest.mark.parametrize("factor", [0.9, 0.97])
@pytest.mark.parametrize("part", ["load", "rate"])
def test_a_claim_below_the_supremum_is_not_proved(part: str, factor: float) -> None:
    load, rate = CLAIMS.load, CLAIMS.rate
    below = TightBounds(
        load=(0.0, load[1] * factor if part == "load" else load[1]),
        rate=rate * factor if part == "rate" else rate,
    )
    plant = document()
    certificate = made(plant, below)
    report = checker.check_documents(plant, certificate)
    assert report.verdict in ("refuted", "undecided")
    name = "tight[z]" if part == "load" else "tight.rate[z]"
    assert [r.verdict for r in report.claims if r.id == name] != ["proved"]


def test_twice_the_parameter_error_is_not_proved_with_the_same_claims(valid: Any) -> None:
    plant = document(0.2)
    again = checker.check_documents(plant, made(plant))
    assert again.verdict in ("refuted", "undecided")
    assert checker.check_documents(plant, valid[1]).verdict != "proved"


def test_the_witness_of_a_false_claim_is_a_point_of_the_tube() -> None:
    plant = document()
    low = TightBounds(load=(0.0, CLAIMS.load[1] / 2), rate=CLAIMS.rate)
    report = checker.check_documents(plant, made(plant, low))
    result = next(r for r in report.claims if r.id == "tight[z]")
    witness = dict(result.witness)
    assert result.verdict == "refuted"
    assert {"e1", "e2", "a", "t"} <= set(witness)
    assert abs(witness["e1"]) <= 0.1
    assert 0.9 <= witness["a"] <= 1.1
    assert abs(abs(witness["e2"]) - 0.045) <= 1e-9


def spoiled_trees(tree: str) -> list[Any]:
    cut = tree.index(".")
    return [
        tree + ".",
        tree[:-1],
        "",
        tree[:cut] + "?" + tree[cut + 1 :],
        tree.replace("0", "z"),
        tree.replace(".", "0."),
        "." * 4001,
        "0" * 4000,
        [-1],
        None,
        7,
    ]


def test_every_spoiled_tree_is_refused(valid: Any) -> None:
    plant, certificate = valid
    trees = claim(certificate, "tight[z]")["proof"]["trees"]
    number = max(range(len(trees)), key=lambda j: len(trees[j]))
    for spoiled in spoiled_trees(trees[number]):
        again = copy.deepcopy(certificate)
        claim(again, "tight[z]")["proof"]["trees"][number] = spoiled
        assert checker.check_documents(plant, again).verdict != "proved", spoiled


def test_a_tree_with_too_few_cuts_is_not_proved(valid: Any) -> None:
    plant, certificate = valid
    again = copy.deepcopy(certificate)
    trees = claim(again, "tight[z]")["proof"]["trees"]
    number = max(range(len(trees)), key=lambda j: len(trees[j]))
    trees[number] = "."
    assert checker.check_documents(plant, again).verdict == "undecided"


def test_trees_that_would_keep_the_checker_busy_are_malformed(valid: Any) -> None:
    plant, certificate = valid
    again = copy.deepcopy(certificate)
    proof = claim(again, "tight.rate[z]")["proof"]
    # Each of the four is below the limit for one tree.
    proof["trees"] = ["0" * 3999] * len(proof["trees"])
    report = checker.check_documents(plant, again)
    assert report.verdict == "malformed"
    assert "12000 letters" in report.failures[0]


def swap(certificate: dict[str, Any]) -> None:
    tight = certificate["design"]["tight"]
    tight["load"][1], tight["rate"] = tight["rate"], tight["load"][1]


def drop(name: str) -> Callable[[dict[str, Any]], None]:
    def change(certificate: dict[str, Any]) -> None:
        certificate["claims"].remove(claim(certificate, name))

    return change


def unused(certificate: dict[str, Any]) -> None:
    claim(certificate, "U2[z]")["uses"].remove("tight[z]")


def eval_only(certificate: dict[str, Any]) -> None:
    claim(certificate, "tight.rate[z]")["proof"] = {"kind": "eval"}


def one_tree_less(certificate: dict[str, Any]) -> None:
    claim(certificate, "tight[z]")["proof"]["trees"].pop()


def one_tree_more(certificate: dict[str, Any]) -> None:
    claim(certificate, "tight[z]")["proof"]["trees"].append(".")


CHANGES = [swap, drop("tight[z]"), drop("tight[x]"), drop("tight.rate[z]"), unused]
CHANGES += [eval_only, one_tree_less, one_tree_more]


@pytest.mark.parametrize("change", CHANGES)
def test_claims_swapped_dropped_or_without_their_proof_are_refused(
    valid: Any, change: Callable[[dict[str, Any]], None]
) -> None:
    plant, certificate = valid
    again = copy.deepcopy(certificate)
    change(again)
    assert checker.check_documents(plant, again).verdict != "proved"


NUMBERS = ["nan", "inf", "-inf", "-0x0.0p+0", "0.0871", "0x1p+2000", "", None, 0.0871, True]


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("place", ["load", "rate"])
def test_a_number_that_is_none_is_malformed(valid: Any, place: str, number: object) -> None:
    plant, certificate = valid
    again = copy.deepcopy(certificate)
    if place == "rate":
        again["design"]["tight"]["rate"] = number
    else:
        again["design"]["tight"]["load"][0] = number
    assert checker.check_documents(plant, again).verdict == "malformed"


@pytest.mark.parametrize("loads", [[], ["0x0.0p+0"], ["0x0.0p+0"] * 3, "0x0.0p+0", None])
def test_as_many_loads_as_states_are_needed(valid: Any, loads: object) -> None:
    plant, certificate = valid
    again = copy.deepcopy(certificate)
    again["design"]["tight"]["load"] = loads
    assert checker.check_documents(plant, again).verdict == "malformed"


def test_other_numbers_than_the_proved_ones_are_refused(valid: Any) -> None:
    plant, certificate = valid
    for factor in (0.5, 0.999, 1.001, -1.0):
        again = copy.deepcopy(certificate)
        again["design"]["tight"]["load"][1] = (CLAIMS.load[1] * factor).hex()
        assert checker.check_documents(plant, again).verdict != "proved", factor


def test_a_negative_rate_is_not_proved() -> None:
    plant = document()
    certificate = made(plant, TightBounds(load=CLAIMS.load, rate=-1.0))
    assert checker.check_documents(plant, certificate).verdict in ("refuted", "undecided")


def test_tight_in_the_design_and_termwise_in_the_plant_file_do_not_go_together(
    valid: Any,
) -> None:
    plant, certificate = valid
    termwise = document(synthesis={"center": "nominal", "bounds": "termwise"})
    assert checker.check_documents(termwise, certificate).verdict == "malformed"
    plain = copy.deepcopy(certificate)
    del plain["design"]["tight"]
    assert checker.check_documents(plant, plain).verdict == "malformed"


@pytest.mark.parametrize("method", ["theorem2", "theorem1", "theorem3"])
def test_tight_is_refused_with_another_method(method: str) -> None:
    plant = document(synthesis={"method": method, "bounds": "tight"})
    with pytest.raises(checker.MalformedError, match="tight"):
        checker.read_plant(plant)


def changed(certificate: dict[str, Any], edits: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    again = copy.deepcopy(certificate)
    for key, value in edits:
        again["design"][key] = value
    return again


def test_claims_of_another_tube_are_refused(valid: Any) -> None:
    plant, certificate = valid
    wider = changed(certificate, [("p", [(0.1).hex(), (0.06).hex()])])
    assert checker.check_documents(plant, wider).verdict != "proved"
    gains = copy.deepcopy(certificate["design"]["gains"])
    gains[0]["k"] = (0.8).hex()
    steeper = changed(certificate, [("gains", gains)])
    assert checker.check_documents(plant, steeper).verdict != "proved"


def test_a_state_called_rate_has_two_claims() -> None:
    plant = document(
        states=["x", "rate"],
        dynamics={"x": {"f": "0"}, "rate": {"f": "-a*sin(x) - 0.2*rate", "g": "2"}},
        initial={"x": "0.125", "rate": "0"},
    )
    certificate = made(plant)
    names = [entry["id"] for entry in certificate["claims"]]
    assert {"tight[rate]", "tight.rate[rate]"} <= set(names)
    assert judge(plant, certificate).verdict is Verdict.CERTIFIED


def test_a_false_bound_is_found_although_its_largest_value_would_do() -> None:
    # |x| <= 0.3 + 0.5 x^2 is false at x = 0.5, but the residual takes it for the truth there.
    plant = {
        "name": "false_bound",
        "states": ["x"],
        "dynamics": {"x": {"f": "x", "f_bound": "0.3 + 0.5*x**2"}},
        "reference": "sin(t)",
        "initial": {"x": "0"},
        "performance": {"accuracy": "0.1"},
        "synthesis": {"bounds": "tight"},
    }
    whole = {"format": checker.PLANT_FORMAT, "plant_sha256": SHA, "plant": plant}
    shapes = (Shape(k=60.0, M=0.0, epsilon=1.0, c=0.0, N=3),)
    certificate = produce_certificate(
        whole, shapes, (0.1,), tool="test", tight=TightBounds(load=(1.6,), rate=1.6)
    )
    report = checker.check_documents(whole, certificate)
    assert report.verdict == "refuted"
    assert any(failure.startswith("f_bound[x]") for failure in report.failures)
    assert math.isfinite(report.enclosures["U"][1])
