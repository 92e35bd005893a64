"""Values by path -> the records of model.spec, defaults filled in.

Everything here also runs on a file with mistakes, so that the rules can look at what is
sound of it; an unreadable value is then treated as an absent one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from bfppc_synth.expressions.parse import parse_constant
from bfppc_synth.model.expression import Expression
from bfppc_synth.model.spec import (
    ActuatorSpec,
    Anchor,
    BoundsKind,
    CenterKind,
    ChannelSpec,
    Form,
    GainSpec,
    MeasurementSpec,
    Method,
    Objective,
    PerformanceSpec,
    QuantizerKind,
    QuantizerSpec,
    ReferenceKind,
    ReferenceSpec,
    RhoKind,
    RhoSpec,
    SamplingSpec,
    SimulationSpec,
    SynthesisSpec,
)
from bfppc_synth.model.stages import Handover, StageSpec
from bfppc_synth.model.theorem1 import Schedule, Theorem1Spec
from bfppc_synth.spec.centers import default_center

if TYPE_CHECKING:
    from bfppc_synth.model.expression import Constant
    from bfppc_synth.spec.notebook import Notebook

DEFAULT_HORIZON: Final = 10.0
_STEPS_BY_DEFAULT: Final = 5000
_SAMPLES_BY_DEFAULT: Final = 20_000
_SHORTEST_BY_DEFAULT: Final = 4.0
_MOST_BY_DEFAULT: Final = 40_000


def _constant(book: Notebook, path: str, default: str) -> Constant:
    return book.constant(path) or parse_constant(default)


def build_channel(book: Notebook, state: str) -> ChannelSpec:
    """Collect one line of the dynamics."""
    path = f"dynamics.{state}"
    return ChannelSpec(
        state=state,
        f=book.expression(f"{path}.f"),
        g=book.expression(f"{path}.g"),
        f_bound=book.expression(f"{path}.f_bound"),
        g_bound=book.expression(f"{path}.g_bound"),
        g_min=book.expression(f"{path}.g_min"),
        disturbance=book.expression(f"{path}.disturbance"),
    )


def build_reference(book: Notebook) -> ReferenceSpec:
    """Collect the reference; absent means y_d = 0."""
    if book.has("reference.bounds"):
        bounds = book.numbers("reference.bounds")
        return ReferenceSpec(kind=ReferenceKind.RUNTIME, expression=None, bounds=bounds)
    if book.is_mapping("reference"):
        bound, rate = (_constant(book, f"reference.{key}", "0") for key in ("bound", "rate"))
        return ReferenceSpec(
            kind=ReferenceKind.DECLARED,
            expression=book.expression("reference.value"),
            bounds=(bound, rate),
        )
    expression = book.expression("reference") or _zero_expression()
    return ReferenceSpec(kind=ReferenceKind.EXPRESSION, expression=expression, bounds=())


def _zero_expression() -> Expression:
    zero = parse_constant("0")
    return Expression(text=zero.text, tree=zero.tree)


def build_rho(book: Notebook, path: str) -> RhoSpec:
    """Collect one performance function; absent means (52) with t_s = 1."""
    kind = RhoKind(book.text(f"{path}.kind", RhoKind.COSINE))
    rate_bound = book.constant(f"{path}.rate_bound")
    if kind is RhoKind.COSINE:
        t_s = _constant(book, f"{path}.t_s", "1")
        return RhoSpec(kind=kind, t_s=t_s, rate=None, floor=None, rate_bound=rate_bound)
    return RhoSpec(
        kind=kind,
        t_s=None,
        rate=book.constant(f"{path}.rate"),
        floor=_constant(book, f"{path}.floor", "0"),
        rate_bound=rate_bound,
    )


def build_performance(book: Notebook, states: tuple[str, ...]) -> PerformanceSpec:
    """Collect what is asked of the output."""
    paths = (book.of_state("performance.rho", state) for state in states)
    return PerformanceSpec(
        accuracy=book.constant("performance.accuracy"),
        rho=tuple(build_rho(book, path) for path in paths),
        transition=book.constant("performance.transition"),
        funnel=book.expression("performance.funnel"),
    )


def build_quantizer(book: Notebook, path: str) -> QuantizerSpec:
    """Collect one quantizer; absent means none."""
    return QuantizerSpec(
        kind=QuantizerKind(book.text(f"{path}.kind", QuantizerKind.NONE)),
        step=book.constant(f"{path}.step"),
        dead_zone=book.constant(f"{path}.dead_zone"),
        hysteresis=book.constant(f"{path}.hysteresis"),
        minimum=book.constant(f"{path}.minimum"),
        density=book.constant(f"{path}.density"),
        threshold=book.constant(f"{path}.threshold"),
    )


def build_measurement(book: Notebook, states: tuple[str, ...]) -> MeasurementSpec:
    """Collect quantizers and noise bounds, one per state."""
    quantizer, noise = "measurement.quantizer", "measurement.noise"
    return MeasurementSpec(
        quantizers=tuple(build_quantizer(book, book.of_state(quantizer, name)) for name in states),
        noise=tuple(_constant(book, book.of_state(noise, name), "0") for name in states),
    )


def build_sampling(book: Notebook) -> SamplingSpec:
    """Collect the timing; absent means continuous."""
    return SamplingSpec(
        period=_constant(book, "sampling.period", "0"), delay=_constant(book, "sampling.delay", "0")
    )


def build_actuator(book: Notebook) -> ActuatorSpec:
    """Collect the actuator."""
    return ActuatorSpec(
        limit=book.constant("actuator.limit"), error=_constant(book, "actuator.error", "0")
    )


def build_gains(book: Notebook, path: str) -> GainSpec:
    """Collect what the file fixes of one shape."""
    return GainSpec(
        k=book.constant(f"{path}.k"),
        M=book.constant(f"{path}.M"),
        epsilon=book.constant(f"{path}.epsilon"),
        c=book.constant(f"{path}.c"),
        N=book.integer(f"{path}.N", 3),
        gamma=book.constant(f"{path}.gamma"),
        H=book.numbers(f"{path}.H") or None,
        H_star=book.constant(f"{path}.H_star"),
    )


def build_objective(book: Notebook) -> tuple[tuple[Objective, float], ...]:
    """Collect the objective as (word, weight); weights of 0 are left out."""
    if not book.is_mapping("synthesis.objective"):
        return ((Objective(book.text("synthesis.objective", Objective.BALANCED)), 1.0),)
    weights = ((word, book.constant(f"synthesis.objective.{word}")) for word in Objective)
    return tuple(
        (word, weight.approximate) for word, weight in weights if weight and weight.approximate
    )


def build_stages(book: Notebook, states: tuple[str, ...]) -> tuple[StageSpec, ...]:
    """Collect the free stages of theorem3, in their order."""
    found: list[StageSpec] = []
    while book.has(path := f"synthesis.stages.{len(found)}"):
        found.append(
            StageSpec(
                p=tuple(book.constant(f"{path}.p.{state}") for state in states),
                gains=tuple(build_gains(book, f"{path}.gains.{state}") for state in states),
            )
        )
    return tuple(found)


def build_theorem1(book: Notebook, states: tuple[str, ...]) -> Theorem1Spec | None:
    """Collect what theorem1 fixes besides gains; None where the file has no such section."""
    path = "synthesis.theorem1"
    if not book.has(path):
        return None
    return Theorem1Spec(
        c_0=book.constant(f"{path}.c_0"),
        epsilon=tuple(book.constant(f"{path}.epsilon.{state}") for state in states),
        H=Schedule(book.text(f"{path}.H", Schedule.CONSTANT)),
    )


def build_synthesis(book: Notebook, states: tuple[str, ...]) -> SynthesisSpec:
    """Collect what to synthesize and how."""
    path = "synthesis"
    method = Method(book.text(f"{path}.method", Method.UNIFIED))
    anchor = Anchor(book.text(f"{path}.anchor", Anchor.LATCHED))
    if method is Method.THEOREM1:
        # Its errors are made of the true starts, whatever the file says.
        anchor = Anchor.EXACT
    form = Form(book.text(f"{path}.form", Form.SOUND))
    center = CenterKind.PERFORMANCE
    if method is Method.UNIFIED and form is Form.SOUND and anchor is Anchor.LATCHED:
        channels = tuple(build_channel(book, state) for state in states)
        center = default_center(channels, build_reference(book))
    return SynthesisSpec(
        method=method,
        form=form,
        center=CenterKind(book.text(f"{path}.center", center)),
        bounds=BoundsKind(book.text(f"{path}.bounds", BoundsKind.TERMWISE)),
        anchor=anchor,
        objective=build_objective(book),
        gains=tuple(build_gains(book, f"{path}.gains.{state}") for state in states),
        p=tuple(book.constant(f"{path}.p.{state}") for state in states),
        stages=build_stages(book, states),
        handover=Handover(book.text(f"{path}.handover", Handover.REANCHOR)),
        theorem1=build_theorem1(book, states),
    )


def build_simulation(book: Notebook, measurement: MeasurementSpec) -> SimulationSpec:
    """Collect the simulation; its defaults keep a run to some ten thousand steps."""
    sampled, declared, step = (
        None if number is None else number.approximate
        for number in map(
            book.constant, ("sampling.period", "simulation.horizon", "simulation.period")
        )
    )
    quantized = any(item.kind is not QuantizerKind.NONE for item in measurement.quantizers)
    horizon, period = simulation_times(declared, step, sampled or 0.0, quantized)
    return SimulationSpec(horizon=horizon, period=period, seed=book.integer("simulation.seed", 1))


def simulation_times(
    declared: float | None,
    step: float | None,
    sample_period: float,
    quantized: bool,  # noqa: FBT001 (a fact of the file, not an option)
) -> tuple[float, float]:
    """Return horizon and step of a run [s] from what the file says of them (None: nothing)."""
    if declared:
        horizon = declared
    elif sample_period:
        longest = max(_SAMPLES_BY_DEFAULT * sample_period, _SHORTEST_BY_DEFAULT)
        # Microseconds between samples would otherwise take hours and all memory.
        horizon = min(DEFAULT_HORIZON, longest, _MOST_BY_DEFAULT * sample_period)
    else:
        horizon = DEFAULT_HORIZON
    if step:
        return horizon, step
    if sample_period:
        return horizon, sample_period
    # Without a sample period a quantized loop is sampled at this step: it is kept short.
    return horizon, horizon / (_SAMPLES_BY_DEFAULT if quantized else _STEPS_BY_DEFAULT)
