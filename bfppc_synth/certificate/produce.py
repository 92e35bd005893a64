"""The untrusted side of a certificate: find proofs, write them down, read the answer back.

Nothing here is believed by the checker. A tree that is small enough to be checked in a second
is found about as fast by the checker's own interval arithmetic, so that is what searches.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.answers import judged_inequalities
from bfppc_synth.certificate.entries import design_document
from bfppc_synth.certificate.trees import find_trees
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.certificate import Certificate, Verdict

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.certificate.checker import Obligation, Obligations
    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.chosen import Chosen
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.stages import Stage
    from bfppc_synth.model.tight import TightBounds

# Room of the clamp above U, as codegen.limits gives it.
_PEAK_ROOM = 1.0 + 2.0**-40
# Below this relative distance of the two sides a margin is called thin.
THIN_MARGIN = 1e-9


def produce_certificate(
    plant_document: Mapping[str, Any],
    shapes: tuple[Gain, ...],
    half_widths: tuple[float, ...],
    *,
    tool: str,
    c_0: float | None = None,
    stages: tuple[Stage, ...] = (),
    transition: float | None = None,
    tight: TightBounds | None = None,
    arithmetic: Arithmetic = DEFAULT,
    chosen: Chosen | None = None,
) -> dict[str, Any]:
    """Write the certificate of a design, proved or not.

    Parameters
    ----------
    plant_document : Mapping[str, Any]
        Content of plant.json.
    shapes : tuple[Gain, ...]
        Feedback phi_1..phi_n, the binary64 numbers of the controller.
    half_widths : tuple[float, ...]
        Tube half-widths p_1..p_n [unit of x_i].
    tool : str
        Name and version of what produced it.
    c_0 : float, optional
        What theorem1 allows the power terms to add.
    stages : tuple[Stage, ...]
        The free stages of theorem3, with their widened tubes.
    transition : float, optional
        T_s of center nominal [s].
    tight : TightBounds, optional
        Claimed loads and rate, where the plant file asks for bounds tight.
    arithmetic : Arithmetic
        What the controller computes with; all numbers are of its type.
    chosen : Chosen, optional
        What an inverse objective of the plant file has set.

    Returns
    -------
    dict[str, Any]
        Content of certificate.json: texts, integers, lists; no decimal number. It has no claims
        where a bound breaks down (a pole in the reachable box) or no theorem is available.

    References
    ----------
    docs/theory.md section 6.
    """
    design = design_document(
        shapes, half_widths, c_0, stages, transition, arithmetic, tight, chosen
    )
    claims: list[dict[str, Any]] = []
    enclosures: dict[str, list[str]] = {}
    peak, method = 0.0, "unified"
    try:
        obligations = checker.read_design({**design, "U_MAX": peak.hex()}).obligations(
            plant_document
        )
    except checker.Refusal:
        # The checker names the reason when it meets it again.
        pass
    else:
        claims = [_claim(obligation) for obligation in alternatives(obligations)]
        enclosures = {
            key: checker.hex_pair(value) for key, value in sorted(obligations.enclosures.items())
        }
        peak, method = _clamp(obligations, arithmetic), obligations.problem.method
    return {
        "format": checker.CERTIFICATE_FORMAT,
        "tool": tool,
        "plant_sha256": plant_document["plant_sha256"],
        "theorem": checker.THEOREMS[method],
        "design": {**design, "U_MAX": peak.hex()},
        "enclosures": enclosures,
        "claims": claims,
    }


def tool_name() -> str:
    """Name and version of this package, as a certificate states them."""
    from importlib.metadata import version

    return f"bfppc-synth {version('bfppc-synth')}"


def certificate_text(certificate: Mapping[str, Any]) -> str:
    """Return the text of certificate.json; equal certificates give equal bytes."""
    return json.dumps(certificate, indent=1, ensure_ascii=True) + "\n"


def judge(plant_document: Mapping[str, Any], certificate: Mapping[str, Any]) -> Certificate:
    """Ask the checker, and put its answer into the model's record.

    Parameters
    ----------
    plant_document, certificate : Mapping[str, Any]
        Contents of plant.json and certificate.json.

    Returns
    -------
    Certificate
        CERTIFIED only if the checker says proved; enclosures as doubles rounded outward. The
        document is empty where there is nothing that could be proved.
    """
    text = certificate_text(certificate)
    # Exactly what will be read from the file is judged.
    report = checker.check_documents(plant_document, json.loads(text))
    verdicts = {"proved": Verdict.CERTIFIED, "refuted": Verdict.REFUTED}
    inequalities, checks = judged_inequalities(plant_document, certificate, report)
    return Certificate(
        verdict=verdicts.get(report.verdict, Verdict.UNDECIDED),
        inequalities=inequalities,
        assumptions=report.assumptions,
        failures=report.failures,
        assumption_checks=checks,
        document=text if certificate["claims"] else "",
    )


def thin_margins(certificate: Certificate) -> tuple[str, ...]:
    """Name the inequalities whose sides are closer than ``THIN_MARGIN``, relatively."""
    return tuple(
        entry.id
        for entry in certificate.inequalities
        if entry.lhs[0] - entry.rhs[1] < THIN_MARGIN * abs(entry.rhs[1]) and entry.lhs != (0.0, 0.0)
    )


def alternatives(obligations: Obligations) -> list[Obligation]:
    """Take U2' where it holds and U2 does not."""
    other = obligations.alternative
    if other is None:
        return list(obligations.claims)
    plain = next(claim for claim in obligations.claims if claim.id == other.id.replace("'", ""))
    if not holds(plain) and holds(other):
        return checker.expected_claims(obligations, [other.id])
    return list(obligations.claims)


def holds(obligation: Obligation) -> bool:
    """Whether every comparison of a claim is proved by its enclosures."""
    return all(comparison.verdict() == "proved" for comparison in obligation.comparisons)


def _clamp(obligations: Obligations, arithmetic: Arithmetic) -> float:
    """U_MAX as codegen.limits computes it from the certified U and the actuator limit."""
    peak = checker.to_doubles(obligations.enclosures["U"])[1]
    limit = obligations.problem.limit
    clamp = arithmetic.above(peak * _PEAK_ROOM)
    if limit is None:
        return clamp
    nearest = (limit[0] + limit[1]) / (2 * checker.ONE)
    return clamp if nearest < peak else min(clamp, arithmetic.below(nearest))


def _claim(obligation: Obligation) -> dict[str, Any]:
    claim: dict[str, Any] = {"id": obligation.id, "uses": list(obligation.uses)}
    if obligation.comparisons:
        first = obligation.comparisons[0]
        claim["lhs"], claim["rhs"] = checker.hex_pair(first.lhs), checker.hex_pair(first.rhs)
    claim["proof"] = _proof(obligation)
    return claim


def _proof(obligation: Obligation) -> dict[str, Any]:
    """Search trees for the pointwise form, else for the weaker one, unless it is refuted."""
    if not obligation.pointwise:
        return {"kind": obligation.proof}
    trees = find_trees(obligation.pointwise)
    if trees is not None:
        leaves = [goal.leaf for goal in obligation.pointwise]
        direct = trees == leaves
        return {"kind": "eval"} if direct else {"kind": "bisect", "trees": trees}
    if not obligation.corner or any(goal.witness(200) for goal in obligation.pointwise):
        return {"kind": obligation.proof}
    trees = find_trees(obligation.corner)
    return {"kind": obligation.proof} if trees is None else {"kind": "corner", "trees": trees}
