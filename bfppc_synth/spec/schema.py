"""The plant file's keys, their ranges and defaults: the one description that all else reads."""

from __future__ import annotations

from typing import Final

from bfppc_synth.model.spec import (
    Anchor,
    BoundsKind,
    CenterKind,
    Form,
    Method,
    Objective,
)
from bfppc_synth.model.stages import Handover
from bfppc_synth.spec.kinds import (
    Choice,
    Coverage,
    Either,
    Field,
    Formula,
    Integer,
    ListOf,
    Number,
    OneOrPerState,
    Parameters,
    PerState,
    Range,
    Rule,
    Scope,
    Section,
    StateNames,
    Text,
    TextForm,
    Units,
)
from bfppc_synth.spec.sections import (
    CHANNEL,
    DECLARED_REFERENCE,
    GAINS,
    QUANTIZER,
    RHO,
    RUNTIME_REFERENCE,
    STAGE,
    THEOREM1,
    WEIGHTS,
)

MOST_STATES: Final = 12

_POSITIVE: Final = Number(rule=Rule.POSITIVE)
_NONNEGATIVE: Final = Number(rule=Rule.NONNEGATIVE)
_TIME: Final = Formula(scope=Scope.TIME)

_PERFORMANCE: Final = Section(
    fields=(
        Field(key="accuracy", kind=_POSITIVE, description="p_1", required=True),
        Field(
            key="rho",
            kind=OneOrPerState(item=RHO),
            description="performance functions",
            default="{kind: cosine, t_s: 1}",
        ),
        Field(key="transition", kind=_POSITIVE, description="center nominal: T_s [s]"),
        Field(key="funnel", kind=_TIME, description="bound on abs(y - y_d) over time"),
    )
)
_MEASUREMENT: Final = Section(
    fields=(
        Field(
            key="quantizer",
            kind=OneOrPerState(item=QUANTIZER),
            description="how each state is quantized",
            default="{kind: none}",
        ),
        Field(
            key="noise",
            kind=OneOrPerState(item=_NONNEGATIVE),
            description="bound on the noise of each state",
            default="0",
        ),
    )
)
_SAMPLING: Final = Section(
    fields=(
        Field(
            key="period",
            kind=_NONNEGATIVE,
            description="largest time between samples [s]",
            default="0",
        ),
        Field(key="delay", kind=_NONNEGATIVE, description="largest delay [s]", default="0"),
    )
)
_ACTUATOR: Final = Section(
    fields=(
        Field(key="limit", kind=_POSITIVE, description="peak input that the design must keep"),
        Field(
            key="error", kind=_NONNEGATIVE, description="bound on the actuator error", default="0"
        ),
    )
)


def _choice(key: str, words: tuple[str, ...], default: str, description: str) -> Field:
    return Field(key=key, kind=Choice(words=words), description=description, default=default)


_SYNTHESIS: Final = Section(
    fields=(
        _choice("method", tuple(Method), "unified", "the theorem that is used"),
        _choice("form", tuple(Form), "sound", "sound inequalities, or the paper's as printed"),
        # Its default depends on the plant: spec.centers.
        _choice("center", tuple(CenterKind), "", "what the errors are taken around"),
        _choice("bounds", tuple(BoundsKind), "termwise", "how the drift is bounded"),
        _choice("anchor", tuple(Anchor), "latched", "whether the center starts as measured"),
        Field(
            key="objective",
            kind=Either(scalar=Choice(words=tuple(Objective)), sections=(WEIGHTS,)),
            description="what is minimized, or weights",
            default="balanced",
        ),
        Field(
            key="gains",
            kind=PerState(item=GAINS, coverage=Coverage.SOME),
            description="gains that are fixed",
        ),
        Field(
            key="p",
            kind=PerState(item=_POSITIVE, coverage=Coverage.SOME),
            description="tube half-widths that are fixed, from the second state on",
        ),
        Field(
            key="stages",
            kind=ListOf(item=STAGE, wanted="a free stage"),
            description="theorem3: the free stages; the last, certified one is p and gains",
        ),
        _choice("handover", tuple(Handover), "reanchor", "theorem3: what happens at a switch"),
        Field(key="theorem1", kind=THEOREM1, description="theorem1: c_0, epsilon, H"),
    )
)
_SIMULATION: Final = Section(
    fields=(
        Field(key="horizon", kind=_POSITIVE, description="length of a run [s]"),
        Field(key="period", kind=_POSITIVE, description="step of a run [s]"),
        Field(
            key="seed",
            kind=Integer(lowest=0, highest=2**32 - 1),
            description="seed of the adversarial runs",
            default="1",
        ),
    )
)
PLANT: Final = Section(
    fields=(
        Field(
            key="name",
            kind=Text(form=TextForm.PLANT_NAME),
            description="prefix of every generated symbol",
            required=True,
        ),
        Field(key="title", kind=Text(), description="heading of the report"),
        Field(key="units", kind=Units(), description="texts for the report"),
        Field(key="parameters", kind=Parameters(), description="constants, or ranges"),
        Field(
            key="states", kind=StateNames(), description="in strict-feedback order", required=True
        ),
        Field(
            key="dynamics",
            kind=PerState(item=CHANNEL, coverage=Coverage.ALL),
            description="dx_i = f + g x_(i+1)",
            required=True,
        ),
        Field(
            key="reference",
            kind=Either(scalar=_TIME, sections=(RUNTIME_REFERENCE, DECLARED_REFERENCE)),
            description="y_d",
            default="0",
        ),
        Field(
            key="initial",
            kind=PerState(
                item=Range(),
                coverage=Coverage.ALL,
                besides=(
                    Field(
                        key="offset",
                        kind=_NONNEGATIVE,
                        description="bound on abs(x_1(0) - y_d(0)) with a run-time reference",
                    ),
                ),
            ),
            description="initial states that the certificate covers",
            required=True,
        ),
        Field(key="performance", kind=_PERFORMANCE, description="what is asked", required=True),
        Field(key="measurement", kind=_MEASUREMENT, description="what is measured, how finely"),
        Field(key="sampling", kind=_SAMPLING, description="the computer's timing"),
        Field(key="actuator", kind=_ACTUATOR, description="the actuator"),
        Field(key="synthesis", kind=_SYNTHESIS, description="how to synthesize"),
        Field(key="simulation", kind=_SIMULATION, description="how to simulate"),
    )
)
