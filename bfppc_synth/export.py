"""A certified folder's claims for other provers: from the certificate to DIR/interop."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from bfppc_synth.certificate import checker
from bfppc_synth.errors import NotCertifiedError, UsageError
from bfppc_synth.export_chain import Chain, variables_of
from bfppc_synth.interop.claims import Claim, InexpressibleError, Provenance, Relation, number
from bfppc_synth.interop.coq import lemma, render_coq
from bfppc_synth.interop.smt2 import render_smt2

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from bfppc_synth.certificate.checker import Goal, Obligation, Obligations


# Methods whose chain export_chain states as claims.
EXPORTED = ("unified", "theorem2")


class Target(StrEnum):
    """The formats that this version writes."""

    SMT2 = "smt2"
    COQ = "coq"


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """Files written, relative to the folder, and the claims that the format cannot say."""

    name: str
    target: Target
    files: tuple[str, ...]
    claims: tuple[str, ...]
    left_out: tuple[str, ...]


def export_claims(folder: Path, target: Target) -> Exported:
    """Write the claims of a certified folder under ``folder/interop``.

    Parameters
    ----------
    folder : Path
        A generated folder.
    target : Target
        SMT2: ``interop/smt2/CLAIM.smt2``, one file a claim; COQ: ``interop/coq/NAME.v``.

    Returns
    -------
    Exported
        Equal folders give equal files.

    Raises
    ------
    UsageError
        If the folder has no readable plant.json and certificate.json.
    NotCertifiedError
        If the checker does not prove the certificate: false claims are not handed on.

    References
    ----------
    docs/theory.md section 6.
    """
    obligations, provenance, forms = _read(folder)
    claims = claims_of(obligations, forms)
    texts, left_out = {}, []
    if target is Target.SMT2:
        for claim in claims:
            texts[f"interop/smt2/{claim.label}.smt2"] = render_smt2(claim, provenance)
    else:
        kept = []
        for claim in claims:
            try:
                lemma(claim)
            except InexpressibleError as error:
                left_out.append(f"{claim.id}: {error}")
            else:
                kept.append(claim)
        texts[f"interop/coq/{provenance.plant}.v"] = render_coq(kept, provenance)
        claims = tuple(kept)
    place = folder / "interop" / target.value
    try:
        place.mkdir(parents=True, exist_ok=True)
        # What an earlier design left would be claims about other gains.
        for old in sorted(place.glob("*.smt2" if target is Target.SMT2 else "*.v")):
            old.unlink()
        for path, text in texts.items():
            (folder / path).write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise UsageError(f"{place}: {error.strerror}; fix: make the folder writable") from error
    return Exported(
        name=provenance.plant,
        target=target,
        files=tuple(texts),
        claims=tuple(claim.label for claim in claims),
        left_out=tuple(left_out),
    )


def _read(folder: Path) -> tuple[Obligations, Provenance, Mapping[str, str]]:
    """Derive the obligations again; the certificate says only which form of each holds."""
    for name in ("plant.json", "certificate.json"):
        if not (folder / name).is_file():
            raise UsageError(
                f"{folder}: no {name}: nothing proved to export; fix: name a folder that "
                "bfppc-synth wrote for a certified design"
            )
    try:
        plant = checker.read_json(folder / "plant.json")
        certificate = checker.read_json(folder / "certificate.json")
        report = checker.check_documents(plant, certificate)
        if report.verdict == "proved":
            design = checker.read_design(certificate["design"])
            obligations = design.obligations(plant)
    except checker.MalformedError as error:
        raise UsageError(f"{folder}: {error}; fix: run bfppc-synth on its plant.yaml") from error
    if report.verdict == "malformed":
        raise UsageError(
            f"{folder}: {'; '.join(report.failures)}; fix: run bfppc-synth on its plant.yaml"
        )
    if report.verdict != "proved":
        raise NotCertifiedError(f"{folder}: {report.verdict}: {'; '.join(report.failures)}")
    provenance = Provenance(
        plant=obligations.problem.name,
        tool=certificate["tool"],
        plant_sha256=certificate["plant_sha256"],
        theorem=certificate["theorem"],
    )
    forms = {claim["id"]: claim["proof"]["kind"] for claim in certificate["claims"]}
    return obligations, provenance, forms


def claims_of(obligations: Obligations, forms: Mapping[str, str]) -> tuple[Claim, ...]:
    """State a certificate's claims and the constants of its chain as real inequalities.

    Parameters
    ----------
    obligations : Obligations
        What the checker derives for these gains.
    forms : Mapping[str, str]
        Id of each claim -> kind of its proof: ``corner`` is the weaker form, and ``U2'`` among
        the ids says which last inequality holds.

    Returns
    -------
    tuple[Claim, ...]
        Checks of the plant file, then the chain state by state, then the gain inequalities.
    """
    problem = obligations.problem
    if problem.method not in EXPORTED:
        raise UsageError(
            f"{problem.name}: claims of method {problem.method} are not available in this"
            " version; fix: export a design of method unified or theorem2"
        )
    if problem.center != "performance":
        raise UsageError(
            f"{problem.name}: claims of center {problem.center} are not available in this"
            " version; fix: export a design of center performance"
        )
    if problem.bounds == "tight":
        raise UsageError(
            f"{problem.name}: claims of bounds tight are not available in this version; fix:"
            " export a design of `bounds: termwise`"
        )
    expected = checker.expected_claims(obligations, list(forms))
    chain = Chain(obligations)
    claims: list[Claim] = []
    for obligation in expected:
        claims += _pointwise(obligation, forms[obligation.id])
    for i in range(len(obligations.gains)):
        claims += chain.constants(i)
    claims += chain.peak()
    for obligation in expected:
        claims += chain.inequality(obligation)
    return tuple(claims)


def _pointwise(obligation: Obligation, form: str) -> list[Claim]:
    goals = obligation.corner if form == "corner" else obligation.pointwise
    claims = []
    for index, goal in enumerate(goals, 1):
        stem, _, rest = obligation.id.partition("[")
        claims.append(
            Claim(
                id=f"{stem}.{index}[{rest}",
                statement=obligation.statement,
                lhs=goal.node,
                relation=Relation.AT_MOST,
                rhs=number(0),
                variables=variables_of(goal.ranges, goal.node),
                note=_orthant(goal, form),
            )
        )
    return claims


def _orthant(goal: Goal, form: str) -> str:
    if form == "corner":
        return "the weaker form: against the number that the chain uses"
    sides = [f"{name[1:]} = {'-' if side < 0 else ''}m_{name[1:]}" for name, side in goal.signs]
    where = f"for {', '.join(sides)}: " if sides else ""
    return f"{where}left side minus right side, without a common factor that is not negative"
