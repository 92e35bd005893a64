"""Rigorous suprema of the center r_1 and of its rate, over all t and all declared starts."""

from __future__ import annotations

import math
from typing import Any

import pytest

from bfppc_synth.certificate import checker

COSINE = {"kind": "cosine", "t_s": "1"}


def center(reference: Any = "0", start: Any = "0.5", **plant: Any) -> checker.Center:
    document = {
        "format": checker.PLANT_FORMAT,
        "plant_sha256": "ab" * 32,
        "plant": {
            "name": "centered",
            "states": ["x1"],
            "dynamics": {"x1": {"f": "0"}},
            "reference": reference,
            "initial": {"x1": start},
            "performance": {"accuracy": "0.1", "rho": plant.pop("rho", COSINE)},
            **plant,
        },
    }
    return checker.performance_center(checker.read_plant(document))


def numbers(found: checker.Center) -> tuple[float, float, float]:
    """Inf r_1, sup r_1, sup|dr_1|: the safe ends, after a check that the others are close."""
    ends = [checker.to_doubles(e) for e in (found.low[0], found.high[0], found.rate[0])]
    for lower, upper in ends:
        assert upper - lower <= 1e-8 * max(1.0, abs(upper))
    return ends[0][0], ends[1][1], ends[2][1]


@pytest.mark.parametrize(
    ("reference", "start", "low", "high", "rate"),
    [
        # The golden numbers of docs/theory.md section 2.
        ("sin(t)", "0.5", -1.0, 1.280776406, 1.030776406),
        ("0", "1", 0.0, 1.0, 0.5),
        ("cos(t)", "1", -1.0, 1.0, 1.0),
        ("2", "2", 2.0, 2.0, 0.0),
        ("1 - exp(-t)", "0", 0.0, 1.0, 1.0),
        ("tanh(t)", "0", 0.0, 1.0, 1.0),
        ("atan(2*t)", "0", 0.0, math.pi / 2, 2.0),
        ("t*exp(-t)", "0", 0.0, math.exp(-1), 1.0),
        ("sin(t) + sin(3*t)", "0", -1.5396007178, 1.5396007178, 4.0),
        ("sin(2*pi*t)", "0", -1.0, 1.0, 2 * math.pi),
        ("t/(1 + t**2)", "0", 0.0, 0.5, 1.0),
        ("(pi/2)*sin(t)*(1 - exp(-0.1*t**2))", "0", -math.pi / 2, math.pi / 2, math.pi / 2),
        ("sin(t)*exp(-t)", "0", -0.01393203510, 0.3223969419, 1.0),
        ("exp(sin(t))", "1", math.exp(-1), math.e, 1.4585285374),
    ],
)
def test_known_suprema_are_enclosed_tightly(
    reference: str, start: str, low: float, high: float, rate: float
) -> None:
    found = numbers(center(reference, start))
    assert found == pytest.approx((low, high, rate), abs=1e-8)


REFERENCES = (
    "sin(t)",
    "0.3*sin(2*t) + 0.5*cos(3*t + 1)",
    "sin(t) + 0.5*sin(sqrt(2)*t)",
    "exp(-t)*cos(5*t)",
    "sin(t)/(1 + t)",
    "abs(sin(t))",
    "min(sin(t), 0.3)",
    "t**2*exp(-t)",
    "sin(t) + 1/(1 + 1e8*(t - 7.3)**2)",
    "1/(2 + sin(t)*exp(-t/5))",
    "sin(t + exp(-t))",
)


@pytest.mark.parametrize("rho", [COSINE, {"kind": "exponential", "rate": "0.7", "floor": "0.2"}])
@pytest.mark.parametrize("reference", REFERENCES)
def test_no_sample_lies_outside_of_the_enclosures(reference: str, rho: dict[str, str]) -> None:
    found = center(reference, ["-0.4", "0.9"], rho=rho)
    low, high, rate = (
        checker.to_doubles(found.low[0])[0],
        checker.to_doubles(found.high[0])[1],
        checker.to_doubles(found.rate[0])[1],
    )
    code = compile(reference.replace("abs", "fabs"), "reference", "eval")
    names = {name: getattr(math, name) for name in ("sin", "cos", "exp", "sqrt", "fabs")}

    def y_d(t: float) -> float:
        return float(eval(code, {**names, "min": min, "t": t}))  # noqa: S307 (a fixed list)

    def fade(t: float) -> float:
        if rho is COSINE:
            return 0.5 * (1.0 + math.cos(t)) if t < math.pi else 0.0
        return 0.8 * math.exp(-0.7 * t) + 0.2

    for a in (-0.4 - y_d(0.0), 0.9 - y_d(0.0)):
        before = None
        for j in range(4001):
            t = j * 0.005
            r = y_d(t) + fade(t) * a
            assert low - 1e-12 <= r <= high + 1e-12
            if before is not None:
                assert abs(r - before) / 0.005 <= rate + 1e-9
            before = r


def test_a_latched_start_is_widened_by_the_resolution_and_an_exact_one_is_not() -> None:
    noisy = {"measurement": {"noise": "0.1"}}
    latched = numbers(center("0", "1", **noisy))
    exact = numbers(center("0", "1", **noisy, synthesis={"anchor": "exact"}))
    assert latched == pytest.approx((0.0, 1.1, 0.55), abs=1e-9)
    assert exact == pytest.approx((0.0, 1.0, 0.5), abs=1e-9)


def test_a_reference_supplied_at_run_time_is_bounded_apart_from_the_start() -> None:
    supplied = {"bounds": ["1", "2"]}
    assert numbers(center(supplied, ["-0.5", "0.5"])) == (-2.5, 2.5, 2.75)
    document_offset = {"x1": ["-0.5", "0.5"], "offset": "0.25"}
    found = center(supplied, "0", initial=document_offset)
    assert numbers(found) == (-1.25, 1.25, 2.125)


def test_declared_bounds_are_taken_as_declared() -> None:
    declared = {"value": "1 + sin(t)", "bound": "3", "rate": "4"}
    assert numbers(center(declared, "1.5")) == (-3.5, 3.5, 4.25)
