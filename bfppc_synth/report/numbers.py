"""How a number gets into report.json, and from there onto the page."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.expression import Constant

ABSENT = "\N{EM DASH}"
DIGITS = 6


def finite(value: float) -> float | None:
    """Give the number, or None where JSON has no word for it."""
    return float(value) if math.isfinite(value) else None


def finites(values: Sequence[float]) -> list[float | None]:
    """Give every number, or None in its place."""
    return [finite(value) for value in values]


def constant(value: Constant) -> float:
    """Give the binary64 number nearest to a constant of the plant file."""
    return value.approximate if value.exact is None else float(value.exact)


def largest(values: Sequence[float]) -> float:
    """Give the largest of the numbers (0 of none), infinity if one of them is not finite."""
    if not all(math.isfinite(value) for value in values):
        return math.inf
    return max(values, default=0.0)


def shown(value: object) -> str:
    """Print a number of report.json as the page and the README show it.

    Parameters
    ----------
    value : object
        An int is printed whole, a float to six significant digits, None as a dash, a
        truth value as yes or no, a text as it is.

    Returns
    -------
    str
        Text that ``float`` reads back, for numbers.
    """
    if value is None:
        return ABSENT
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        mantissa, exponent, power = f"{value:.{DIGITS}g}".partition("e")
        return f"{mantissa}e{int(power)}" if exponent else mantissa
    return str(value)


def exact(value: object) -> str:
    """Print a value as report.json does, a float so that it reads back to the same bits."""
    return value if isinstance(value, str) else json.dumps(value)


def path_text(keys: Sequence[str | int]) -> str:
    """Write a place in report.json, such as ``gains[0].k``."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)
    return text.removeprefix(".")


def look_up(document: object, keys: Sequence[str | int]) -> object:
    """Follow keys and indices into report.json.

    Raises
    ------
    KeyError, IndexError
        If the document has no such place.
    """
    value: Any = document
    for key in keys:
        value = value[key]
    return value
