"""Every part of a valid certificate, and every number of its plant, spoiled in turn."""

from __future__ import annotations

import copy
import re
from typing import TYPE_CHECKING, Any

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import judge, produce_certificate
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.shapes import Shape

if TYPE_CHECKING:
    from collections.abc import Iterator

SHA = "ab" * 32


def shape(k: float, M: float = 0.0, epsilon: float = 1.0, c: float = 0.0) -> Shape:
    return Shape(k=k, M=M, epsilon=epsilon, c=c, N=3)


def document(**plant: Any) -> dict[str, Any]:
    return {"format": checker.PLANT_FORMAT, "plant_sha256": SHA, "plant": plant}


TRACKING = (
    document(
        name="tracking",
        parameters={"a": "0.5", "d": ["0.9", "1.1"]},
        states=["x1", "x2"],
        dynamics={
            "x1": {
                "f": "x1 + x1*exp(-a*x1)",
                "g": "1 + sin(x1**2)",
                "f_bound": "Abs(x1) + Abs(x1)*exp(a*Abs(x1))",
                "g_bound": "2",
                "g_min": "1",
            },
            "x2": {"f": "d*x1*sin(x2) + x1*x2**2", "g": "3 + cos(x1)", "disturbance": "0.1"},
        },
        reference="sin(t)",
        initial={"x1": "0.5", "x2": ["-0.1", "0.1"]},
        performance={"accuracy": "0.05", "rho": {"kind": "cosine", "t_s": "1"}},
        measurement={"quantizer": {"kind": "uniform", "step": "0.0001"}, "noise": "0.00001"},
        sampling={"period": "0.000001", "delay": "0.0000001"},
        actuator={"limit": "40000", "error": "0.5"},
        simulation={"horizon": "10", "period": "0.001", "seed": "1"},
    ),
    (shape(2.0, 13.4, 0.5, 0.1), shape(8000.0)),
    (0.05, 2.0),
)
CONTINUOUS = (
    document(
        name="continuous",
        states=["x1", "x2"],
        dynamics={
            "x1": {"f": "x1**2 - sin(x1)", "f_bound": "x1**2 + 1"},
            "x2": {"f": "x1*x2**2"},
        },
        initial={"x1": "1", "x2": "0"},
        performance={"accuracy": "0.15"},
        synthesis={"method": "theorem2", "gains": {"x1": {"k": "40"}}, "p": {"x2": "2"}},
    ),
    (shape(40.0), shape(300.0, 10.0, 0.5)),
    (0.15, 2.0),
)
# x^2 + 1 >= 2x touches at x = 1: it takes a tree, and near the touching point room of 1e-3.
BISECTED = (
    document(
        name="bisected",
        states=["x1"],
        dynamics={"x1": {"f": "2*x1*cos(x1/8)", "f_bound": "x1**2 + 1.001", "g": "2 + x1/10"}},
        initial={"x1": ["-1", "1"]},
        performance={"accuracy": "0.5", "rho": {"kind": "exponential", "rate": "1"}},
    ),
    (shape(40.0),),
    (0.5,),
)
# Numbers that may change without touching what is claimed: a simulation, an end of a range whose
# other end is the worse one, an f or g that stays within its declared bounds.
HARMLESS = {
    "tracking": {
        *("parameters.d.0", "dynamics.x1.g"),
        *("simulation.horizon", "simulation.period", "simulation.seed"),
    },
    "continuous": set(),
    "bisected": {"dynamics.x1.f"},
}
DESIGNS = {"tracking": TRACKING, "continuous": CONTINUOUS, "bisected": BISECTED}


@pytest.fixture(autouse=True, scope="module")
def _remember_what_was_derived() -> Iterator[None]:
    """Deriving depends on plant and design only; most of these tests spoil something else."""
    derive = checker.derive
    known: dict[str, Any] = {}

    def remembered(*given: Any) -> Any:
        key = repr(given)
        if key not in known:
            known[key] = derive(*given)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(checker, "derive", remembered)
        yield


@pytest.fixture(scope="module", params=sorted(DESIGNS))
def proved(request: pytest.FixtureRequest) -> tuple[dict[str, Any], dict[str, Any]]:
    plant, shapes, half_widths = DESIGNS[request.param]
    certificate = produce_certificate(plant, shapes, half_widths, tool="test")
    assert checker.check_documents(plant, certificate).verdict == "proved"
    return plant, certificate


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    if isinstance(value, dict):
        for key in sorted(value):
            yield from leaves(value[key], (*path, key))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from leaves(item, (*path, index))
    else:
        yield path, value


def changed(value: Any, path: tuple[Any, ...], new: Any) -> Any:
    spoiled = copy.deepcopy(value)
    place = spoiled
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = new
    return spoiled


def without(value: Any, path: tuple[Any, ...]) -> Any:
    spoiled = copy.deepcopy(value)
    place = spoiled
    for key in path[:-1]:
        place = place[key]
    del place[path[-1]]
    return spoiled


def spoil(value: Any) -> list[Any]:
    if isinstance(value, int):
        return [value + 1, str(value), float(value)]
    if re.fullmatch(r"-?0x[0-9a-f.]+p[-+][0-9]+", value):
        number = float.fromhex(value)
        return [
            (number * 0.5 or 1.0).hex(),
            (number * 2.0 + 3.0 * (number < 0) + 1.0).hex(),
            "nan",
            number,
        ]
    return [value + "x", "", None, 0]


def certificate_gain(certificate: dict[str, Any], path: tuple[Any, ...]) -> str:
    return str(certificate["design"]["gains"][path[2]]["M"])


def verdict(plant: Any, certificate: Any) -> str:
    return checker.check_documents(plant, certificate).verdict


def test_each_field_spoiled_is_refused(proved: tuple[Any, Any]) -> None:
    plant, certificate = proved
    tried = 0
    for path, value in leaves(certificate):
        # Every entry of a long tree is like its neighbours.
        if path[-1] not in range(12) and "trees" in path:
            continue
        for new in spoil(value):
            if path == ("tool",) and isinstance(new, str):
                continue
            if path[-1] == "epsilon" and float.fromhex(certificate_gain(certificate, path)) == 0:
                # Without tanh there is no epsilon in phi: every claim stays true.
                continue
            assert verdict(plant, changed(certificate, path, new)) != "proved", (path, new)
            tried += 1
    assert tried > 100


def test_the_name_of_the_tool_is_free_text(proved: tuple[Any, Any]) -> None:
    plant, certificate = proved
    assert verdict(plant, changed(certificate, ("tool",), "another tool 7.1")) == "proved"


def test_each_field_left_out_is_refused(proved: tuple[Any, Any]) -> None:
    plant, certificate = proved
    for path, _ in leaves(certificate):
        for end in range(1, len(path) + 1):
            assert verdict(plant, without(certificate, path[:end])) != "proved", path[:end]


def test_each_claim_deleted_is_named(proved: tuple[Any, Any]) -> None:
    plant, certificate = proved
    for index, claim in enumerate(certificate["claims"]):
        report = checker.check_documents(plant, without(certificate, ("claims", index)))
        assert report.verdict == "undecided"
        assert report.exit_code == 4
        named = [failure for failure in report.failures if failure.startswith(f"{claim['id']}:")]
        assert len(named) == 1
        assert "no proof is given" in named[0]


def test_no_claims_at_all_names_every_obligation(proved: tuple[Any, Any]) -> None:
    plant, certificate = proved
    report = checker.check_documents(plant, {**certificate, "claims": []})
    assert [line.partition(":")[0] for line in report.failures] == [
        claim["id"] for claim in certificate["claims"]
    ]


def test_each_number_of_the_plant_spoiled_is_refused_or_leaves_the_claims_true(
    proved: tuple[Any, Any],
) -> None:
    plant, certificate = proved
    harmless: set[str] = set()
    tried = 0
    for path, text in leaves(plant["plant"]):
        for match in re.finditer(r"(?<![A-Za-z_0-9])[0-9]+\.?[0-9]*", str(text)):
            for factor in (1.25, 0.8):
                number = repr(float(match[0]) * factor) if float(match[0]) else "0.05"
                new = text[: match.start()] + number + text[match.end() :]
                spoiled = changed(plant, ("plant", *path), new)
                tried += 1
                if verdict(spoiled, certificate) == "proved":
                    harmless.add(".".join(map(str, path)))
                    design = DESIGNS[plant["plant"]["name"]]
                    again = produce_certificate(spoiled, design[1], design[2], tool="test")
                    assert judge(spoiled, again).verdict is Verdict.CERTIFIED
                    assert again["enclosures"] == certificate["enclosures"]
    assert tried > 10
    assert harmless == HARMLESS[plant["plant"]["name"]]


@pytest.mark.parametrize("name", sorted(DESIGNS))
@pytest.mark.parametrize("factor", [0.5, 0.1])
def test_weakened_gains_are_refused(name: str, factor: float) -> None:
    plant, shapes, half_widths = DESIGNS[name]
    plant = copy.deepcopy(plant)
    plant["plant"].get("synthesis", {}).pop("gains", None)
    # A tanh keeps its shape if epsilon shrinks with M.
    weak = tuple(
        Shape(k=s.k * factor, M=s.M * factor, epsilon=s.epsilon, c=s.c * factor, N=s.N)
        for s in shapes
    )
    if name == "tracking" and factor == 0.5:
        weak = (weak[0], shape(1500.0))
    answer = judge(plant, produce_certificate(plant, weak, half_widths, tool="test"))
    if name == "bisected" and factor == 0.5:
        assert answer.verdict is Verdict.CERTIFIED
    else:
        assert answer.verdict is Verdict.REFUTED
        assert any(line.startswith(("U1", "U2", "T2")) for line in answer.failures)


def test_uses_in_another_order_are_refused(proved: tuple[Any, Any]) -> None:
    plant, certificate = proved
    tried = 0
    for index, claim in enumerate(certificate["claims"]):
        if len(claim["uses"]) < 2:
            continue
        uses = list(reversed(claim["uses"]))
        report = checker.check_documents(
            plant, changed(certificate, ("claims", index, "uses"), uses)
        )
        assert report.verdict == "malformed"
        tried += 1
    assert tried > 0 or plant["plant"]["name"] == "continuous"


def test_a_claim_that_uses_a_later_one_is_refused(proved: tuple[Any, Any]) -> None:
    plant, certificate = proved
    backwards = {**certificate, "claims": list(reversed(certificate["claims"]))}
    report = checker.check_documents(plant, backwards)
    assert report.verdict == "malformed"
    assert "which is not before it" in report.failures[0]


def test_claims_that_use_each_other_are_refused(proved: tuple[Any, Any]) -> None:
    plant, certificate = proved
    first, last = certificate["claims"][0], certificate["claims"][-1]
    cyclic = copy.deepcopy(certificate)
    cyclic["claims"][0]["uses"] = [last["id"]]
    cyclic["claims"][-1]["uses"] = [*last["uses"], first["id"]]
    assert verdict(plant, cyclic) == "malformed"


def test_the_certificate_of_another_plant_file_is_refused(proved: tuple[Any, Any]) -> None:
    plant, certificate = proved
    assert verdict({**plant, "plant_sha256": "cd" * 32}, certificate) == "malformed"


STRANGERS = (None, True, 1.5, "", [], {}, {"kind": []})


def containers(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    if isinstance(value, (dict, list)):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield (*path, key)
            yield from containers(item, (*path, key))


def test_strange_values_anywhere_are_answered_and_never_proved() -> None:
    plant, shapes, half_widths = DESIGNS["tracking"]
    certificate = produce_certificate(plant, shapes, half_widths, tool="test")
    # No claim is about these.
    free = {("plant", key) for key in ("name", "title", "units", "simulation")}
    tried = 0
    for path in containers(plant):
        if path[:2] in free:
            continue
        for stranger in STRANGERS:
            report = checker.check_documents(changed(plant, path, stranger), certificate)
            if report.verdict == "proved":
                # Left out or empty, an optional part means its default.
                assert stranger == {}, (path, stranger)
            tried += 1
    for path in containers(certificate):
        if path[:2] == ("enclosures",):
            continue
        for stranger in STRANGERS:
            if path == ("tool",) and isinstance(stranger, str):
                continue
            spoiled = changed(certificate, path, stranger)
            if spoiled != certificate:
                assert checker.check_documents(plant, spoiled).verdict != "proved", path
            tried += 1
    assert tried > 500
