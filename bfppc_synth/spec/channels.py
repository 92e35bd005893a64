"""Contradictions within one line of the dynamics, and within the reference."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.expressions.parse import constant_value
from bfppc_synth.expressions.resolution import lower_bound, upper_bound
from bfppc_synth.model.spec import ReferenceKind
from bfppc_synth.spec import build

if TYPE_CHECKING:
    from bfppc_synth.model.expression import Constant
    from bfppc_synth.spec.notebook import Notebook


def check_channel(book: Notebook, state: str) -> None:
    """Check what a channel gives and the numbers among it."""
    path = f"dynamics.{state}"
    if not book.is_mapping(path):
        return
    if not book.has(f"{path}.f") and not book.has(f"{path}.f_bound"):
        book.blame_path(
            path,
            f"neither f nor f_bound is given for {state}",
            "give f (0 if there is no drift), or f_bound: a bound on abs(f)",
        )
    given = {key for key in ("g", "g_bound", "g_min") if book.has(f"{path}.{key}")}
    if len(given) == 1 and "g" not in given:
        lone = min(given)
        other = "g_min" if lone == "g_bound" else "g_bound"
        book.blame_path(
            f"{path}.{lone}",
            f"{lone} without g leaves g unknown, and then {other} is needed too",
            f"add {other}, or give g",
        )
    _check_signs(book, path, state)


def _fixed(book: Notebook, path: str) -> Constant | None:
    expression = book.expression(path)
    return None if expression is None else constant_value(expression)


def _check_signs(book: Notebook, path: str, state: str) -> None:
    for key in ("f_bound", "disturbance"):
        number = _fixed(book, f"{path}.{key}")
        if number is not None and upper_bound(number) < 0:
            book.blame_path(
                f"{path}.{key}",
                f"{number.text} is negative, but bounds an absolute value",
                "give a bound that is 0 or above",
            )
    g, g_min, g_bound = (_fixed(book, f"{path}.{key}") for key in ("g", "g_min", "g_bound"))
    for key, number in (("g", g), ("g_min", g_min), ("g_bound", g_bound)):
        if number is not None and lower_bound(number) <= 0:
            _blame_gain(book, f"{path}.{key}", state, number)
    for low_key, low, high_key, high in (
        ("g_min", g_min, "g_bound", g_bound),
        ("g_min", g_min, "g", g),
        ("g", g, "g_bound", g_bound),
    ):
        if low is not None and high is not None and lower_bound(low) > upper_bound(high):
            book.blame_path(
                f"{path}.{low_key}",
                f"{low_key} = {low.text} is above {high_key} = {high.text}",
                "g_min <= g <= g_bound must hold",
            )
    f, f_bound = _fixed(book, f"{path}.f"), _fixed(book, f"{path}.f_bound")
    if f is not None and f_bound is not None:
        size = max(lower_bound(f), -upper_bound(f))
        if size > upper_bound(f_bound) >= 0:
            book.blame_path(
                f"{path}.f_bound",
                f"f_bound = {f_bound.text} is below abs(f), f = {f.text}",
                f"choose at least {float(size):.6g}",
            )


def _blame_gain(book: Notebook, path: str, state: str, number: Constant) -> None:
    key = path.rpartition(".")[2]
    if upper_bound(number) < 0:
        book.blame_path(
            path,
            f"{key} = {number.text} is negative, but every g must be positive",
            f"replace the state behind {state} (or u, if {state} is the last) by its negative",
        )
    else:
        book.blame_path(
            path,
            f"{key} = {number.text} is not above 0: nothing behind it could move {state}",
            "give a positive value",
        )


def check_reference(book: Notebook, states: tuple[str, ...]) -> None:
    """Check the offset of a run-time reference, and a constant against its declared bound."""
    reference = build.build_reference(book)
    offset = "initial.offset"
    if book.has(offset) and "offset" not in states and reference.kind is not ReferenceKind.RUNTIME:
        book.blame_path(
            offset,
            "offset bounds where a run-time reference may start; here the reference is known",
            "remove it, or give `reference: {bounds: [Y_0, Y_1]}`",
        )
    if reference.kind is not ReferenceKind.DECLARED or reference.expression is None:
        return
    value, bound = constant_value(reference.expression), book.constant("reference.bound")
    if value is not None and bound is not None:
        size = max(lower_bound(value), -upper_bound(value))
        if size > upper_bound(bound):
            book.blame_path(
                "reference.bound",
                f"{bound.text} is below abs(y_d), y_d = {value.text}",
                f"choose at least {float(size):.6g}",
            )
