"""The plant's right-hand sides as plain Python functions, written once per plant."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.simulation.loading import load_text
from bfppc_synth.simulation.statements import Statements

if TYPE_CHECKING:
    from collections.abc import Callable

    import sympy as sp

    from bfppc_synth.model.plant import Channel, Plant

    # (t, x_1..x_n, arguments) -> (f_1, g_1, .., f_n, g_n), and one step of the RK4 method:
    # (t, h, x_1..x_n, u, arguments) -> x_1..x_n.
    Coefficients = Callable[..., tuple[float, ...]]
    Advance = Callable[..., tuple[float, ...]]


#: What the text of a plant calls.
IMPORTS = (
    "from math import asinh, atan, copysign, cos, cosh, exp, log, nan, pow, sin, sinh, sqrt, tan, "
    "tanh"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """One way in which the plant may behave.

    ``coefficients(t, *x, *arguments)`` gives f_1, g_1, .., f_n, g_n (disturbance inside f);
    ``advance(t, h, *x, u, *arguments)`` takes one step of length h [s] with u held.
    ``arguments`` are those of ``Dynamics``.
    """

    coefficients: Coefficients
    advance: Advance


@dataclass(frozen=True, slots=True, kw_only=True)
class Dynamics:
    """The simulated plant, with what the certificate leaves open as arguments.

    The arguments are, in order: the parameters, each in its range; per channel the share of
    the disturbance bound in [-1, 1]; the share of f_bound in [-1, 1]; the place of g between
    its bounds in [0, 1].

    ``model`` follows f and g where the file gives them (f_bound sin(t + i), and g between its
    bounds, where it does not); ``bounds`` is anything within f_bound, g_min, g_bound, and
    None where no channel declares one. ``reference`` is y_d(t) [unit of x_1], None when it is
    supplied at run time.
    """

    order: int
    ranges: tuple[tuple[float, float], ...]
    model: Truth
    bounds: Truth | None
    reference: Callable[[float], float] | None

    @property
    def nominal(self) -> tuple[float, ...]:
        """Arguments of the nominal plant: midpoints, no disturbance, g in the middle."""
        midpoints = tuple(0.5 * (lower + upper) for lower, upper in self.ranges)
        return (*midpoints, *(0.0,) * (2 * self.order), *(0.5,) * self.order)


def modelled(plant: Plant) -> Plant:
    """Forget the bounds of what the file has a formula for: center nominal takes it for true."""
    channels = (
        replace(channel, f_bound=None if channel.f is not None else channel.f_bound)
        for channel in plant.channels
    )
    return replace(
        plant,
        channels=tuple(
            channel if channel.g is None else replace(channel, g_bound=None, g_min=None)
            for channel in channels
        ),
    )


def compile_plant(plant: Plant) -> Dynamics:
    """Write the plant as Python functions and load them.

    Parameters
    ----------
    plant : Plant
        Channels with f or f_bound, g or g_min and g_bound; a reference, or none.

    Returns
    -------
    Dynamics
        Functions over floats; outside a function's domain they return NaN, or raise
        OverflowError or ValueError for arguments that are too large or not finite.

    References
    ----------
    docs/theory.md sections 1 (odd roots) and 2 (what center performance takes as truth).
    """
    module = load_text(plant_text(plant), name="simulated_plant", origin="<simulated plant>")
    writers = _writers(plant)
    truths = {
        name: Truth(
            coefficients=getattr(module, f"coefficients_{name}"),
            advance=getattr(module, f"advance_{name}"),
        )
        for name in writers
    }
    return Dynamics(
        order=plant.order,
        ranges=tuple(
            (evaluate(lower, {}, FLOAT_FUNCTIONS), evaluate(upper, {}, FLOAT_FUNCTIONS))
            for lower, upper in plant.ranges
        ),
        model=truths["model"],
        bounds=truths.get("bounds"),
        reference=getattr(module, "reference", None),
    )


def plant_text(plant: Plant) -> str:
    """Write the plant's right-hand sides as a Python module: the C loop is made from it too.

    Functions ``coefficients_NAME`` and ``advance_NAME`` of the truths that the plant has, as in
    ``Truth``, and ``reference`` where there is one.
    """
    blocks = [IMPORTS]
    for name, writer in _writers(plant).items():
        blocks.extend((_coefficients_text(plant, name, writer), _advance_text(plant, name, writer)))
    if plant.reference is not None:
        blocks.append(_reference_text(plant, plant.reference))
    return "\n\n".join(blocks)


def _writers(plant: Plant) -> dict[str, _Writer]:
    """Name the truths of a plant: one more where a channel declares a bound."""
    declared = any(
        bound is not None
        for channel in plant.channels
        for bound in (channel.f_bound, channel.g_bound, channel.g_min)
    )
    writers: dict[str, _Writer] = {"model": _model_channel}
    if declared:
        writers["bounds"] = _bounded_channel
    return writers


def model_text(plant: Plant) -> str:
    """Write ``coefficients_model`` and ``advance_model`` (see ``Truth``) for other programs.

    The text calls what ``IMPORTS`` imports; its last arguments are those of ``argument_names``.
    """
    writers = (_coefficients_text, _advance_text)
    return "\n\n\n".join(write(plant, "model", _model_channel) for write in writers)


if TYPE_CHECKING:
    # (channel, its number from 1, values of the symbols, where to write) -> names of f, g
    _Writer = Callable[[Channel, int, dict[sp.Symbol, str], Statements], tuple[str, str]]


def _model_channel(
    channel: Channel, number: int, values: dict[sp.Symbol, str], out: Statements
) -> tuple[str, str]:
    """Write f and g as the file has them; what it has no formula for stays within its bounds."""
    if channel.f is not None:
        force = evaluate(channel.f, values, out)
    else:
        # The certificate allows any f within its bound; SPEC section 1 names this one.
        force = out.mul(evaluate(channel.f_bound, values, out), out.sin(f"(t + {number}.0)"))
    if channel.g is not None:
        gain = evaluate(channel.g, values, out)
    else:
        gain = _between(channel.g_min, channel.g_bound, number, values, out)
    return _disturbed(channel, number, force, values, out), gain


def _bounded_channel(
    channel: Channel, number: int, values: dict[sp.Symbol, str], out: Statements
) -> tuple[str, str]:
    """Write f and g as anything that their declared bounds allow."""
    if channel.f_bound is not None:
        force = out.mul(f"b{number}", evaluate(channel.f_bound, values, out))
    else:
        force = evaluate(channel.f, values, out)
    # With one bound declared the other side is g itself: that is what the majorants read.
    lower = channel.g if channel.g_min is None else channel.g_min
    upper = channel.g if channel.g_bound is None else channel.g_bound
    gain = _between(lower, upper, number, values, out)
    return _disturbed(channel, number, force, values, out), gain


def _between(
    lower: sp.Expr | None,
    upper: sp.Expr | None,
    number: int,
    values: dict[sp.Symbol, str],
    out: Statements,
) -> str:
    """Write the gain that lies m of the way from its lower to its upper bound."""
    if lower is None or upper is None:
        return out.number_text(1.0)
    low = evaluate(lower, values, out)
    if lower == upper:
        return low
    high = evaluate(upper, values, out)
    return out.add(low, out.mul(f"m{number}", out.sub(high, low)))


def _disturbed(
    channel: Channel, number: int, force: str, values: dict[sp.Symbol, str], out: Statements
) -> str:
    """Add the share w of the bound on the additive disturbance."""
    if channel.disturbance == 0:
        return force
    return out.add(force, out.mul(f"w{number}", evaluate(channel.disturbance, values, out)))


def argument_names(plant: Plant) -> list[str]:
    """Name what the certificate leaves open, in the order of ``Dynamics.nominal``."""
    names = [f"a{index}" for index in range(1, len(plant.parameters) + 1)]
    return names + [f"{kind}{i}" for kind in "wbm" for i in range(1, plant.order + 1)]


def _channels(
    plant: Plant, states: list[str], writer: _Writer, out: Statements
) -> list[tuple[str, str]]:
    values = dict(zip(plant.states, states, strict=True))
    values |= {symbol: f"a{index}" for index, symbol in enumerate(plant.parameters, start=1)}
    return [
        writer(channel, number, values, out)
        for number, channel in enumerate(plant.channels, start=1)
    ]


def _coefficients_text(plant: Plant, name: str, writer: _Writer) -> str:
    states = [f"x{index}" for index in range(1, plant.order + 1)]
    out = Statements()
    pairs = _channels(plant, states, writer, out)
    result = ", ".join(f"{force}, {gain}" for force, gain in pairs)
    head = ", ".join(["t", *states, *argument_names(plant)])
    body = [*out.lines, f"return ({result})"]
    return "\n    ".join([f"def coefficients_{name}({head}):", *body])


def _advance_text(plant: Plant, name: str, writer: _Writer) -> str:
    """Write one classical Runge-Kutta step, its four stages in line."""
    order = range(1, plant.order + 1)
    states = [f"x{index}" for index in order]
    body = ["start = t", "half = 0.5 * h"]
    at = states
    for stage, step in ((1, "half"), (2, "half"), (3, "h"), (4, "")):
        out = Statements(prefix=f"s{stage}_")
        pairs = _channels(plant, at, writer, out)
        body.extend(out.lines)
        following = [*at[1:], "u"]
        for index, ((force, gain), onward) in enumerate(zip(pairs, following, strict=True), 1):
            body.append(f"k{stage}_{index} = {force} + {gain} * {onward}")
        if step:
            at = [f"y{stage}_{index}" for index in order]
            body.append(f"t = start + {step}")
            body.extend(f"y{stage}_{i} = x{i} + {step} * k{stage}_{i}" for i in order)
    body.append("sixth = h / 6.0")
    sums = (f"x{i} + sixth * (k1_{i} + 2.0 * (k2_{i} + k3_{i}) + k4_{i})" for i in order)
    body.append(f"return ({', '.join(sums)},)")
    head = ", ".join(["t", "h", *states, "u", *argument_names(plant)])
    return "\n    ".join([f"def advance_{name}({head}):", *body])


def _reference_text(plant: Plant, reference: sp.Expr) -> str:
    out = Statements()
    result = evaluate(reference, {plant.time: "t"}, out)
    return "\n    ".join(["def reference(t):", *out.lines, f"return {result}"])
