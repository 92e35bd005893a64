"""The parts of the checker that only Theorems 1 and 3 use."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import pytest

from bfppc_synth.certificate import checker


def point(value: float | Fraction) -> checker.Interval:
    return checker.from_fraction(Fraction(value))


def document(**plant: Any) -> dict[str, Any]:
    keys: dict[str, Any] = {
        "name": "parts",
        "states": ["x1", "x2"],
        "dynamics": {"x1": {"f": "x1"}, "x2": {"f": "x1*x2"}},
        "initial": {"x1": "0.5", "x2": "2"},
        "performance": {"accuracy": "0.05"},
    }
    keys.update(plant)
    return {"format": checker.PLANT_FORMAT, "plant_sha256": "ab" * 32, "plant": keys}


# --- shapes -----------------------------------------------------------------------------------


@pytest.mark.parametrize("rho", [0.0, 0.3, 1.0])
def test_a_height_and_its_slope_are_the_polynomial_and_its_derivative(rho: float) -> None:
    tall = checker.tall_of((0.5, (1.25, 0.0, 3.5, 0.75), 0.1, 3), "")
    r = Fraction(rho)
    height = Fraction(5, 4) + Fraction(7, 2) * r**2 + Fraction(3, 4) * r**3
    slope = 7 * r + Fraction(9, 4) * r**2
    for found, wanted in ((tall.height(point(rho)), height), (tall.bend(point(rho)), slope)):
        assert found[0] <= wanted * checker.ONE <= found[1]
        assert found[1] - found[0] <= 64
    e = Fraction(-3, 8)
    phi = tall.phi(point(e), point(rho))
    assert phi[0] <= (Fraction(1, 2) * height * e + Fraction(0.1) * e**3) * checker.ONE <= phi[1]


def test_the_steepest_shape_is_the_one_at_rho_1() -> None:
    tall = checker.tall_of((0.5, (1.25, 0.0, 3.5), 0.1, 5), "")
    steepest = tall.steepest()
    assert (steepest.k, steepest.M, steepest.c, steepest.N) == (
        Fraction(19, 8), 0, Fraction(0.1), 5,
    )  # fmt: skip
    for e in (0.0, 0.2, -1.5):
        assert tall.phi(point(e)) == steepest.phi(point(e))
    assert tall.slope_at_most(point(2.0)) == steepest.slope_at_most(point(2.0))


SHAPES = [
    (2.0, 6.0, 0.5, 0.1, 3),
    (1.0, 0.0, 1.0, 2.0, 3),
    (0.0, 30.0, 0.7, 0.0, 3),
    (25.0, 0.0, 1.0, 0.0, 3),
    (0.5, 3.0, 0.2, 1.0, 5),
]


@pytest.mark.parametrize("shift", [0.0, 0.05, 1.5])
@pytest.mark.parametrize("later", SHAPES)
@pytest.mark.parametrize("earlier", SHAPES[:3])
def test_a_jump_encloses_what_sampling_finds(later: Any, earlier: Any, shift: float) -> None:
    new, old = checker.gain_of(later, ""), checker.gain_of(earlier, "")
    reach = 0.8

    def phi(values: Any, e: float) -> float:
        k, M, epsilon, c, N = values
        return k * e + M * math.tanh(M * e / epsilon) + c * e**N

    low, high = checker.to_doubles(new.jump(point(shift), old, point(reach)))
    best = max(
        abs(phi(later, e + d) - phi(earlier, e))
        for e in (reach * j / 400 for j in range(-400, 401))
        for d in (-shift, -shift / 2, 0.0, shift / 2, shift)
    )
    assert low <= high
    assert best <= high + 1e-12
    assert high <= best * 1.001 + 1e-9
    # The equal shape does not jump.
    same = checker.to_doubles(new.jump(point(0.0), new, point(reach)))
    assert same == (0.0, 0.0)


@pytest.mark.parametrize(
    "values",
    [
        (1.0, (), 0.0, 3),
        (1.0, (0.0, 1.0), 0.0, 3),
        (1.0, (1.0, -1e-300), 0.0, 3),
        (1.0, (1.0,) * 9, 0.0, 3),
        (-1e-300, (1.0,), 1.0, 3),
        (0.0, (1.0,), 0.0, 3),
        (1.0, (1.0,), -1e-300, 3),
        (1.0, (1.0,), 0.0, 2),
        (1.0, (1.0,), 0.0, 65),
    ],
)
def test_a_shape_that_does_not_increase_at_every_rho_is_none(values: Any) -> None:
    with pytest.raises(checker.MalformedError):
        checker.tall_of(values, "gains[0]")


# --- Theorem 1 --------------------------------------------------------------------------------

FIRST = {"synthesis": {"method": "theorem1"}, "measurement": {"noise": "0.002"}}
TALL = ((30.0, (2.0, 1.0), 0.0, 3), (2.0, (400.0, 900.0), 0.0, 3))


def chain(**plant: Any) -> checker._Theorem1:
    problem = checker.read_plant(document(**{**FIRST, **plant}))
    gains = tuple(checker.tall_of(g, "") for g in TALL)
    made = checker._Theorem1(problem, gains, (Fraction(1, 20), Fraction(9)), Fraction(1, 1000))
    made.obligations()
    return made


@pytest.mark.parametrize(
    "rho", [{"kind": "cosine", "t_s": "1"}, {"kind": "exponential", "rate": "2", "floor": "0.2"}]
)
def test_a_cell_of_rho_bounds_every_rho_in_it(rho: dict[str, str]) -> None:
    made = chain(performance={"accuracy": "0.05", "rho": rho})
    floor = made.problem.rhos[0].floor[0]
    for left, right in ((0, 50), (50, 60), (90, 100), (0, 100)):
        ends = [floor + (checker.ONE - floor) * share // 100 for share in (left, right)]
        cell = made._cell((ends[0], ends[1]))
        for share in (0, 25, 70, 100):
            at = ends[0] + (ends[1] - ends[0]) * share // 100
            for whole, single in zip(cell, made._cell((at, at)), strict=True):
                for name in ("p", "D", "H", "A", "L", "load", "needed", "delta", "delta_slope"):
                    outer, inner = getattr(whole, name), getattr(single, name)
                    # Lower ends of what is enclosed over a box are those of a smaller box.
                    assert inner[1] <= outer[1] + 64, name
                    if name in ("p", "D", "H", "delta", "delta_slope"):
                        assert outer[0] - 64 <= inner[0], name
        for whole, level in zip(cell, made.levels, strict=True):
            assert whole.needed[1] <= level.needed[1] * (1 + Fraction(1, 10**30))


def test_a_search_that_runs_out_of_cells_is_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    # 30 H_1(rho) has no room against what is needed, which a cell cannot show in three steps.
    monkeypatch.setattr(checker, "_CELLS", 3)
    made = chain()
    verdicts = {c.verdict() for c in made._dominates()}
    assert "proved" not in verdicts
    monkeypatch.setattr(checker, "_CELLS", 3000)
    assert made._dominates()[0].verdict() == "proved"


# --- Theorem 3 --------------------------------------------------------------------------------

STAGE = {
    "p": {"x1": "0.04", "x2": "1"},
    "gains": {
        "x1": {"k": "2", "M": "6", "epsilon": "0.5", "c": "0.1"},
        "x2": {"k": "1", "c": "2"},
    },
}
FREE = (((2.0, 6.0, 0.5, 0.1, 3), (1.0, 0.0, 1.0, 2.0, 3)), (0.04, 1.0), (0.041, 1.1))
LAST = ((2.0, 14.0, 0.5, 0.0, 3), (9000.0, 0.0, 1.0, 0.0, 3))


def staged(count: int = 1, handover: str = "reanchor", **plant: Any) -> checker.Obligations:
    synthesis = {"method": "theorem3", "stages": [STAGE] * count, "handover": handover}
    given = document(synthesis=synthesis, **plant)
    return checker.derive(given, LAST, (0.05, 2.0), None, (FREE,) * count)


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("anchor", [1, 2])
def test_the_center_after_a_switch_holds_what_was_measured_there(count: int, anchor: int) -> None:
    noise = {"noise": {"x1": "0.0005", "x2": "0.01"}}
    found = staged(count, measurement=noise)
    if anchor == 2:
        synthesis = {"method": "theorem3", "stages": [STAGE] * count, "anchor": "exact"}
        given = document(synthesis=synthesis, measurement=noise)
        found = checker.derive(given, LAST, (0.05, 2.0), None, (FREE,) * count)
    table = found.enclosures
    first = checker.performance_center(found.problem)
    shift = sum(0.041 + table[f"eta.stage{m}[x1]"][1] / checker.ONE for m in range(1, count + 1))
    assert found.center.switches == count
    assert found.center.high[0][1] / checker.ONE == pytest.approx(
        first.high[0][1] / checker.ONE + shift, rel=1e-12
    )
    assert found.center.low[0][0] / checker.ONE == pytest.approx(
        first.low[0][0] / checker.ONE - shift, rel=1e-12
    )
    assert found.center.rate[0][1] / checker.ONE == pytest.approx(
        first.rate[0][1] / checker.ONE + 0.5 * shift, rel=1e-9
    )
    latched = table[f"X.stage{count}[x2]"][1] / checker.ONE + anchor * 0.01
    assert found.center.high[1][1] / checker.ONE == pytest.approx(latched, rel=1e-12)
    assert found.center.rate[1][1] / checker.ONE == pytest.approx(0.5 * latched, rel=1e-12)


def test_containment_keeps_the_center_and_its_rounding() -> None:
    found, moved = staged(handover="containment"), staged()
    first = checker.performance_center(found.problem)
    assert found.center == first
    assert moved.rounding[0] > 10 * found.rounding[0]


def test_commands_of_earlier_stages_count_in_the_speed_only_with_a_delay() -> None:
    loud = (((2.0, 6.0, 0.5, 0.1, 3), (90000.0, 0.0, 1.0, 2.0, 3)), (0.04, 1.0), (0.041, 1.1))
    stage = {**STAGE, "gains": {**STAGE["gains"], "x2": {"k": "90000", "c": "2"}}}
    speeds = []
    for delay in ("0", "1e-12"):
        synthesis = {"method": "theorem3", "stages": [stage]}
        given = document(synthesis=synthesis, sampling={"delay": delay})
        table = checker.derive(given, LAST, (0.05, 2.0), None, (loud,)).enclosures
        speeds.append(table["V"][1] / checker.ONE)
        assert table["U"][1] / checker.ONE == pytest.approx(90002.0, rel=1e-6)
    assert speeds[1] > speeds[0] + 7e4


def test_the_speed_of_a_stage_counts_the_commands_before_it() -> None:
    loud = (((2.0, 6.0, 0.5, 0.1, 3), (5000.0, 0.0, 1.0, 2.0, 3)), (0.04, 1.0), (0.041, 1.1))
    stage = {**STAGE, "gains": {**STAGE["gains"], "x2": {"k": "5000", "c": "2"}}}
    synthesis = {"method": "theorem3", "stages": [stage, STAGE]}
    given = document(synthesis=synthesis)
    table = checker.derive(given, LAST, (0.05, 2.0), None, (loud, FREE)).enclosures
    assert table["U.stage2"][1] / checker.ONE == pytest.approx(3.0, rel=1e-9)
    assert table["V.stage2[x2]"][1] / checker.ONE > 5000.0
