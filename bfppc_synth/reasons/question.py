"""One plant file without a design, asked again with other values."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.errors import BfppcError, EnvelopeError
from bfppc_synth.expressions.evaluate import evaluate_float
from bfppc_synth.gains.elastic import factor, nearest_miss
from bfppc_synth.gains.theorem1.search import search_theorem1
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.spec import BoundsKind, CenterKind, Method
from bfppc_synth.spec.edits import changed
from bfppc_synth.synthesis.prepare import prepare, problem_of_theorem1
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.gains.elastic import Miss
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.spec.edits import Edit


# What an edited file may end in: a refusal, or numbers beyond what anything here computes with.
_BROKEN = (BfppcError, ArithmeticError, ValueError)


def _silent(message: str) -> None:
    del message


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """How long a user is kept waiting: until this reading of the monotonic clock [s]."""

    until: float

    @classmethod
    def of(cls, seconds: float) -> Patience:
        """Wait this long from now."""
        return cls(until=time.monotonic() + seconds)

    @property
    def is_over(self) -> bool:
        """Whether to stop asking."""
        return time.monotonic() > self.until


class Question:
    """The plant file and its problem; remembers the last nearest miss as the next start."""

    def __init__(
        self,
        spec: PlantSpec,
        problem: DesignProblem | None,
        arithmetic: Arithmetic,
        patience: Patience,
    ) -> None:
        self.spec = spec
        self.problem = problem
        self.patience = patience
        self._arithmetic = arithmetic
        self._near: Miss | None = None
        self._misses: dict[tuple[Edit, ...], float] = {}

    @property
    def start(self) -> float:
        """y_d(0), where the error of the first state starts from 0; 0 where it is not known."""
        plant = None if self.problem is None else self.problem.plant
        if plant is None or plant.reference is None:
            return 0.0
        try:
            return evaluate_float(plant.reference, {plant.time: 0.0})
        except EnvelopeError:
            return 0.0

    @property
    def is_tight(self) -> bool:
        """Whether a design may do with less than the estimates of ``miss`` say."""
        return self.spec.synthesis.bounds is BoundsKind.TIGHT

    def miss(self, edits: tuple[Edit, ...]) -> float:
        """Return by which factor (its log) the nearest design of the edited file misses.

        Infinity where the edited file has mistakes or its bounds break down. An estimate, by
        termwise bounds: what it finds feasible is still to be certified.
        """
        if edits not in self._misses:
            self._misses[edits] = self._missed(edits)
        return self._misses[edits]

    def _missed(self, edits: tuple[Edit, ...]) -> float:
        try:
            spec = changed(self.spec, edits)
            if spec.synthesis.method is Method.THEOREM1:
                found_1 = search_theorem1(problem_of_theorem1(spec), _silent)
                return math.inf if found_1 is None else 0.0
            problem = self._posed(spec)
        except _BROKEN:
            return math.inf
        found = nearest_miss(problem, self._near)
        if found is not None:
            self._near = found
        return factor(found)

    def _posed(self, spec: PlantSpec) -> DesignProblem:
        """Build the edited problem; a T_s that the file leaves open stays as it was chosen."""
        transition = None
        base = self.problem
        nominal = spec.synthesis.center is CenterKind.NOMINAL
        if (
            nominal
            and base is not None
            and base.nominal is not None
            and spec.performance.transition is None
        ):
            transition = base.nominal.model.transition
        return prepare(spec, transition=transition, arithmetic=self._arithmetic)[0]

    def certified(
        self, edits: tuple[Edit, ...], progress: Callable[[str], None] = _silent
    ) -> Design | None:
        """Synthesize the edited file as a user would; None where nothing is certified."""
        try:
            design = synthesize(
                changed(self.spec, edits), progress=progress, arithmetic=self._arithmetic
            )
        except _BROKEN:
            return None
        return design if design.certificate.verdict is Verdict.CERTIFIED else None
