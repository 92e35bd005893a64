"""What an audit is made of: a candidate, its inequalities, what would mend them, its runs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from bfppc_synth.model.certificate import Verdict

if TYPE_CHECKING:
    from bfppc_synth.model.bounds import ChainBounds
    from bfppc_synth.model.certificate import Certificate
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.spec import Form, PlantSpec
    from bfppc_synth.model.trajectory import StagePeaks


class Answer(StrEnum):
    """What an audit comes to; a broken run weighs more than a proof for other starts."""

    PROVED = "proved"
    HELD = "not proved but held in simulation"
    BROKEN = "broken"
    NOT_PROVED = "not proved"  # and there was nothing to simulate


class Standing(StrEnum):
    """What is known of an assumption; only the separate checker says proved."""

    PROVED = "proved"
    UNDECIDED = "undecided"
    HOLDS = "holds"
    FAILS = "fails"
    UNBROKEN = "no violation met"


class Origin(StrEnum):
    """Where the numbers of an audited candidate come from."""

    GIVEN = "given"
    SOLVED = "solved"
    CLOSEST = "closest"


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """Gains and half-widths with nothing left open; ``c_0`` is Theorem 1's, else None."""

    gains: tuple[Gain, ...]
    half_widths: tuple[float, ...]
    c_0: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Completion:
    """A candidate, which open keys were filled in for it, and which absent terms are 0 in it."""

    candidate: Candidate
    origin: Origin
    filled: tuple[str, ...]
    zeroed: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Remedy:
    """A number of the file that decides an inequality, alone, all others as they are.

    ``have`` is its value and ``need`` the nearest one with which the inequality holds (where
    it holds already: the smallest one that would do); None where no value of it does.
    """

    path: str
    symbol: str
    have: float
    need: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """One inequality in one form: lhs ``relation`` rhs, and what decides it."""

    id: str
    relation: str
    lhs: float
    rhs: float
    holds: bool
    remedies: tuple[Remedy, ...]

    @property
    def margin(self) -> float:
        """Distance of the sides; positive is good."""
        return self.lhs - self.rhs


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """The same demand in the printed and in the sound form; a form may lack it.

    ``path`` is the number of the file that decides it, the first remedy's where there is one.
    """

    equation: str
    path: str
    step: int
    state: str
    printed: Side | None
    sound: Side | None
    notes: tuple[str, ...] = ()

    @property
    def id(self) -> str:
        """Name of the row: that of the form which has it, both where they differ."""
        names = [side.id for side in (self.printed, self.sound) if side is not None]
        return " / ".join(dict.fromkeys(names))


@dataclass(frozen=True, slots=True, kw_only=True)
class Assumption:
    """Something that the theorems take for granted, and what is known of it.

    ``local`` says that it holds where the tube keeps the state and fails further out.
    """

    id: str
    path: str
    statement: str
    standing: Standing
    detail: str
    local: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FormReport:
    """One form of the method for the audited numbers.

    ``bounds`` is None where a bound breaks down, as ``failures`` says; ``certificate`` is
    there for the sound form only.
    """

    form: Form
    bounds: ChainBounds[float] | None
    holds: bool
    failures: tuple[str, ...]
    certificate: Certificate | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Escape:
    """The first bound that a run broke: an error's number (0 is the input), and by how much.

    ``time`` [s] is None where the run left it between two rows that were kept; ``jump`` says
    that it was left at the very switch into ``stage``.
    """

    error: int
    stage: int | None
    time: float | None
    jump: bool
    bound: float
    reached: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RunReport:
    """One simulated run of the bare law; ``declared`` says whether its start is the file's."""

    start: tuple[float, ...]
    declared: bool
    horizon: float
    half_widths: tuple[float, ...]
    max_abs_e: tuple[float, ...]
    max_abs_u: float
    peak_input: float
    diverged: bool
    stages: tuple[StagePeaks, ...]
    escape: Escape | None

    @property
    def held(self) -> bool:
        """Whether every bound was kept to the horizon."""
        return self.escape is None and not self.diverged

    def answer(self, proof: Certificate | None) -> Answer:
        """Say what is known of this start: a proof speaks of declared starts only."""
        if not self.held:
            return Answer.BROKEN
        certified = proof is not None and proof.verdict is Verdict.CERTIFIED
        return Answer.PROVED if certified and self.declared else Answer.HELD


@dataclass(frozen=True, slots=True, kw_only=True)
class Audit:
    """Everything that ``check`` says; ``spec`` is the file with nothing left open."""

    spec: PlantSpec
    completion: Completion
    rows: tuple[Row, ...]
    assumptions: tuple[Assumption, ...]
    printed: FormReport | None
    sound: FormReport
    runs: tuple[RunReport, ...]
    notes: tuple[str, ...]

    @property
    def proved(self) -> bool:
        """Whether the separate checker has proved the sound form."""
        certificate = self.sound.certificate
        return certificate is not None and certificate.verdict is Verdict.CERTIFIED

    @property
    def answer(self) -> Answer:
        """The answer in one word."""
        if not all(run.held for run in self.runs):
            return Answer.BROKEN
        if self.proved:
            return Answer.PROVED
        return Answer.HELD if self.runs else Answer.NOT_PROVED
