"""Center nominal in report.json and in the page's sentences (docs/theory.md section 4)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.bounds.nominal.model import nominal_parameters
from bfppc_synth.model.spec import ReferenceKind
from bfppc_synth.report.numbers import constant, finite

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.design import Design


def nominal_entry(design: Design) -> dict[str, object]:
    """Lay out what center nominal adds to report.json; empty for the other center.

    Parameters
    ----------
    design : Design
        Order n, with the model and the split that its center brings.

    Returns
    -------
    dict[str, object]
        ``nominal``: T_s [s], nominal parameters, f^_i and g^_i, what f^_i leaves out, the
        parts of U [unit of u], and of each W_i by source [unit of x_i per s].

    References
    ----------
    docs/theory.md section 4.
    """
    model, split = design.nominal, design.nominal_split
    if model is None or split is None:
        return {}
    middles = nominal_parameters(design.plant)
    return {
        "nominal": {
            "transition": finite(model.transition),
            "parameters": {symbol.name: float(middle) for symbol, middle in middles.items()},
            "model": [
                {"state": state.name, "f": str(f), "g": str(g)}
                for state, f, g in zip(model.states, model.f, model.g, strict=True)
            ],
            "left_out": [[str(term) for term in terms] for terms in model.left_out],
            "feedforward": finite(split.feedforward),
            "tube": finite(split.tube),
            "actuator_error": finite(split.actuator_error),
            "sources": [_sizes(terms, "source") for terms in split.disturbance],
            "parameter_errors": [_sizes(terms, "parameter") for terms in split.parameters],
        }
    }


def _sizes(terms: Sequence[tuple[str, float]], key: str) -> list[dict[str, object]]:
    return [{key: name, "size": finite(size)} for name, size in terms]


def feed_entry(design: Design) -> dict[str, object]:
    """Lay out the bounds on v, on its rate and on its start, where there is a v."""
    if design.nominal is None:
        return {}
    center, split = design.center, design.nominal_split
    return {
        "v": finite(center.v if split is None else split.feedforward),
        "v_rate": finite(center.v_rate),
        "v_start": finite(center.v_start),
    }


def nominal_promise() -> tuple[str, ...]:
    """Say what the output keeps around a nominal center."""
    return (
        (
            r"Output. At every time $t \ge 0$, $\left|y - y_d - b(t)\right| \le p_1$ = "
            r"#omega/p/0#: the output $y$ stays that close to the known curve "
            r"$r_1(t) = y_d(t) + b(t)$, where $y_d$ is the reference and $b$ the transition "
            "that leads every measured start over to it."
        ),
        (
            r"Tracking. $b$ is exactly zero from $T_s$ = #performance/transition# s after the "
            r"first sample: from then on $\left|y - y_d\right| \le$#performance/final_error#."
        ),
    )


def transition_sentences() -> tuple[str, ...]:
    """Say how long the start is felt."""
    return (
        (
            r"Transition: the start is carried over to the reference within $T_s$ = "
            "#performance/transition# s."
        ),
    )


def derivatives_sentence(design: Design) -> str:
    """Say which derivatives a caller passes with the reference; empty where none."""
    supplied = design.spec.reference.kind is ReferenceKind.RUNTIME
    if design.nominal is None or not supplied:
        return ""
    count = design.spec.order
    bounds = ", ".join(
        f"#reference/bounds/{index}#" for index in range(len(design.spec.reference.bounds))
    )
    return (
        f"Every sample brings $y_d$ and its exact derivatives up to order {count}; bounds on $y_d$ "
        f"and its derivatives, from order 0: {bounds} (assumed)."
    )


def reference_bounds(design: Design) -> dict[str, object]:
    """Lay out the bounds on a supplied reference and its derivatives, from order 0."""
    if not derivatives_sentence(design):
        return {}
    return {"bounds": [constant(bound) for bound in design.spec.reference.bounds]}


def source_sentence(name: str) -> str:
    """Put a source of W_i into words for ``prose``; an unknown one stays as it is."""
    stem, _, state = name.partition("deviation of ")
    if state and not stem:
        return f"deviation of `{state}` from the center"
    return name
