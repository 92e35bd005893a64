"""Range of a signal over all times (docs/theory.md section 2, "rigorous suprema over t")."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.bounds.derivative import NOT_ENCLOSED_FIX
from bfppc_synth.bounds.extremes import RELATIVE_GAP, Extremes
from bfppc_synth.bounds.natural import Range, natural
from bfppc_synth.bounds.tail import Tail
from bfppc_synth.errors import EnvelopeError

if TYPE_CHECKING:
    from collections.abc import Mapping

    import sympy as sp

MOST_DOUBLINGS = 40
# A tail that still matters after so many operations (some microseconds each) stays as it is:
# sound, but not tight. Where it has no bound even then, the signal is refused.
MOST_OPERATIONS = 150_000
# A tail whose natural extension is further than this from that of its limit, relative to the
# signal, is left for a later T.
EARLY = 1e-3


def range_on(
    expression: sp.Expr,
    time: sp.Symbol,
    span: Range,
    constants: Mapping[sp.Symbol, Range],
    known: Range = (math.inf, -math.inf),
) -> Range:
    """Bound a signal on a finite span of time.

    Parameters
    ----------
    expression : sympy.Expr
        In ``time`` and the symbols of ``constants``.
    time : sympy.Symbol
        t [s].
    span : Range
        First and last t [s].
    constants : Mapping[sympy.Symbol, Range]
        Ranges of the other symbols.
    known : Range
        Values that belong to the range anyway: nothing inside them is searched.

    Returns
    -------
    Range
        (lower, upper) bounds on the signal and ``known``, rounding included.

    Raises
    ------
    EnvelopeError
        If the signal has no bounded value somewhere on the span (a pole, the log of a
        negative number).
    """
    search = _search(expression, time, span, constants)
    return search.infimum(known[0]), search.supremum(known[1])


def range_from(
    expression: sp.Expr,
    time: sp.Symbol,
    start: float,
    constants: Mapping[sp.Symbol, Range],
) -> Range:
    """Bound a signal on [start, infinity).

    Finite pieces by branch and bound, and beyond them the bounded form of ``Tail``; the pieces
    double until the tail adds nothing, or has reached its own limit.

    Parameters
    ----------
    expression, time, constants
        As for ``range_on``.
    start : float
        First t [s], at least 0.

    Returns
    -------
    Range
        (lower, upper) bounds, rounding included.

    Raises
    ------
    EnvelopeError
        If the signal is unbounded, or of a kind that has no enclosure.

    References
    ----------
    docs/theory.md section 2; SPEC section 1, "References enclosed rigorously".
    """
    if time not in expression.free_symbols:
        return range_on(expression, time, (start, start), constants)
    tail = Tail(expression, time, constants)
    if tail.is_periodic:
        search = Extremes(tail.form, tail.limit_box())
        return search.infimum(), search.supremum()
    limit = Extremes(tail.form, tail.limit_box(), narrow=tail.narrow)
    # What the signal comes back to for ever is part of the answer: smaller peaks on the way
    # there need no search.
    lower, upper = limit.infimum(), limit.supremum()
    work, end = limit.work, start
    failure: EnvelopeError | None = None
    for _ in range(MOST_DOUBLINGS):
        piece = (end, 2.0 * max(end, 2.0))
        end = piece[1]
        search = _search(expression, time, piece, constants)
        lower, upper = search.infimum(lower), search.supremum(upper)
        work += search.work
        if work < MOST_OPERATIONS // 8 and _is_early(tail, end, (lower, upper)):
            continue
        try:
            hull, spent = _beyond(tail, end, (lower, upper), 32 + 2 * limit.boxes)
        except EnvelopeError as error:
            # A denominator may vanish on [0, 1/T] although it does not at s = 0: T is early.
            failure, work = error, work + MOST_OPERATIONS // MOST_DOUBLINGS
            continue
        work += spent
        gap = RELATIVE_GAP * max(map(abs, hull))
        tight = hull[0] >= lower - gap and hull[1] <= upper + gap
        if all(map(math.isfinite, hull)) and (tight or work > MOST_OPERATIONS):
            return hull
        if work > 4 * MOST_OPERATIONS:
            break
    raise failure or EnvelopeError(
        f"{expression} does not settle within {end:.0e} s",
        subexpression=str(expression),
        fix=NOT_ENCLOSED_FIX,
    )


def _beyond(tail: Tail, start: float, known: Range, most_boxes: int) -> tuple[Range, int]:
    """Hull of ``known`` and the tail, and the operations spent; no hull if T is too early."""
    box = tail.box(start)
    if box is None:
        return (-math.inf, math.inf), 0
    scale = max(map(abs, known))
    # A tail that needs many more boxes than its limit does is better searched from later.
    search = Extremes(tail.form, box, narrow=tail.narrow, scale=scale, most_boxes=most_boxes)
    return (search.infimum(known[0]), search.supremum(known[1])), search.work


def _is_early(tail: Tail, start: float, known: Range) -> bool:
    """Guess whether doubling T further, which is cheap, leaves less to search in the tail."""
    try:
        box = tail.box(start)
        if box is None:
            return True
        limit, found = natural(tail.form, tail.limit_box()), natural(tail.form, box)
    except EnvelopeError:
        return False
    lower, upper = min(limit[0], known[0]), max(limit[1], known[1])
    near = EARLY * max(abs(lower), abs(upper))
    return lower - found[0] > near or found[1] - upper > near


def _search(
    expression: sp.Expr, time: sp.Symbol, span: Range, constants: Mapping[sp.Symbol, Range]
) -> Extremes:
    used = {symbol: edge for symbol, edge in constants.items() if symbol in expression.free_symbols}
    return Extremes(expression, {time: span, **used})
