"""One plot as numbers in pixels; templates/report/plot.html.jinja prints them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

WIDTH, HEIGHT = 560.0, 286.0
LEFT, RIGHT, TOP, BOTTOM = 58.0, 12.0, 26.0, 46.0
BINS = 400
TICKS = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Tick:
    """A position on an axis [px] and its label."""

    at: str
    label: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """A polyline (``points`` as SVG wants them), its CSS class and its name in the legend."""

    points: str
    style: str
    label: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """Everything that the template prints.

    ``bands`` are filled polygons, ``rules`` horizontal bounds at a height [px], each with its
    names in the legend; ``key`` names the plot in ids; ``description`` is the alternative
    text and ``caption`` a sentence for ``prose``.
    """

    key: str
    title: str
    description: str
    caption: str
    y_label: str
    x_label: str
    x_ticks: tuple[Tick, ...]
    y_ticks: tuple[Tick, ...]
    bands: tuple[str, ...]
    band_labels: tuple[str, ...]
    rules: tuple[str, ...]
    rule_labels: tuple[str, ...]
    curves: tuple[Curve, ...]
    width: str
    height: str
    left: str
    right: str
    top: str
    bottom: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Axis:
    """A linear map from numbers to pixels."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        return self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)


def plot(
    *,
    key: str,
    title: str,
    description: str,
    caption: str,
    y_label: str,
    t: NDArray[np.float64],
    series: tuple[tuple[str, str, NDArray[np.float64]], ...],
    band: tuple[NDArray[np.float64], NDArray[np.float64], str] | None = None,
    rules: tuple[tuple[float, ...], str] = ((), ""),
    start: tuple[tuple[float, float], str] | None = None,
) -> Plot:
    """Lay out a plot in pixels.

    Parameters
    ----------
    key, title, description, caption, y_label : str
        As in ``Plot``.
    t : array (N,)
        Time of the rows [s].
    series : tuple
        (CSS class, name, array (N,)) of every curve.
    band : tuple, optional
        Lower and upper edge, arrays (N,), and their name.
    rules : tuple
        Heights of horizontal bounds, and their name.
    start : tuple, optional
        A range of heights at the first row, and its name.

    Returns
    -------
    Plot
        At most 800 points a curve, the same text for the same numbers.
    """
    edges = [*band[:2]] if band is not None else []
    marked = start[0] if start is not None else ()
    heights = [np.asarray(each, dtype=np.float64) for each in (rules[0], marked) if each]
    everything = np.concatenate([*(values for _, _, values in series), *edges, *heights])
    # A run may end in its first row.
    end = float(t[-1]) if t[-1] > t[0] else float(t[0]) + 1.0
    horizontal = _Axis(low=float(t[0]), high=end, start=LEFT, end=WIDTH - RIGHT)
    low, high = _padded(float(everything.min()), float(everything.max()))
    vertical = _Axis(low=low, high=high, start=HEIGHT - BOTTOM, end=TOP)
    filled = ""
    if band is not None:
        there = _points(t, band[0], horizontal, vertical)
        back = _points(t, band[1], horizontal, vertical)
        filled = " ".join([*there, *reversed(back)])
    curves = [
        Curve(points=" ".join(_points(t, values, horizontal, vertical)), style=style, label=label)
        for style, label, values in series
    ]
    if start is not None:
        at = _pixel(LEFT)
        ends = " ".join(f"{at},{_pixel(vertical(value))}" for value in start[0])
        curves.append(Curve(points=ends, style="start", label=start[1]))
    return Plot(
        key=key,
        title=title,
        description=description,
        caption=caption,
        y_label=y_label,
        x_label="time since the first sample [s]",
        x_ticks=_ticks(horizontal),
        y_ticks=_ticks(vertical),
        bands=(filled,) if filled else (),
        band_labels=(band[2],) if band is not None else (),
        rules=tuple(_pixel(vertical(value)) for value in rules[0]),
        rule_labels=(rules[1],) if rules[1] else (),
        curves=tuple(curves),
        width=_pixel(WIDTH),
        height=_pixel(HEIGHT),
        left=_pixel(LEFT),
        right=_pixel(WIDTH - RIGHT),
        top=_pixel(TOP),
        bottom=_pixel(HEIGHT - BOTTOM),
    )


def _pixel(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _points(
    t: NDArray[np.float64], values: NDArray[np.float64], horizontal: _Axis, vertical: _Axis
) -> list[str]:
    return [
        f"{_pixel(horizontal(at))},{_pixel(vertical(value))}" for at, value in _thinned(t, values)
    ]


def _thinned(t: NDArray[np.float64], values: NDArray[np.float64]) -> Iterable[tuple[float, float]]:
    """Keep the least and the largest value of every one of 400 bins: no peak is lost."""
    if len(t) <= 2 * BINS:
        yield from zip(t.tolist(), values.tolist(), strict=True)
        return
    starts = np.linspace(0, len(t), BINS, endpoint=False).astype(np.int64)
    least = np.minimum.reduceat(values, starts)
    largest = np.maximum.reduceat(values, starts)
    ends = np.append(starts[1:], len(t)) - 1
    # The instants are fixed by the bin and not by where the extremes are, so that a last
    # digit that differs between processors cannot move a point sideways.
    rising = values[ends] >= values[starts]
    first = np.where(rising, least, largest)
    second = np.where(rising, largest, least)
    for left, right, one, two in zip(
        t[starts].tolist(), t[ends].tolist(), first.tolist(), second.tolist(), strict=True
    ):
        yield left, one
        yield right, two


def _padded(low: float, high: float) -> tuple[float, float]:
    spread = max(high - low, 1e-9 * max(abs(high), abs(low)), 1e-12)
    return low - 0.05 * spread, high + 0.05 * spread


def _ticks(axis: _Axis) -> tuple[Tick, ...]:
    step = _round_step((axis.high - axis.low) / TICKS)
    first, last = math.ceil(axis.low / step), math.floor(axis.high / step)
    return tuple(
        Tick(at=_pixel(axis(index * step)), label=_label(index * step))
        for index in range(first, last + 1)
    )


def _round_step(rough: float) -> float:
    power = 10.0 ** math.floor(math.log10(rough))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= rough)


def _label(value: float) -> str:
    return f"{value:.6g}".replace("e+0", "e").replace("e-0", "e-").replace("-", "\N{MINUS SIGN}")
