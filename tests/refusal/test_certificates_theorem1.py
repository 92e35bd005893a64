"""Certificates of Theorem 1 with something false in them; docs/attacks.md, docs/theory.md 7."""

from __future__ import annotations

import copy
import hashlib
import json
from typing import TYPE_CHECKING, Any

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import judge, produce_certificate
from bfppc_synth.codegen.c import render_c
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

C_0 = 7.51e-06
HALF_WIDTHS = (0.15, 11.39)


def tall(gamma: float, *H: float, c: float = 0.0, N: int = 3) -> Theorem1Gain:
    return Theorem1Gain(gamma=gamma, H=H, H_star=H[0], c=c, N=N)


CONSTANT = (tall(33.58, 2.824), tall(0.5536, 3452.0))
SCHEDULED = (tall(35.36, 1.523, 1.3), tall(0.9398, 907.8, 3670.0))


def plant(**changes: Any) -> dict[str, Any]:
    """Example 1 of the paper, quantized; changes replace its parts."""
    keys: dict[str, Any] = {
        "name": "first",
        "states": ["x1", "x2"],
        "dynamics": {
            "x1": {"f": "x1**2 - sin(x1)", "f_bound": "x1**2 + 1"},
            "x2": {"f": "x1*x2**2"},
        },
        "initial": {"x1": "1", "x2": "0"},
        "performance": {"accuracy": "0.15"},
        "measurement": {"quantizer": {"kind": "uniform", "step": "0.1"}},
        "synthesis": {"method": "theorem1"},
    }
    keys.update(changes)
    return {"format": checker.PLANT_FORMAT, "plant_sha256": "ab" * 32, "plant": keys}


def certificate(
    gains: tuple[Theorem1Gain, ...] = CONSTANT,
    half_widths: tuple[float, ...] = HALF_WIDTHS,
    c_0: float = C_0,
    document: dict[str, Any] | None = None,
) -> dict[str, Any]:
    return produce_certificate(document or plant(), gains, half_widths, tool="test", c_0=c_0)


def answer(*args: Any, **keys: Any) -> checker.Report:
    return checker.check_documents(keys.get("document") or plant(), certificate(*args, **keys))


def failed(report: checker.Report) -> list[str]:
    return [failure.partition(":")[0] for failure in report.failures]


def test_the_design_that_is_attacked_is_proved_by_itself() -> None:
    report = answer()
    assert report.verdict == "proved"
    assert [claim.id for claim in report.claims if claim.id.startswith("T1")] == [
        f"T1.{name}[x{i}]" for i in (1, 2) for name in ("p", "H", "c", "gamma")
    ]
    assert any("rounding" in line and "theorem1" in line for line in report.assumptions)


def test_a_scheduled_design_is_proved_over_every_rho() -> None:
    report = answer(SCHEDULED, (0.15, 11.15), 7.506e-06)
    assert report.verdict == "proved"
    assert judge(plant(), certificate(SCHEDULED, (0.15, 11.15), 7.506e-06)).verdict is (
        Verdict.CERTIFIED
    )


@pytest.mark.parametrize(
    ("gains", "p", "c_0"),
    [(CONSTANT, HALF_WIDTHS, C_0), (SCHEDULED, (0.15, 11.15), 7.506e-06)],
    ids=["constant", "scheduled"],
)
def test_each_claim_deleted_is_named(gains: Any, p: Any, c_0: float) -> None:
    made = certificate(gains, p, c_0)
    for index, claim in enumerate(made["claims"]):
        fewer = {**made, "claims": made["claims"][:index] + made["claims"][index + 1 :]}
        report = checker.check_documents(plant(), fewer)
        assert report.verdict == "undecided"
        named = [line for line in report.failures if line.startswith(f"{claim['id']}:")]
        assert len(named) == 1
        assert "no proof is given" in named[0]


@pytest.mark.parametrize("step", [0, 1])
@pytest.mark.parametrize("gains", [CONSTANT, SCHEDULED], ids=["constant", "scheduled"])
def test_half_a_gamma_is_refuted(gains: tuple[Theorem1Gain, ...], step: int) -> None:
    g = gains[step]
    weak = (*gains[:step], tall(g.gamma / 2, *g.H), *gains[step + 1 :])
    report = answer(weak)
    assert report.verdict == "refuted"
    assert f"T1.gamma[x{step + 1}]" in failed(report)


# |x_1| <= 1.15 gives f_1* + rhoM |x_1(0)| = 2.8225 exactly.
@pytest.mark.parametrize(("height", "verdict"), [(2.8225005, "proved"), (2.8224995, "refuted")])
def test_a_height_lowered_by_1e_6_is_refuted(height: float, verdict: str) -> None:
    report = answer((tall(33.58, height), CONSTANT[1]))
    assert report.verdict == verdict
    assert failed(report) == ([] if verdict == "proved" else ["T1.H[x1]"])


def test_a_second_height_below_what_it_must_dominate_is_refuted() -> None:
    table = checker.read_design(certificate()["design"]).obligations(plant()).enclosures
    least = checker.to_doubles(table["H_needed[x2]"])[1]
    assert answer((CONSTANT[0], tall(0.5536, least + 1e-6))).verdict == "proved"
    assert failed(answer((CONSTANT[0], tall(0.5536, least - 1e-6)))) == ["T1.H[x2]"]


def test_a_height_that_is_too_low_between_its_ends_only_is_refuted() -> None:
    # 1.5225 + 0.3 rho + rho^2 is needed: 1.9225 at 1/2, where H is 1.6855, and less at the ends.
    dipping = tall(40.0, 1.523, 0.0, 0.0, 1.3)
    report = answer((dipping, tall(5.0, 1e5, 1e5)))
    assert report.verdict == "refuted"
    assert "T1.H[x1]" in failed(report)
    rising = tall(40.0, 1.53, 0.4, 1.0)
    assert "T1.H[x1]" not in failed(answer((rising, tall(5.0, 1e5, 1e5))))


def test_the_inequality_for_gamma_is_asked_at_both_ends_of_rho() -> None:
    # gamma eps < 1 and a large power: it holds at H(0) and not at H(1), as (39) overlooks.
    keys = {
        "states": ["x1"],
        "dynamics": {"x1": {"f": "0.1*x1**2"}},
        "initial": {"x1": "10"},
        "performance": {"accuracy": "1.01", "rho": {"kind": "cosine", "t_s": "100"}},
        "measurement": {"quantizer": {"kind": "uniform", "step": "0.01"}},
    }
    document = plant(**keys)
    made = tall(0.01, 1.1521, 2.03, 10.0, c=1.6177)
    report = answer((made,), (1.01,), 0.1, document=document)
    assert (report.verdict, failed(report)) == ("refuted", ["T1.gamma[x1]"])
    enough = tall(1.2, 1.1521, 2.03, 10.0, c=1.6177)
    assert answer((enough,), (1.01,), 0.1, document=document).verdict == "proved"


def test_a_power_above_what_c_0_allows_is_refuted() -> None:
    # c ((p + D)^3 - p^3) = c (0.25^3 - 0.15^3) = 0.01225 c.
    c_0 = 0.01
    strong = (tall(33.9, 2.824, c=0.99 * c_0 / 0.01225), tall(0.56, 4000.0))
    assert "T1.c[x1]" not in failed(answer(strong, (0.15, 11.5), c_0))
    strong = (tall(33.9, 2.824, c=1.01 * c_0 / 0.01225), tall(0.56, 4000.0))
    assert "T1.c[x1]" in failed(answer(strong, (0.15, 11.5), c_0))


def test_a_negative_c_0_is_refuted() -> None:
    assert "T1.c[x1]" in failed(answer(c_0=-1e-12))
    assert "T1.c[x1]" in failed(answer(c_0=-1e-300))


def test_a_tube_inside_its_measurement_error_is_refuted() -> None:
    report = answer(half_widths=(0.15, 9.5))
    assert report.verdict == "refuted"
    assert "T1.p[x2]" in failed(report)


@pytest.mark.parametrize(
    "changes",
    [
        {"reference": "sin(t)"},
        {"reference": {"bounds": ["1", "1"]}},
        {"reference": {"value": "0", "bound": "1", "rate": "1"}},
        {"sampling": {"period": "0.001"}},
        {"sampling": {"delay": "0.001"}},
        {"actuator": {"error": "0.001"}},
        {"performance": {"accuracy": "0.15", "rho": {"x1": {"kind": "cosine", "t_s": "2"}}}},
        {"dynamics": {"x1": {"f": "0", "g": "2"}, "x2": {"f": "0"}}},
        {"dynamics": {"x1": {"f": "0"}, "x2": {"f": "0", "g": "1 + x1**2"}}},
        {"dynamics": {"x1": {"f": "0"}, "x2": {"f": "0", "g_min": "1", "g_bound": "2"}}},
        {"dynamics": {"x1": {"f": "0"}, "x2": {"f": "0", "g": "1", "g_min": "0.5"}}},
        {"synthesis": {"method": "theorem1", "form": "printed"}},
        {"synthesis": {"method": "theorem1", "center": "nominal"}},
        {"synthesis": {"method": "theorem1", "theorem1": {"H": "linear"}}},
        {"synthesis": {"method": "theorem1", "theorem1": {"c0": "1"}}},
        {"synthesis": {"method": "theorem1", "theorem1": {"epsilon": {"x1": "1"}}}},
        {"synthesis": {"method": "theorem1", "gains": {"x1": {"gama": "1"}}}},
        {"synthesis": {"method": "unified"}},
        {"synthesis": {"method": "theorem2"}},
    ],
)
def test_what_theorem_1_does_not_cover_is_malformed(changes: dict[str, Any]) -> None:
    made = certificate()
    made["plant_sha256"] = "ab" * 32
    assert checker.check_documents(plant(**changes), made).verdict == "malformed"


def test_g_written_as_1_is_g_absent() -> None:
    same = {
        "x1": {"f": "x1**2 - sin(x1)", "f_bound": "x1**2 + 1", "g": "1.0", "g_min": "1"},
        "x2": {"f": "x1*x2**2", "g_min": "1", "g_bound": "1"},
    }
    assert answer(document=plant(dynamics=same)).verdict == "proved"


@pytest.mark.parametrize(
    ("fixed", "verdict"),
    [
        ({"gains": {"x1": {"gamma": "33.58", "H": ["2.824"], "c": "0", "H_star": "5"}}}, "proved"),
        ({"gains": {"x1": {"gamma": "33.59"}}}, "refuted"),
        ({"gains": {"x1": {"H": ["2.825"]}}}, "refuted"),
        ({"gains": {"x1": {"H": ["2.824", "0.1"]}}}, "refuted"),
        ({"gains": {"x1": {"c": "0.1"}}}, "refuted"),
        ({"gains": {"x1": {"N": "5"}}}, "refuted"),
        ({"p": {"x2": "11.39"}}, "proved"),
        ({"p": {"x2": "11.4"}}, "refuted"),
        ({"theorem1": {"c_0": "7.51e-6", "H": "constant"}}, "proved"),
        ({"theorem1": {"c_0": "7.52e-6"}}, "refuted"),
        ({"theorem1": {"epsilon": {"x2": "1.80700049"}}}, "proved"),
        ({"theorem1": {"epsilon": {"x2": "1.808"}}}, "refuted"),
        # A half-width that is fixed too is what counts.
        ({"theorem1": {"epsilon": {"x2": "9"}}, "p": {"x2": "11.39"}}, "proved"),
        # What theorem1 does not use is accepted.
        ({"gains": {"x1": {"k": "1", "M": "2", "epsilon": "3"}}, "anchor": "latched"}, "proved"),
        ({"stages": [{"p": {}}], "handover": "containment"}, "proved"),
    ],
)
def test_the_numbers_that_the_file_fixes_are_kept(fixed: dict[str, Any], verdict: str) -> None:
    report = answer(document=plant(synthesis={"method": "theorem1", **fixed}))
    assert report.verdict == verdict
    assert failed(report) == ([] if verdict == "proved" else ["fixed"])


UNIFIED = {
    "gains": {"x1": {"gamma": "4", "H": ["5"], "H_star": "5"}},
    "theorem1": {"c_0": "0.1", "epsilon": {"x2": "1"}, "H": "constant"},
    "stages": [{"p": {"x1": "1"}}],
    "handover": "reanchor",
}


@pytest.mark.parametrize("method", ["unified", "theorem2"])
@pytest.mark.parametrize("key", sorted(UNIFIED))
def test_keys_of_the_other_methods_change_nothing(method: str, key: str) -> None:
    plain = plant(synthesis={"method": method})
    plain["plant"].pop("measurement")
    more = copy.deepcopy(plain)
    more["plant"]["synthesis"][key] = UNIFIED[key]
    more["plant"]["performance"]["transition"] = "2"
    shapes = ((40.0, 0.0, 1.0, 0.0, 3), (300.0, 0.0, 1.0, 0.0, 3))
    first, second = (checker.derive(d, shapes, (0.15, 2.0)) for d in (plain, more))
    assert first.enclosures == second.enclosures
    assert first.claims == second.claims


@pytest.mark.parametrize(
    "synthesis",
    [
        {"gains": {"x1": {"gama": "4"}}},
        {"theorem_1": {"c_0": "0.1"}},
        {"stage": []},
        {"handover": "jump"},
        {"objectiv": "balanced"},
    ],
)
def test_a_key_of_no_method_is_malformed(synthesis: dict[str, Any]) -> None:
    document = plant(synthesis=synthesis)
    with pytest.raises(checker.MalformedError):
        checker.read_plant(document)


def spoiled(path: tuple[Any, ...], value: Any) -> dict[str, Any]:
    made = certificate()
    place = made["design"]
    for key in path[:-1]:
        place = place[key]
    if value is None:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return made


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("c_0",), None),
        (("c_0",), "nan"),
        (("c_0",), "0.1"),
        (("gains", 0, "H"), []),
        (("gains", 0, "H"), [(0.0).hex()]),
        (("gains", 0, "H"), [(-1.0).hex()]),
        (("gains", 0, "H"), [(5.0).hex(), (-1.0).hex()]),
        (("gains", 0, "H"), [(5.0).hex()] * 9),
        (("gains", 0, "H"), (5.0).hex()),
        (("gains", 0, "gamma"), (-1.0).hex()),
        (("gains", 0, "gamma"), (0.0).hex()),
        (("gains", 0, "c"), (-1.0).hex()),
        (("gains", 0, "N"), 4),
        (("gains", 0, "N"), 1),
        (("gains", 0, "N"), True),
        (("gains", 0, "k"), (1.0).hex()),
        (("gains", 1), None),
        (("p", 1), (0.0).hex()),
        (("p", 1), None),
        (("U_MAX",), (1e9).hex()),
        (("stages",), [{"p": [], "gains": [], "widened": []}]),
        (("stages",), {}),
    ],
)
def test_a_design_that_is_none_is_malformed(path: tuple[Any, ...], value: Any) -> None:
    report = checker.check_documents(plant(), spoiled(path, value))
    assert report.verdict == "malformed"


def test_every_number_of_the_design_spoiled_is_refused() -> None:
    made = certificate()
    for path in (
        ("c_0",), ("p", 0), ("p", 1), ("U_MAX",),
        *((("gains", i, key)) for i in (0, 1) for key in ("gamma", "c")),
        *((("gains", i, "H", 0)) for i in (0, 1)),
    ):  # fmt: skip
        place: Any = made["design"]
        for key in path:
            place = place[key]
        number = float.fromhex(place)
        for factor in (0.999, 1.001):
            other = (number * factor or 1e-3).hex()
            report = checker.check_documents(plant(), spoiled(path, other))
            assert report.verdict != "proved", (path, other)


def test_enclosures_that_are_not_what_is_computed_are_malformed() -> None:
    made = certificate()
    for key in ("H_needed[x2]", "epsilon[x1]", "B[x1]", "U"):
        other = copy.deepcopy(made)
        low, high = (float.fromhex(end) for end in other["enclosures"][key])
        other["enclosures"][key] = [(low * 0.5).hex(), high.hex()]
        assert checker.check_documents(plant(), other).verdict == "malformed"


# |x_1| + (x_1 - 1)^2 / 9 is not monotone in |x_1|, and below |f| = x_1 nowhere.
def test_the_weaker_form_of_a_bound_is_no_proof_where_H_follows_rho() -> None:
    dynamics = {
        "x1": {"f": "x1", "f_bound": "1.2*Abs(x1) + 0.001*sin(40*x1)**2"},
        "x2": {"f": "x1*x2"},
    }
    document = plant(dynamics=dynamics, initial={"x1": "0.3", "x2": "0"})
    for gains, allowed in (
        ((tall(60.0, 3.0), tall(2.0, 5000.0)), True),
        ((tall(60.0, 3.0, 0.1), tall(2.0, 5000.0)), False),
    ):
        made = produce_certificate(document, gains, (0.15, 25.0), tool="test", c_0=1e-6)
        (claim,) = [c for c in made["claims"] if c["id"] == "f_bound[x1]"]
        claim["proof"] = {"kind": "corner", "trees": [[-1], [-1]]}
        report = checker.check_documents(document, made)
        if allowed:
            verdicts = {c.id: c.verdict for c in report.claims}
            assert verdicts["f_bound[x1]"] == "proved"
        else:
            assert report.verdict == "malformed"
            assert "a proof by 'corner'" in report.failures[0]


# --- folders ----------------------------------------------------------------------------------

TEXT = """\
name: first
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2}
initial: {x1: 1, x2: [-0.1, 0.1]}
performance: {accuracy: 0.15}
measurement: {quantizer: {kind: uniform, step: 0.1}}
synthesis: {method: theorem1, gains: {x2: {c: 1e-9}}, theorem1: {H: scheduled, c_0: 0.0001}}
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    path = tmp_path_factory.mktemp("plant") / "first.yaml"
    path.write_text(TEXT)
    design = synthesize(load_spec(path))
    design.certificate.require()
    law, provenance = build_law(design), make_provenance(design)
    texts = {
        "plant.yaml": TEXT,
        "plant.json": plant_json(design.spec),
        "certificate.json": design.certificate.document,
        "controller.py": render_controller(law, provenance),
        **render_c(law, provenance),
    }
    return {name: text.encode() for name, text in texts.items()}


@pytest.fixture
def verify(files: dict[str, bytes], tmp_path: Path) -> Callable[..., checker.Report]:
    """Write a folder with one change, its manifest made anew, and check it."""

    def run(name: str = "", old: str = "", new: str = "") -> checker.Report:
        wanted = dict(files)
        if name:
            text = files[name].decode()
            assert old in text, old
            wanted[name] = text.replace(old, new, 1).encode()
        for path, data in wanted.items():
            (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / path).write_bytes(data)
        hashes = {path: hashlib.sha256(data).hexdigest() for path, data in sorted(wanted.items())}
        manifest = {
            "format": "bfppc-synth/manifest/1",
            "name": "first",
            "status": "certified",
            "files": hashes,
        }
        (tmp_path / "manifest.json").write_text(json.dumps(manifest))
        return checker.verify_folder(tmp_path)

    return run


def test_an_untouched_folder_is_proved(verify: Callable[..., checker.Report]) -> None:
    report = verify()
    assert report.failures == ()
    assert report.verdict == "proved"
    assert "200 commands" in report.tests[-1]


@pytest.mark.parametrize("constant", ["gamma_1", "H_1_0", "H_1_1", "c_2", "p_2", "U_MAX"])
@pytest.mark.parametrize("name", ["controller.py", "c/src/first.c"])
def test_each_constant_in_the_code_spoiled_is_refused(
    files: dict[str, bytes], verify: Callable[..., checker.Report], name: str, constant: str
) -> None:
    lines = files["controller.py"].decode().splitlines()
    value = next(line.split(" = ")[1] for line in lines if line.startswith(f"{constant} = "))
    other = repr(float(value) * 1.0000000001)
    report = verify(name, f"{constant} = {value}", f"{constant} = {other}")
    assert report.verdict == "malformed"
    assert constant in report.failures[0]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("(H_1_1 * rho) + H_1_0", "(H_1_1 * rho)"),
        ("(H_1_1 * rho) + H_1_0", "(H_1_1) + H_1_0"),
        ("(H_2_1 * rho) + H_2_0", "(H_2_1 * 0.999 * rho) + H_2_0"),
        ("u = 0.0 - phi_2", "u = phi_2"),
        ("c_2 * ", "-c_2 * "),
        ("rho * start_2", "start_2"),
    ],
)
def test_a_changed_law_is_refused_although_every_constant_is_right(
    verify: Callable[..., checker.Report], old: str, new: str
) -> None:
    report = verify("controller.py", old, new)
    assert report.verdict == "malformed"
    assert "controller.py" in report.failures[0]
