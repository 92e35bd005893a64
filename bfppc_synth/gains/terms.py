"""What each F_i* consists of: the terms and their shares."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.model.nominal import NominalSplit

if TYPE_CHECKING:
    from bfppc_synth.gains.evaluation import Evaluation
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.bounds import CenterBounds, ChainBounds


def explained(
    problem: DesignProblem, found: Evaluation, step: int
) -> tuple[tuple[str, float], ...]:
    """Split F_i* of a judged design into its terms, whatever its center.

    Parameters
    ----------
    problem, found
        The problem and the design.
    step : int
        0-based step i - 1.

    Returns
    -------
    tuple[tuple[str, float], ...]
        (term, share of F_i*), the largest first; the shares sum to 1.

    References
    ----------
    docs/theory.md section 2, the divided form of F_i*, and section 4 for center nominal.
    """
    if found.tight is not None:
        ahead = found.half_widths[step + 1 : step + 2]
        parts = [("residual, tight", found.tight.load[step])]
        return _shares([*parts, *((f"p_{step + 2}", p) for p in ahead)])
    if problem.nominal is None:
        return binding_terms(found.bounds, found.half_widths, problem.center, step)
    bounds, g = found.bounds, found.bounds.g_min[step]
    parts = [(name, value / g) for name, value in sources(problem, bounds, step)]
    if step > 0:
        parts.append((f"|d alpha_{step}|", bounds.B[step - 1] / g))
    if step + 1 < len(found.half_widths):
        parts.append((f"p_{step + 2}", found.half_widths[step + 1]))
    return _shares(parts)


def sources(
    problem: DesignProblem, bounds: ChainBounds[float], step: int
) -> tuple[tuple[str, float], ...]:
    """Terms of W_i around a nominal center, by their source [unit of x_i per s]."""
    if problem.nominal is None:
        return ()
    residual = problem.nominal_residual(problem.nominal)
    return residual.terms(step, bounds.xi[: step + 1])


def nominal_split(problem: DesignProblem, found: Evaluation) -> NominalSplit | None:
    """Split U into feedforward and tube, and every W_i by source; None with another center.

    References
    ----------
    docs/theory.md sections 3 (U) and 4 (W_i).
    """
    nominal, bounds = problem.nominal, found.bounds
    if nominal is None:
        return None
    feedforward, error = problem.center.v, problem.conditions.actuator_error
    return NominalSplit(
        feedforward=feedforward,
        tube=bounds.U - feedforward - error,
        actuator_error=error,
        disturbance=tuple(sources(problem, bounds, step) for step in range(problem.order)),
        parameters=nominal.parameter_errors,
    )


def binding_terms(
    bounds: ChainBounds[float],
    half_widths: tuple[float, ...],
    center: CenterBounds,
    step: int,
) -> tuple[tuple[str, float], ...]:
    """Split F_i* into its terms, the largest first.

    Parameters
    ----------
    bounds, half_widths, center
        The chain, p_1..p_n and the center of one design.
    step : int
        0-based step i - 1.

    Returns
    -------
    tuple[tuple[str, float], ...]
        (term, share of F_i*); the shares sum to 1.

    References
    ----------
    docs/theory.md section 2, the divided form of F_i*.
    """
    i, g = step + 1, bounds.g_min[step]
    rate = center.rate[step]
    parts = [
        (f"f_{i}* and disturbance", (bounds.W[step] - rate) / g),
        (f"sup|dr_{i}|", rate / g),
    ]
    if step > 0:
        parts.append((f"|d alpha_{i - 1}|", bounds.B[step - 1] / g))
    if i < len(half_widths):
        parts.append((f"p_{i + 1}", half_widths[step + 1]))
        parts.append((f"sup|r_{i + 1}|", center.feed[step]))
    return _shares(parts)


def _shares(parts: list[tuple[str, float]]) -> tuple[tuple[str, float], ...]:
    total = sum(value for _, value in parts)
    if total <= 0.0:
        return ()
    shares = [(name, value / total) for name, value in parts if value > 0.0]
    return tuple(sorted(shares, key=lambda part: -part[1]))
