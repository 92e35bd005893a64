"""What a certificate says, apart from how it is proved."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from bfppc_synth.errors import NotCertifiedError


class Verdict(StrEnum):
    """The three answers about a claim, and the status of a form that is never certified."""

    CERTIFIED = "certified"
    REFUTED = "refuted"
    UNDECIDED = "undecided"
    PRINTED = "printed"


class Strictness(StrEnum):
    """Whether lhs > rhs is asked, or only lhs >= rhs (the paper's printed form)."""

    STRICT = "strict"
    WEAK = "weak"


@dataclass(frozen=True, slots=True, kw_only=True)
class Inequality:
    """lhs > rhs as two enclosures.

    ``id`` is the name that users meet (``U1[x1]``); ``binding_terms`` are (term, share of the
    right side) from the largest down.
    """

    id: str
    equation: str
    lhs: tuple[float, float]
    rhs: tuple[float, float]
    holds: bool
    binding_terms: tuple[tuple[str, float], ...] = ()

    @property
    def margin(self) -> float:
        """Distance between the enclosures; positive is good."""
        return self.lhs[0] - self.rhs[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """Verdict, the inequalities, what stays assumed, and the file that proves it.

    ``assumption_checks`` are the claims about the plant file itself (f_bound, g_bound, g_min).
    ``document`` is the text of certificate.json (empty where none is produced).
    """

    verdict: Verdict
    inequalities: tuple[Inequality, ...]
    assumptions: tuple[str, ...]
    failures: tuple[str, ...]
    assumption_checks: tuple[Inequality, ...] = ()
    document: str = ""

    def require(self) -> None:
        """Raise NotCertifiedError, naming the inequality, unless certified."""
        if self.verdict is not Verdict.CERTIFIED:
            raise NotCertifiedError("; ".join(self.failures) or f"status {self.verdict}")
