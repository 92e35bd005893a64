"""The plant file as frozen records: checked for grammar, names and ranges; free of sympy."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from bfppc_synth.model.stages import Handover, StageSpec

if TYPE_CHECKING:
    from bfppc_synth.model.chosen import Chosen
    from bfppc_synth.model.expression import Constant, Expression
    from bfppc_synth.model.theorem1 import Theorem1Spec


class Method(StrEnum):
    """The theorem that a design rests on."""

    UNIFIED = "unified"
    THEOREM1 = "theorem1"
    THEOREM2 = "theorem2"
    THEOREM3 = "theorem3"


class Form(StrEnum):
    """The sound inequalities, or the paper's as printed."""

    SOUND = "sound"
    PRINTED = "printed"


THEOREMS = {
    (Method.UNIFIED, Form.SOUND): "Theorem U (docs/theory.md sections 2 to 4)",
    (Method.THEOREM1, Form.SOUND): "Theorem 1, sound form (docs/theory.md section 7)",
    (Method.THEOREM1, Form.PRINTED): "Theorem 1 as printed in the paper, never certified",
    (Method.THEOREM2, Form.SOUND): "Theorem 2, sound form (docs/theory.md section 2)",
    (Method.THEOREM2, Form.PRINTED): "Theorem 2 as printed in the paper, never certified",
    (Method.THEOREM3, Form.SOUND): "Theorem 3, sound form (docs/theory.md section 8)",
    (Method.THEOREM3, Form.PRINTED): "Theorem 3 as printed in the paper, never certified",
}


class CenterKind(StrEnum):
    """The known trajectory around which the errors are taken (docs/theory.md section 2)."""

    PERFORMANCE = "performance"
    NOMINAL = "nominal"


class BoundsKind(StrEnum):
    """How W_i is bounded."""

    TERMWISE = "termwise"
    TIGHT = "tight"


class Anchor(StrEnum):
    """Whether the center starts from the measured or from the true initial state."""

    LATCHED = "latched"
    EXACT = "exact"


class Objective(StrEnum):
    """What the synthesis minimizes or maximizes."""

    BALANCED = "balanced"
    PEAK_INPUT = "peak-input"
    SLOPE = "slope"
    ACCURACY = "accuracy"
    PERIOD = "period"
    RESOLUTION = "resolution"


class ReferenceKind(StrEnum):
    """Where the reference comes from."""

    EXPRESSION = "expression"
    DECLARED = "declared"
    RUNTIME = "runtime"


class RhoKind(StrEnum):
    """The paper's performance functions (52) and (53)."""

    COSINE = "cosine"
    EXPONENTIAL = "exponential"


class QuantizerKind(StrEnum):
    """The quantizers of docs/theory.md and SPEC section 1."""

    NONE = "none"
    UNIFORM = "uniform"
    HYSTERESIS_UNIFORM = "hysteresis-uniform"
    LOGARITHMIC_UNIFORM = "logarithmic-uniform"


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A position in the plant file; line and column count from 1."""

    line: int
    column: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """A closed range; a plain number has lower == upper (the same object)."""

    lower: Constant
    upper: Constant


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterSpec:
    """A named constant, or a range that it may move through at any speed."""

    name: str
    range: Interval


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSpec:
    """One line of the dynamics, dx_i = f + g x_{i+1}; absent entries are None."""

    state: str
    f: Expression | None
    g: Expression | None
    f_bound: Expression | None
    g_bound: Expression | None
    g_min: Expression | None
    disturbance: Expression | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceSpec:
    """The reference y_d.

    ``expression``: EXPRESSION and DECLARED. ``bounds``: DECLARED (value bound, rate) and
    RUNTIME (Y_0, Y_1, ...); empty for EXPRESSION.
    """

    kind: ReferenceKind
    expression: Expression | None
    bounds: tuple[Constant, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RhoSpec:
    """A performance function; COSINE uses t_s, EXPONENTIAL rate and floor."""

    kind: RhoKind
    t_s: Constant | None
    rate: Constant | None
    floor: Constant | None
    rate_bound: Constant | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PerformanceSpec:
    """What is asked of the output; one rho per state."""

    accuracy: Constant | None
    rho: tuple[RhoSpec, ...]
    transition: Constant | None
    funnel: Expression | None


@dataclass(frozen=True, slots=True, kw_only=True)
class QuantizerSpec:
    """A quantizer; keys that its kind does not have are None."""

    kind: QuantizerKind
    step: Constant | None = None
    dead_zone: Constant | None = None
    hysteresis: Constant | None = None
    minimum: Constant | None = None
    density: Constant | None = None
    threshold: Constant | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementSpec:
    """Quantizer and noise bound of every state."""

    quantizers: tuple[QuantizerSpec, ...]
    noise: tuple[Constant, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class SamplingSpec:
    """Largest time between samples and largest delay [s]; both 0 mean continuous."""

    period: Constant
    delay: Constant


@dataclass(frozen=True, slots=True, kw_only=True)
class ActuatorSpec:
    """The limit that U keeps, and the actuator error bound."""

    limit: Constant | None
    error: Constant


@dataclass(frozen=True, slots=True, kw_only=True)
class GainSpec:
    """Gains that the file fixes, None is free; gamma, H and H_star belong to theorem1."""

    k: Constant | None = None
    M: Constant | None = None
    epsilon: Constant | None = None
    c: Constant | None = None
    N: int = 3
    gamma: Constant | None = None
    H: tuple[Constant, ...] | None = None
    H_star: Constant | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SynthesisSpec:
    """What to synthesize and how; p of the first state is None; ``stages`` are theorem3's."""

    method: Method
    form: Form
    center: CenterKind
    bounds: BoundsKind
    anchor: Anchor
    objective: tuple[tuple[Objective, float], ...]
    gains: tuple[GainSpec, ...]
    p: tuple[Constant | None, ...]
    theorem1: Theorem1Spec | None = None
    stages: tuple[StageSpec, ...] = ()
    handover: Handover = Handover.REANCHOR


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationSpec:
    """Horizon and step of the simulation [s], and the seed of the adversarial runs."""

    horizon: float
    period: float
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantSpec:
    """A whole plant file.

    ``source`` is the file's text, ``sha256`` of its bytes; ``document`` is the file as nested
    (key, value) tuples of source texts; ``places`` maps a dotted path to its place; ``notes``
    are for stderr. ``chosen`` is what an inverse objective has set, in the records only.
    """

    path: str
    source: str
    sha256: str
    document: object
    places: tuple[tuple[str, Place], ...]
    notes: tuple[str, ...]
    name: str
    title: str
    units: tuple[tuple[str, str], ...]
    parameters: tuple[ParameterSpec, ...]
    states: tuple[str, ...]
    dynamics: tuple[ChannelSpec, ...]
    reference: ReferenceSpec
    initial: tuple[Interval, ...]
    offset: Constant | None
    performance: PerformanceSpec
    measurement: MeasurementSpec
    sampling: SamplingSpec
    actuator: ActuatorSpec
    synthesis: SynthesisSpec
    simulation: SimulationSpec
    chosen: Chosen | None = None

    @property
    def order(self) -> int:
        """Number of states n."""
        return len(self.states)

    @property
    def source_bytes(self) -> bytes:
        """The bytes of the plant file; their SHA-256 is ``sha256``."""
        return self.source.encode()

    def gives(self, path: str) -> bool:
        """Whether the file itself has this dotted path."""
        return path in dict(self.places)

    def place(self, path: str) -> Place:
        """Place of a dotted path, or of its nearest ancestor that the file has."""
        known = dict(self.places)
        while path not in known and "." in path:
            path = path.rpartition(".")[0]
        return known.get(path, Place(line=1, column=1))
