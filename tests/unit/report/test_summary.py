"""The few lines that a command prints."""

from __future__ import annotations

from typing import Any

import pytest

from bfppc_synth.report.summary import summary


@pytest.fixture
def document() -> dict[str, Any]:
    return {
        "format": "bfppc-synth/report/1",
        "name": "arm",
        "status": "certified",
        "method": "unified",
        "form": "sound",
        "center": "performance",
        "states": ["x1", "x2"],
        "gains": [
            {"k": 2.0, "M": 0.5, "epsilon": 0.25, "c": 0.0, "N": 3},
            {"k": 40.123456789, "M": 0.0, "epsilon": 1.0, "c": 0.0, "N": 3},
        ],
        "omega": {"p": [0.05, 2.0]},
        "bounds": {"U": 571.25, "slope": 123.5},
        "failures": [],
        "simulation": {"within_bounds": True, "max_abs_u": 1.5},
        "folder": "generated/arm",
    }


def test_a_certified_design_shows_status_gains_peak_input_and_the_report(
    document: dict[str, Any],
) -> None:
    lines = summary(document)
    assert lines[0] == "arm: certified (method unified, form sound, center performance)"
    assert "571.25" in lines[1]
    assert [line.split()[:3] for line in lines[3:5]] == [
        ["x1", "0.05", "2"],
        ["x2", "2", "40.1235"],
    ]
    assert lines[-1].endswith("generated/arm/report.html")


def test_what_is_not_certified_shouts_and_names_what_fails(document: dict[str, Any]) -> None:
    document |= {"status": "refuted", "failures": ["U1[x1]: 3 is not above 4"]}
    document["simulation"]["within_bounds"] = False
    text = "\n".join(summary(document))
    assert "NOT CERTIFIED (refuted)" in text
    assert "U1[x1]: 3 is not above 4" in text
    assert "OUT OF ITS BOUNDS" in text


def test_a_number_that_is_not_finite_is_shown_as_missing(document: dict[str, Any]) -> None:
    document["bounds"]["slope"] = None
    assert "None" in summary(document)[1]


def test_other_results_are_shown_key_by_key() -> None:
    simulated = {
        "format": "bfppc-synth/simulation/1",
        "name": "arm",
        "max_abs_e": [0.01, 0.5],
        "U": 571.25,
        "within_bounds": True,
        "exit_code": 0,
    }
    assert summary(simulated) == [
        "name: arm",
        "max_abs_e: 0.01, 0.5",
        "U: 571.25",
        "within_bounds: True",
    ]


@pytest.fixture
def verification() -> dict[str, Any]:
    return {
        "format": "bfppc-synth/verification/1",
        "verdict": "proved",
        "claims": [{"id": "U1[x1]", "statement": "phi_1(p_1) > F*_1", "verdict": "proved"}],
        "tests": ["law: 200 commands"],
        "failures": [],
        "assumptions": ["the plant is as declared"],
    }


def test_a_verification_names_every_claim_and_what_stays_assumed(
    verification: dict[str, Any],
) -> None:
    assert summary(verification) == [
        "proved    U1[x1]  phi_1(p_1) > F*_1",
        "checked   law: 200 commands",
        "assumed, not proved:",
        "  - the plant is as declared",
        "verdict: proved",
    ]


def test_a_twin_that_differs_overrules_the_proof(verification: dict[str, Any]) -> None:
    verification |= {"status": "refuted", "failures": ["plant.json: 3 is not 4"]}
    lines = summary(verification)
    assert "fails     plant.json: 3 is not 4" in lines
    assert lines[-1] == "verdict: refuted"
