"""What method theorem1 fixes and asks for, where no bound has to be computed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.expressions.resolution import upper_bound
from bfppc_synth.model.spec import Method, ReferenceKind
from bfppc_synth.spec import build

if TYPE_CHECKING:
    from bfppc_synth.model.spec import SynthesisSpec
    from bfppc_synth.spec.notebook import Notebook

_PATH = "synthesis.theorem1"
_FIX = "use `method: unified`, which covers it"


def check_theorem1(book: Notebook, states: tuple[str, ...], synthesis: SynthesisSpec) -> None:
    """Note where the file is not plant (1) with continuous control, which is all it is about.

    References
    ----------
    docs/theory.md section 7: every g = 1, reference 0, one rho.
    """
    if synthesis.method is not Method.THEOREM1:
        return
    for state in states:
        for key in ("g", "g_bound", "g_min"):
            given = book.expression(f"dynamics.{state}.{key}")
            if given is not None and given.text.strip() not in ("1", "1.0"):
                path = f"dynamics.{state}.{key}"
                book.blame_path(path, f"theorem1 is proved for g = 1, not for {given.text}", _FIX)
    reference = build.build_reference(book)
    text = "" if reference.expression is None else reference.expression.text.strip()
    if reference.kind is not ReferenceKind.EXPRESSION or text not in ("0", "0.0"):
        what = f"not for {text}" if text else "not for one given at run time"
        book.blame_path("reference", f"theorem1 is proved for the reference 0, {what}", _FIX)
    rhos = {build.build_rho(book, book.of_state("performance.rho", state)) for state in states}
    if len(rhos) > 1:
        book.blame_path(
            "performance.rho",
            f"theorem1 has one rho for all states, here are {len(rhos)}",
            "write one rho, or " + _FIX,
        )
    for path, what in (
        ("sampling.period", "continuous measurement"),
        ("sampling.delay", "a loop without delay"),
        ("actuator.error", "an exact actuator"),
    ):
        number = book.constant(path)
        if number is not None and upper_bound(number) > 0:
            book.blame_path(path, f"theorem1 is proved for {what}, not for {number.text}", _FIX)
    first = f"{_PATH}.epsilon.{states[0]}"
    if book.has(first):
        book.blame_path(
            first,
            f"epsilon of {states[0]}, the first state, is accuracy minus twice the resolution",
            "choose performance.accuracy, and remove it here",
        )


def unused_theorem1(
    book: Notebook, states: tuple[str, ...], synthesis: SynthesisSpec
) -> tuple[str, ...]:
    """Name the keys that Theorem 1 alone uses, or that it alone does not use."""
    gains = [f"synthesis.gains.{state}" for state in states]
    if synthesis.method is Method.THEOREM1:
        paths = [f"{path}.{key}" for path in gains for key in ("k", "M", "epsilon")]
        paths.append("synthesis.anchor")
    else:
        paths = [f"{path}.{key}" for path in gains for key in ("gamma", "H", "H_star")]
        paths.append(_PATH)
    return tuple(
        f"{path} is not used with method {synthesis.method}" for path in paths if book.has(path)
    )
