"""What ``--over PATH=a:b:n`` says: a path of the plant file and the values it takes."""

from __future__ import annotations

import difflib
import itertools
import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from bfppc_synth.errors import UsageError
from bfppc_synth.expressions.parse import ExpressionError, parse_constant
from bfppc_synth.spec.changed import numeric_paths

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.spec import PlantSpec

MOST_POINTS: Final = 10_000
_MOST_AXES: Final = 2
_WRITE: Final = "write --over performance.accuracy=0.02:0.5:20"
# A range this wide is meant in ratios, not in differences.
_DECADE: Final = 10.0
_DIGITS: Final = (6, 9, 12, 15, 17)


class Spacing(StrEnum):
    """What is equal from one value to the next: the difference, or the ratio."""

    LINEAR = "lin"
    GEOMETRIC = "log"


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """A swept path; ``texts`` are its values as the plant files have them, in order."""

    path: str
    spacing: Spacing
    texts: tuple[str, ...]

    @property
    def values(self) -> tuple[float, ...]:
        """The values as floats."""
        return tuple(parse_constant(text).approximate for text in self.texts)


def read_axes(words: Sequence[str], spec: PlantSpec) -> tuple[Axis, ...]:
    """Read every ``--over``.

    Parameters
    ----------
    words : sequence of str
        PATH=a:b:n, PATH=a:b:n:lin or PATH=a:b:n:log; n values from a to b, both included.
        Geometric where a and b are positive and more than a decade apart, else linear.
    spec : PlantSpec
        The plant file that is swept.

    Raises
    ------
    UsageError
        None or more than two, a path that takes no number, twice the same, too many points.
    """
    if not words:
        raise UsageError(f"sweep: over what? fix: {_WRITE}")
    if len(words) > _MOST_AXES:
        raise UsageError(
            f"--over is given {len(words)} times: a sweep has one path, or two for a surface; fix:"
            " fix the others in the plant file"
        )
    axes = tuple(_axis(word, spec) for word in words)
    for one, other in itertools.combinations(axes, 2):
        if one.path == other.path or _contains(one.path, other.path):
            raise UsageError(
                f"--over {one.path} and --over {other.path} set the same number; fix: name another"
                " path"
            )
    count = math.prod(len(axis.texts) for axis in axes)
    if count > MOST_POINTS:
        raise UsageError(f"{count} points are more than {MOST_POINTS}; fix: fewer values")
    return axes


def _contains(one: str, other: str) -> bool:
    """Whether a value for all states stands beside one for a single state."""
    short, long = sorted((one.split("."), other.split(".")), key=len)
    if len(short) == len(long):
        return False
    return any([*long[:k], *long[k + 1 :]] == short for k in range(len(long)))


def grid(axes: tuple[Axis, ...]) -> tuple[tuple[str, ...], ...]:
    """List the points, the last axis running fastest."""
    return tuple(itertools.product(*(axis.texts for axis in axes)))


def _axis(word: str, spec: PlantSpec) -> Axis:
    path, equals, wanted = word.partition("=")
    path = path.strip()
    parts = [part.strip() for part in wanted.split(":")]
    if not equals or len(parts) not in (3, 4):
        raise UsageError(f"--over {word}: not PATH=from:to:count; fix: {_WRITE}")
    known = numeric_paths(spec)
    if path not in known:
        near = difflib.get_close_matches(path, known, n=1)
        fix = f"did you mean {near[0]}?" if near else f"name a key as in {_WRITE.split()[-1]}"
        raise UsageError(
            f"--over {path}: {spec.name} has no such path that a number may stand at; fix: {fix}"
        )
    (first, low), (last, high) = (_end(word, part) for part in parts[:2])
    count = _count(word, parts[2])
    if low == high:
        raise UsageError(f"--over {word}: from and to are the same; fix: two different numbers")
    wide = low > 0.0 and high > 0.0 and max(low, high) > _DECADE * min(low, high)
    spacing = Spacing.GEOMETRIC if wide else Spacing.LINEAR
    if len(parts) == 4:
        spacing = _spacing(word, parts[3])
    if spacing is Spacing.GEOMETRIC and not (low > 0.0 and high > 0.0):
        raise UsageError(
            f"--over {word}: log from {first} to {last}, which are not both above 0; fix: :lin"
        )
    between = _between(low, high, count, spacing)
    for digits in _DIGITS:
        texts = (first, *(f"{value:.{digits}g}" for value in between), last)
        values = [low, *map(float, texts[1:-1]), high]
        if all((b > a) == (high > low) and a != b for a, b in itertools.pairwise(values)):
            return Axis(path=path, spacing=spacing, texts=texts)
    raise UsageError(f"--over {word}: {count} numbers do not fit between them; fix: fewer")


def _end(word: str, text: str) -> tuple[str, float]:
    try:
        value = parse_constant(text).approximate
    except ExpressionError as error:
        raise UsageError(
            f"--over {word}: {text or 'nothing'}: {error.message}; fix: {_WRITE}"
        ) from error
    if not math.isfinite(value):
        raise UsageError(f"--over {word}: {text} is not finite; fix: {_WRITE}")
    return text, value


def _count(word: str, text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 8 and int(text) >= 2):
        raise UsageError(f"--over {word}: {text} values; fix: a whole number from 2 on")
    if int(text) > MOST_POINTS:
        raise UsageError(f"--over {word}: {text} points are more than {MOST_POINTS}; fix: fewer")
    return int(text)


def _spacing(word: str, text: str) -> Spacing:
    if text not in tuple(Spacing):
        raise UsageError(f"--over {word}: {text} is no spacing; fix: :lin or :log")
    return Spacing(text)


def _between(low: float, high: float, count: int, spacing: Spacing) -> list[float]:
    shares = [k / (count - 1) for k in range(1, count - 1)]
    if spacing is Spacing.LINEAR:
        return [low * (1.0 - share) + high * share for share in shares]
    return [math.exp(math.log(low) * (1.0 - share) + math.log(high) * share) for share in shares]
