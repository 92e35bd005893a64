"""The checker's answers as the records of the model: sides, verdicts, the paper's equations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bfppc_synth.certificate import checker
from bfppc_synth.model.certificate import Inequality

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.certificate.checker import Report

_EQUATIONS = {
    "U0": "Theorem U",
    "U1": "(65)",
    "U2": "(71)",
    "U2'": "(71)",
    "T1.p": "(14)",
    "T1.H": "(31)",
    "T1.c": "(39)",
    "T1.gamma": "(39)",
    "T1'.gamma": "(39)",
    "funnel": "docs/theory.md sections 2 and 4",
}
_TIGHT = ("tight", "tight.rate")
_CHECKS = ("f_bound", "g_min", "g_bound")


def judged_inequalities(
    plant_document: Mapping[str, Any], certificate: Mapping[str, Any], report: Report
) -> tuple[tuple[Inequality, ...], tuple[Inequality, ...]]:
    """Split the claims into the theorem's inequalities and the checks of the plant file.

    Parameters
    ----------
    plant_document, certificate : Mapping[str, Any]
        Contents of plant.json and certificate.json.
    report : Report
        What the checker answers about them.

    Returns
    -------
    tuple
        Inequalities, then checks; enclosures as doubles rounded outward; none of both where
        the checker did not come to the claims.
    """
    verdicts = {result.id: result.verdict for result in report.claims}
    if not verdicts:
        return (), ()
    obligations = checker.read_design(certificate["design"]).obligations(plant_document)
    listed = [claim["id"] for claim in certificate["claims"]]
    inequalities: list[Inequality] = []
    checks: list[Inequality] = []
    for obligation in checker.expected_claims(obligations, listed):
        family, _, place = obligation.id.partition("[")
        if family in ("accuracy", "fixed"):
            continue
        target = checks if family.partition(".")[0] in _CHECKS else inequalities
        proved = verdicts[obligation.id] == "proved"
        if not obligation.comparisons:
            # A pointwise claim has no two numbers; its distance from failing is not computed.
            target.append(
                Inequality(
                    id=obligation.id,
                    equation=f"docs/theory.md section {9 if family in _TIGHT else 6}",
                    lhs=(0.0, 0.0),
                    rhs=(0.0, 0.0),
                    holds=proved,
                )
            )
            continue
        rest = f"[{place}" if place else ""
        last = "(71)" if obligation is obligations.claims[-1] else "(65)"
        equation = _EQUATIONS.get(family, last if family == "T2" else "docs/theory.md section 3")
        if family in _TIGHT:
            equation = "docs/theory.md section 9"
        if family.startswith("T3"):
            equation = "(75), docs/theory.md section 8"
        for name, comparison in zip(_names(family), obligation.comparisons, strict=False):
            target.append(
                Inequality(
                    id=f"{name}{rest}",
                    equation=equation,
                    lhs=checker.to_doubles(comparison.lhs),
                    rhs=checker.to_doubles(comparison.rhs),
                    holds=proved if obligation.pointwise else comparison.verdict() == "proved",
                )
            )
    return tuple(inequalities), tuple(checks)


def _names(family: str) -> tuple[str, str]:
    """Name both comparisons of a claim: the second is at rho = 1, or says that there is room."""
    return (family, "T1'.gamma" if family == "T1.gamma" else f"{family}.room")
