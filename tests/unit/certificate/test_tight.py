"""Bounds tight: suprema that are known, the cover of time, slopes, what is kept of termwise."""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import produce_certificate
from bfppc_synth.certificate.trees import as_text, find_tree, find_trees
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.tight import TightBounds


def plant(states: list[str], dynamics: dict[str, Any], **more: Any) -> dict[str, Any]:
    given = {
        "name": "plant",
        "states": states,
        "dynamics": dynamics,
        "initial": dict.fromkeys(states, "0"),
        "performance": {"accuracy": "0.1"},
        "synthesis": {"bounds": "tight"},
        **more,
    }
    return {"format": checker.PLANT_FORMAT, "plant_sha256": "ab" * 32, "plant": given}


NOMINAL = {
    "performance": {"accuracy": "0.1", "transition": "2"},
    "synthesis": {"bounds": "tight", "center": "nominal"},
}


def largest(function: Any, end: float = 2 * math.pi) -> float:
    """Maximum of a smooth function of t by scanning and three-section."""
    step = end / 2000
    t = max((j * step for j in range(2001)), key=function)
    low, high = t - step, t + step
    for _ in range(80):
        a, b = low + (high - low) / 3, high - (high - low) / 3
        low, high = (a, high) if function(a) < function(b) else (low, b)
    return float(function((low + high) / 2))


def square(t: float) -> float:
    return (math.sin(t) + 0.1) ** 2 - math.cos(t)


# With k_1 = 4, p = (0.1, 0.2): R_2 = (1 - a) cos t + (k - a) (e_2 - k e_1).
ARM = 0.1 + (4 - 0.9) * (0.2 + 4 * 0.1)
KNOWN = {
    # f_bound = 2 at every x, |dy_d| <= 1; both at the same time.
    "constant": (
        plant(["x"], {"x": {"f_bound": "2"}}, reference="sin(t)"),
        (40.0,),
        (0.1,),
        ((3.0,), 3.0),
    ),
    # |x|^2 is largest where cos t is 0: not 1.21 + 1.
    "square": (
        plant(["x"], {"x": {"f_bound": "x**2"}}, reference="sin(t)"),
        (40.0,),
        (0.1,),
        ((largest(square),), largest(square)),
    ),
    # (a - 1) sin t + a e with e = 0.1.
    "parameter": (
        plant(["x"], {"x": {"f": "a*x"}}, reference="sin(t)", parameters={"a": ["0.9", "1.1"]}),
        (40.0,),
        (0.1,),
        ((0.21,), 0.21),
    ),
    "damped": (
        plant(
            ["x", "z"],
            {"x": {"f": "0"}, "z": {"f": "-a*z"}},
            reference="sin(t)",
            parameters={"a": ["0.9", "1.1"]},
            initial={"x": "0", "z": "1"},
        ),
        (4.0, 40.0),
        (0.1, 0.2),
        ((0.0, ARM), ARM),
    ),
}
for _name in ("parameter", "damped"):
    KNOWN[_name][0]["plant"].update(NOMINAL)


def answers(name: str, factor: float) -> dict[str, str]:
    document, gains, p, (loads, rate) = KNOWN[name]
    shapes = tuple(Shape(k=k, M=0.0, epsilon=1.0, c=0.0, N=3) for k in gains)
    made = produce_certificate(
        document,
        shapes,
        p,
        tool="test",
        transition=2.0 if name in ("parameter", "damped") else None,
        tight=TightBounds(load=tuple(load * factor for load in loads), rate=rate * factor),
    )
    report = checker.check_documents(document, made)
    assert report.claims, report.failures
    return {r.id: r.verdict for r in report.claims if r.id.startswith("tight")}


@pytest.mark.parametrize("name", KNOWN)
def test_a_supremum_that_is_known_is_proved_with_a_thousandth_more(name: str) -> None:
    assert set(answers(name, 1.001).values()) == {"proved"}


@pytest.mark.parametrize("name", KNOWN)
def test_a_supremum_that_is_known_is_refuted_with_a_thousandth_less(name: str) -> None:
    found = answers(name, 0.999)
    # A load of 0 stays what it is.
    assert {v for k, v in found.items() if k != "tight[x]" or name != "damped"} == {"refuted"}


def test_a_load_at_the_termwise_value_needs_no_tree() -> None:
    document, gains, p, _ = KNOWN["square"]
    derived = checker.derive(
        document, [(gains[0], 0.0, 1.0, 0.0, 3)], p, tight=((2.2100001,), 2.2100001)
    )
    claims = {claim.id: claim for claim in derived.claims}
    for name in ("tight[x]", "tight.rate[x]"):
        assert claims[name].proof == "eval"
        assert not claims[name].pointwise
        assert claims[name].comparisons[0].verdict() == "proved"
    below = checker.derive(document, [(gains[0], 0.0, 1.0, 0.0, 3)], p, tight=((2.2,), 2.2))
    assert all(claim.pointwise for claim in below.claims if claim.id.startswith("tight"))


def test_the_claims_stand_in_the_chain_for_the_termwise_loads() -> None:
    document, _, p, _ = KNOWN["damped"]
    gains = [(4.0, 0.0, 1.0, 0.0, 3), (40.0, 0.0, 1.0, 0.0, 3)]
    table = checker.derive(document, gains, p, duration=2.0, tight=((0.5, 2.0), 3.0)).enclosures
    assert table["F_star[x]"] == checker.from_fraction(Fraction(0.5) + Fraction(0.2))
    assert table["F_star[z]"] == checker.from_fraction(Fraction(2))
    speed = checker.to_doubles(table["V"])
    # V = rate + g phi_n(p_n + eta_n).
    assert speed == pytest.approx((3 + 40 * 0.2, 3 + 40 * 0.2), rel=1e-8)
    termwise = {**document, "plant": {**document["plant"], "synthesis": {"center": "nominal"}}}
    plain = checker.derive(termwise, gains, p, duration=2.0).enclosures
    for key in ("X[z]", "A[x]", "xi[z]", "eta[z]", "Lambda[x]", "W[z]", "D[z]", "U"):
        assert table[key] == plain[key]


def test_what_only_the_termwise_bounds_cannot_pass_decides_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fails(*_: object) -> None:
        raise checker.UndecidedError("a number beyond 2^4096")

    monkeypatch.setattr(checker._Chain, "_termwise", fails)
    checker._ANSWERED.clear()
    try:
        assert set(answers("damped", 1.001).values()) == {"proved"}
        termwise = plant(["x"], {"x": {"f_bound": "2"}}, synthesis={})
        with pytest.raises(checker.UndecidedError):
            checker.derive(termwise, [(40.0, 0.0, 1.0, 0.0, 3)], (0.1,))
    finally:
        checker._ANSWERED.clear()


RHOS = {
    "cosine": {"kind": "cosine", "t_s": "0.5"},
    "exponential": {"kind": "exponential", "rate": "2", "floor": "0.1"},
}


@pytest.mark.parametrize("kind", RHOS)
@pytest.mark.parametrize("reference", ["0.3", "sin(t)", "sin(t) + exp(-t)", "tanh(t)"])
def test_the_cover_contains_the_center_of_every_time(reference: str, kind: str) -> None:
    given = plant(
        ["x", "z"],
        {"x": {"f": "0"}, "z": {"f": "0"}},
        reference=reference,
        initial={"x": ["0.2", "0.4"], "z": ["-1", "1"]},
        performance={
            "accuracy": "0.1",
            "rho": {"x": RHOS[kind], "z": {"kind": "cosine", "t_s": "1"}},
        },
    )
    pieces = checker.performance_cover(checker.read_plant(given))
    tapes = [
        {key: (checker.Tape(node, list(ranges)), ranges) for key, node in nodes.items()}
        for nodes, ranges in pieces
    ]
    functions = {
        "0.3": lambda _: 0.3,
        "sin(t)": math.sin,
        "sin(t) + exp(-t)": lambda t: math.sin(t) + math.exp(-t),
        "tanh(t)": math.tanh,
    }
    y = functions[reference]

    def fade(state: int, t: float) -> float:
        if state == 1 or kind == "cosine":
            t_s = (0.5, 1.0)[state]
            return (1 + math.cos(t / t_s)) / 2 if t < math.pi * t_s else 0.0
        return 0.9 * math.exp(-2 * t) + 0.1

    def r(state: int, t: float, start: float) -> float:
        return fade(state, t) * start + (y(t) if state == 0 else 0.0)

    rng = random.Random(3)  # noqa: S311
    for _ in range(60):
        t = rng.choice((rng.uniform(0, 4), rng.uniform(0, 300)))
        starts = (rng.uniform(0.2, 0.4) - y(0), rng.uniform(-1, 1))
        assert any(holds(tape, t, starts, r) for tape in tapes), t


def holds(tapes: dict[str, Any], t: float, starts: tuple[float, float], r: Any) -> bool:
    """Whether a piece has this time; later pieces are checked as a whole, phases included."""
    h = 1e-5
    wanted: dict[str, float] = {}
    for state, start in enumerate(starts):
        wanted[f"#r{state + 1}"] = r(state, t, start)
        slope = (r(state, t + h, start) - r(state, max(0.0, t - h), start)) / (h + min(t, h))
        wanted[f"#d{state + 1}"] = slope
    for key, (tape, ranges) in tapes.items():
        own = {f"#a{j + 1}": start for j, start in enumerate(starts)}
        if "t" in ranges:
            low, high = (end / checker.ONE for end in ranges["t"])
            if not low <= t <= high:
                return False
            own["t"] = t
        elif "#p0" in ranges:
            own["#p0"] = t % (2 * math.pi)
        box = tuple(
            checker.from_fraction(Fraction(own[name])) if name in own else interval
            for name, interval in ranges.items()
        )
        low, high = checker.to_doubles(tape.value(box))
        if not low - 1e-4 <= wanted[key] <= high + 1e-4:
            return False
    return True


EXPRESSIONS = (
    "x*y - z**3",
    "max(x, y)*exp(z)",
    "min(x*y, z) + abs(x - y)",
    "sin(x*y) + tanh(z)/(2 + cos(x))",
    "(x + y)**2*(x - z)**3/(3 + y)",
    "sqrt(4 + x*y)*atan(z) - x*abs(x)",
)


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_reverse_slopes_contain_every_difference_quotient(text: str) -> None:
    names = ["x", "y", "z"]
    node = checker.parse(text, {name: checker.sym(name) for name in names})
    steep = checker.Steep(node, names)
    rng = random.Random(1)  # noqa: S311
    for _ in range(60):
        ends = [sorted((rng.uniform(-1, 1), rng.uniform(-1, 1))) for _ in names]
        box = tuple(
            (checker.from_fraction(Fraction(a))[0], checker.from_fraction(Fraction(b))[1])
            for a, b in ends
        )
        value, slopes = steep.gradient(box)
        assert value == steep.value(box)
        a, b = (tuple((rng.randint(lo, hi),) * 2 for lo, hi in box) for _ in range(2))
        change = checker.ZERO_I
        for j, (end, begin) in enumerate(zip(b, a, strict=True)):
            slope = slopes.get(j, checker.ZERO_I)
            change = checker.add(change, checker.mul(slope, checker.sub(end, begin)))
        exact = checker.sub(steep.value(b), steep.value(a))
        assert change[0] <= exact[1]
        assert exact[0] <= change[1]
        top = steep.bound(box)
        assert top.upper >= steep.value(a)[0]
        assert top.upper >= top.sample


def test_a_tree_as_text_has_one_letter_for_each_entry() -> None:
    assert as_text([0, -1, 10, -1, -1]) == "0.a.."
    document, _, _, _ = KNOWN["square"]
    derived = checker.derive(document, [(40.0, 0.0, 1.0, 0.0, 3)], (0.1,), tight=((1.5,), 1.5))
    goals = next(claim.pointwise for claim in derived.claims if claim.id == "tight[x]")
    trees = find_trees(goals)
    assert trees is not None
    for goal, tree in zip(goals, trees, strict=True):
        assert checker.check_tree(goal, tree)
        entries = find_tree(goal)
        assert entries is not None
        assert as_text(entries) == tree
    assert find_trees(goals, 0) is None
