"""Center nominal's road from a plant file's records to the design problem."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.bounds.admission import admit, misplaced_term
from bfppc_synth.bounds.funnel import keeps_funnel, require_nominal_funnel
from bfppc_synth.bounds.nominal.model import is_smooth, smooth_gain
from bfppc_synth.bounds.nominal.signals import nominal_center
from bfppc_synth.bounds.representable import require_representable
from bfppc_synth.bounds.signals import bound_signals, conditions
from bfppc_synth.errors import EnvelopeError, Mistake, PlantFileError, UsageError
from bfppc_synth.expressions.nominal import AlongCenterError
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.gains.funnel import longest_kept
from bfppc_synth.gains.methods.unified import Unified
from bfppc_synth.gains.problem import DesignProblem, fixed_gains
from bfppc_synth.gains.transition import choose_transition
from bfppc_synth.majorants.derive import derive_majorants
from bfppc_synth.model.spec import Anchor, CenterKind, Method, ReferenceKind
from bfppc_synth.spec.build import DEFAULT_HORIZON
from bfppc_synth.spec.rules import LEAST_TRANSITION, MOST_TRANSITION

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.gains.problem import Weights
    from bfppc_synth.model.bounds import CenterBounds, Majorants, SignalBounds
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.spec import PlantSpec

_REFERENCE_FIX = (
    "give {value, bound, rate} with `center: performance`, or supply it at run time with n + 2"
    " bounds on it and its derivatives"
)
_DERIVATIVES_FIX = (
    "give the reference as an expression without bounds, or use `center: performance`"
)


def _silent(message: str) -> None:
    del message


def nominal_if_any(
    spec: PlantSpec,
    weights: Weights,
    margin: float,
    progress: Callable[[str], None] = _silent,
    *,
    transition: float | None = None,
) -> tuple[DesignProblem, SignalBounds] | None:
    """Return None instead of an error where the file does not ask for this center itself.

    What the reader takes for a known model by its text may still have a pole on the way, or a
    reference without an enclosure; center performance then says what is wrong, or works.
    """
    try:
        return prepare_nominal(spec, weights, margin, progress, transition=transition)
    except PlantFileError:
        if spec.gives("synthesis.center"):
            raise
    progress("no center that the nominal plant can follow: taking center performance")
    return None


def around_performance(spec: PlantSpec) -> PlantSpec:
    """Return the same plant file with center performance."""
    return replace(spec, synthesis=replace(spec.synthesis, center=CenterKind.PERFORMANCE))


def prepare_nominal(
    spec: PlantSpec,
    weights: Weights,
    margin: float,
    progress: Callable[[str], None] = _silent,
    *,
    transition: float | None = None,
) -> tuple[DesignProblem, SignalBounds]:
    """Build the plant, its nominal center, and the problem to solve.

    Parameters
    ----------
    spec : PlantSpec
        A plant file with center nominal.
    weights, margin
        What is minimized, and the relative room of every inequality.
    progress : callable
        Receives one sentence per stage.
    transition : float, optional
        T_s [s] of a design that is read back; else the file's, else the best one found.

    Returns
    -------
    tuple
        The problem with ``nominal`` set, and the bounds of the reference.

    Raises
    ------
    PlantFileError
        What center nominal cannot take, a term without a rule, a bound that breaks down on
        the smallest box, or a reference or center without an enclosure, at its place.

    References
    ----------
    docs/theory.md section 4.
    """
    _require_combination(spec)
    progress("bounding the plant")
    plant = build_plant(spec)
    require_representable(plant)
    _require_derivatives(plant)
    _require_smooth_gains(plant)
    try:
        signals = bound_signals(plant)
    except EnvelopeError as error:
        raise _mistaken(spec, "reference", str(error), _REFERENCE_FIX) from error
    try:
        majorants = derive_majorants(plant)
    except EnvelopeError as error:
        raise misplaced_term(plant, error) from error
    accuracy = spec.performance.accuracy
    if accuracy is None:
        raise UsageError("performance.accuracy is required in this version")

    if transition is None and spec.performance.transition is not None:
        transition = spec.performance.transition.approximate
    require_nominal_funnel(plant, transition)
    free = transition is None

    def pose(duration: float) -> DesignProblem:
        if free and not LEAST_TRANSITION <= duration <= MOST_TRANSITION:
            raise EnvelopeError("the transition is outside 1e-6 to 1e6 s", subexpression="")
        if free and plant.funnel is not None and not keeps_funnel(plant, duration):
            raise EnvelopeError("the transition leaves the funnel", subexpression="")
        nominal = nominal_center(plant, duration)
        if free:
            _require_admission(plant, majorants, nominal.center)
        return DesignProblem(
            plant=plant,
            majorants=majorants,
            center=nominal.center,
            conditions=conditions(spec),
            theorem=Unified(),
            accuracy=accuracy.approximate,
            half_widths=tuple(None if p is None else p.approximate for p in spec.synthesis.p),
            gains=tuple(fixed_gains(gains) for gains in spec.synthesis.gains),
            weights=weights,
            limit=None if spec.actuator.limit is None else spec.actuator.limit.approximate,
            margin=margin,
            nominal=nominal,
        )

    try:
        if transition is None:
            longest = longest_kept(plant, _longest_wanted(spec))
            transition = choose_transition(pose, progress, longest=longest)
        problem = pose(transition)
    except AlongCenterError as error:
        raise _mistaken(spec, _key(plant, error), str(error), error.fix) from error
    except EnvelopeError as error:
        if error.subexpression and error.subexpression == str(plant.reference):
            raise _mistaken(spec, "reference", str(error), _REFERENCE_FIX) from error
        raise _mistaken(spec, "synthesis.center", str(error), error.fix) from error
    admit(plant, majorants, problem.center)
    return problem, signals


def _longest_wanted(spec: PlantSpec) -> float:
    """How long a transition may take where the file leaves it open: as long as what is simulated.

    A horizon that only keeps a run short says nothing about it.
    """
    return max(spec.simulation.horizon, DEFAULT_HORIZON)


def _require_admission(plant: Plant, majorants: Majorants, center: CenterBounds) -> None:
    """Turn a domain that this T_s leaves into what the search of T_s steps over."""
    try:
        admit(plant, majorants, center)
    except PlantFileError as error:
        raise EnvelopeError(error.mistakes[0].message, subexpression="") from error


def _key(plant: Plant, error: AlongCenterError) -> str:
    """Place of f or g; of a g that is known by its bounds only, of the first of these."""
    if error.key == "reference":
        return error.key
    channel = plant.channels[error.index]
    key = "g_min" if error.key == "g" and channel.g is None else error.key
    return f"dynamics.{channel.state.name}.{key}"


def _require_combination(spec: PlantSpec) -> None:
    if spec.synthesis.method is not Method.UNIFIED:
        raise _mistaken(
            spec,
            "synthesis.center",
            f"{spec.synthesis.method} is proved for center performance",
            "use `method: unified`, or `center: performance`",
        )
    if spec.synthesis.anchor is Anchor.EXACT:
        raise _mistaken(
            spec,
            "synthesis.anchor",
            "the exact anchor belongs to center performance: a nominal center starts from what is"
            " measured",
            "use `anchor: latched`",
        )


def _require_smooth_gains(plant: Plant) -> None:
    for channel in plant.channels:
        try:
            smooth_gain(plant, channel)
        except EnvelopeError as error:
            path = f"dynamics.{channel.state.name}.g"
            raise _mistaken(plant.spec, path, str(error), error.fix) from error


def _require_derivatives(plant: Plant) -> None:
    """Refuse a reference whose derivatives up to order n + 1 are not known."""
    spec = plant.spec
    needed = plant.order + 2
    if spec.reference.kind is ReferenceKind.DECLARED:
        raise _mistaken(
            spec,
            "reference",
            f"center nominal needs bounds on y_d and its first {needed - 1} derivatives, and the"
            " file declares two",
            _DERIVATIVES_FIX,
        )
    if spec.reference.kind is ReferenceKind.RUNTIME and len(spec.reference.bounds) < needed:
        raise _mistaken(
            spec,
            "reference.bounds",
            f"center nominal needs {needed} bounds, on y_d and its first {needed - 1} derivatives,"
            f" and there are {len(spec.reference.bounds)}",
            "give them all, or use `center: performance`",
        )
    if plant.reference is not None and not is_smooth(plant.reference):
        raise _mistaken(
            spec,
            "reference",
            f"{plant.reference} has a kink or a jump, and center nominal follows its first"
            f" {needed - 1} derivatives",
            "give a smooth reference, or use `center: performance`",
        )


def _mistaken(spec: PlantSpec, path: str, message: str, fix: str) -> PlantFileError:
    place = spec.place(path)
    mistake = Mistake(
        path=path,
        line=place.line,
        column=place.column,
        length=1,
        message=message,
        fix=fix or "narrow initial, choose another transition, or use `center: performance`",
    )
    return PlantFileError(spec.path, spec.source, (mistake,))
