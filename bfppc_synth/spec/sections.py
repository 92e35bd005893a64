"""The smaller sections of the plant file: a channel, a rho, a quantizer, gains, references."""

from __future__ import annotations

from typing import Final

from bfppc_synth.model.spec import (
    Objective,
    QuantizerKind,
    RhoKind,
)
from bfppc_synth.model.theorem1 import Schedule
from bfppc_synth.spec.kinds import (
    Choice,
    Coverage,
    Field,
    Formula,
    Integer,
    Number,
    Numbers,
    Parity,
    PerState,
    Rule,
    Scope,
    Section,
)

LARGEST_N: Final = 31

_POSITIVE: Final = Number(rule=Rule.POSITIVE)
_NONNEGATIVE: Final = Number(rule=Rule.NONNEGATIVE)
_STATES: Final = Formula(scope=Scope.STATES)
_TIME: Final = Formula(scope=Scope.TIME)

CHANNEL: Final = Section(
    fields=(
        Field(key="f", kind=_STATES, description="drift f_i, or f_bound instead"),
        Field(key="g", kind=_STATES, description="input gain g_i", default="1"),
        Field(key="f_bound", kind=_STATES, description="f*, a bound on abs(f)"),
        Field(key="g_bound", kind=_STATES, description="g*, an upper bound on g"),
        Field(key="g_min", kind=_STATES, description="g_m, a positive lower bound on g"),
        Field(
            key="disturbance",
            kind=_STATES,
            description="bound on an unknown additive term",
            default="0",
        ),
    )
)
RHO: Final = Section(
    fields=(
        Field(
            key="kind",
            kind=Choice(words=tuple(RhoKind)),
            description="cosine is (52), exponential is (53)",
            required=True,
        ),
        Field(key="t_s", kind=_POSITIVE, description="cosine: time constant [s]"),
        Field(key="rate", kind=_POSITIVE, description="exponential: rate [1/s]"),
        Field(
            key="floor",
            kind=Number(rule=Rule.SHARE),
            description="exponential: what remains",
            default="0",
        ),
        Field(key="rate_bound", kind=_POSITIVE, description="declared bound on abs(drho/dt)"),
    )
)
QUANTIZER: Final = Section(
    fields=(
        Field(
            key="kind",
            kind=Choice(words=tuple(QuantizerKind)),
            description="which quantizer",
            required=True,
        ),
        Field(key="step", kind=_POSITIVE, description="width of a cell"),
        Field(key="dead_zone", kind=_NONNEGATIVE, description="uniform: half-width around 0"),
        Field(key="hysteresis", kind=_POSITIVE, description="hysteresis-uniform: at most step/2"),
        Field(key="minimum", kind=_POSITIVE, description="logarithmic-uniform: smallest input"),
        Field(
            key="density",
            kind=Number(rule=Rule.OPEN_SHARE),
            description="logarithmic-uniform: relative error",
        ),
        Field(
            key="threshold",
            kind=_POSITIVE,
            description="logarithmic-uniform: where the uniform cells begin",
        ),
    )
)
_SHAPE: Final = (
    Field(key="k", kind=_POSITIVE, description="linear gain"),
    Field(key="M", kind=_NONNEGATIVE, description="height of the tanh term"),
    Field(key="epsilon", kind=_POSITIVE, description="width of the tanh term"),
    Field(key="c", kind=_NONNEGATIVE, description="factor of the power term"),
    Field(
        key="N",
        kind=Integer(lowest=3, highest=LARGEST_N, parity=Parity.ODD),
        description="exponent of the power term",
        default="3",
    ),
)
GAINS: Final = Section(
    fields=(
        *_SHAPE,
        Field(key="gamma", kind=_POSITIVE, description="theorem1: gamma_i"),
        Field(
            key="H",
            kind=Numbers(rule=Rule.NONNEGATIVE, fewest=1),
            description="theorem1: coefficients of H_i in rho, constant first",
        ),
        Field(key="H_star", kind=_POSITIVE, description="theorem1: bound on H_i"),
    )
)
STAGE: Final = Section(
    fields=(
        Field(
            key="p",
            kind=PerState(item=_POSITIVE, coverage=Coverage.ALL),
            description="what the measured errors are watched against, for every state",
            required=True,
        ),
        Field(
            key="gains",
            kind=PerState(item=Section(fields=_SHAPE), coverage=Coverage.ALL),
            description="gains of the stage, all fixed; absent ones are 0",
            required=True,
        ),
    )
)
THEOREM1: Final = Section(
    fields=(
        Field(key="c_0", kind=_NONNEGATIVE, description="c_0, what the power terms may add"),
        Field(
            key="epsilon",
            kind=PerState(item=_POSITIVE, coverage=Coverage.SOME),
            description="eps_i = p_i - delta_M - delta_(i-1), from the second state on",
        ),
        Field(
            key="H",
            kind=Choice(words=tuple(Schedule)),
            description="whether H_i is taken at rho = 1 or follows rho(t)",
            default="constant",
        ),
    )
)
DECLARED_REFERENCE: Final = Section(
    fields=(
        Field(key="value", kind=_TIME, description="y_d(t)", required=True),
        Field(key="bound", kind=_NONNEGATIVE, description="Y_0 >= abs(y_d)", required=True),
        Field(key="rate", kind=_NONNEGATIVE, description="Y_1 >= abs(dy_d/dt)", required=True),
    )
)
RUNTIME_REFERENCE: Final = Section(
    fields=(
        Field(
            key="bounds",
            kind=Numbers(rule=Rule.NONNEGATIVE, fewest=2),
            description="Y_0, Y_1, .. of a reference that is supplied at run time",
            required=True,
        ),
    )
)
WEIGHTS: Final = Section(
    fields=tuple(
        Field(key=str(word), kind=_NONNEGATIVE, description=f"weight of {word}")
        for word in Objective
    )
)
