"""Plots as inline SVG: coordinates are decided here, templates/report/plot.html.jinja prints."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.model.certificate import Verdict

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.trajectory import Trajectory

WIDTH, HEIGHT = 560.0, 286.0
LEFT, RIGHT, TOP, BOTTOM = 58.0, 12.0, 26.0, 46.0
BINS = 400
TICKS = 6
# A bound this many times higher than the curve would flatten it: it is named, not drawn.
OFF_SCALE = 4.0


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


def draw(design: Design, nominal: Trajectory) -> tuple[Plot, ...]:
    """Draw the nominal run: output in its envelope, errors in their tubes, input.

    Parameters
    ----------
    design : Design
        Half-widths p_i, bound U, names and units.
    nominal : Trajectory
        Arrays of N rows; rows after a blow-up (not finite) are left out.

    Returns
    -------
    tuple[Plot, ...]
        Three plots, at most 800 points a curve, the same text for the same numbers.

    References
    ----------
    docs/theory.md section 3 (what the tubes and U bound).
    """
    usable = np.isfinite(nominal.x).all(axis=1) & np.isfinite(nominal.e).all(axis=1)
    usable &= np.isfinite(nominal.r).all(axis=1) & np.isfinite(nominal.u)
    count = len(usable) if bool(usable.all()) else max(2, int(usable.argmin()))
    rows = slice(0, count)
    units = dict(design.spec.units)
    output = _output(design, nominal, rows, units)
    return (output, _errors(design, nominal, rows), _input(design, nominal, rows, units))


def _output(design: Design, nominal: Trajectory, rows: slice, units: dict[str, str]) -> Plot:
    state = design.spec.states[0]
    certified = design.certificate.verdict is Verdict.CERTIFIED
    claim = "is proved never to leave it" if certified else "is not proved to stay inside"
    t, width = nominal.t[rows], design.omega[0]
    lower, upper = nominal.r[rows, 0] - width, nominal.r[rows, 0] + width
    series = (
        ("curve-1", f"output `{state}`", nominal.x[rows, 0]),
        ("curve-2 dashed", "reference $y_d$", nominal.y_d[rows]),
    )
    return _plot(
        key="output",
        title="Output in its envelope",
        description=f"{state} and the reference y_d over time; the shaded band is the envelope "
        f"of half-width p_1 around r_1, and the output {claim}.",
        caption=f"The band has half-width $p_1$ = #omega/p/0# around $r_1$; the output {claim}.",
        y_label=_with_unit(state, units.get(state)),
        t=t,
        series=series,
        band=(lower, upper, r"envelope $r_1 \pm p_1$"),
    )


def _errors(design: Design, nominal: Trajectory, rows: slice) -> Plot:
    series = tuple(
        (f"curve-{1 + i % 6}", f"$e_{{{i + 1}}} / p_{{{i + 1}}}$", nominal.e[rows, i] / width)
        for i, width in enumerate(design.omega)
    )
    return _plot(
        key="errors",
        title="Errors in their tubes",
        description="Every error e_i divided by its half-width p_i over time; the horizontal "
        "lines at -1 and 1 are the walls of the invariant set.",
        caption="Every error divided by the half-width of its tube: the walls are at one.",
        y_label="error by half-width",
        t=nominal.t[rows],
        series=series,
        rules=((-1.0, 1.0), "walls of the tubes"),
    )


def _input(design: Design, nominal: Trajectory, rows: slice, units: dict[str, str]) -> Plot:
    u, bound = nominal.u[rows], design.bounds.U
    reached = float(np.abs(u).max())
    drawn = math.isfinite(bound) and bound <= OFF_SCALE * max(reached, 1e-300)
    hidden = "" if drawn else ", so that the bound lies beyond this axis"
    where = "the horizontal lines are" if drawn else "it stays far below"
    return _plot(
        key="input",
        title="Input",
        description=f"The input u over time; {where} the bound U.",
        caption="The bound is $U$ = #bounds/U#; this run used a share of "
        f"#simulation/share_of_U# of it{hidden}.",
        y_label=_with_unit("u", units.get("u")),
        t=nominal.t[rows],
        series=(("curve-1", "input $u$", u),),
        rules=((-bound, bound), r"bound $\pm U$") if drawn else ((), ""),
    )


def _plot(
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
) -> Plot:
    edges = [*band[:2]] if band is not None else []
    heights = [np.asarray(rules[0], dtype=np.float64)] if rules[0] else []
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
        curves=tuple(
            Curve(
                points=" ".join(_points(t, values, horizontal, vertical)), style=style, label=label
            )
            for style, label, values in series
        ),
        width=_pixel(WIDTH),
        height=_pixel(HEIGHT),
        left=_pixel(LEFT),
        right=_pixel(WIDTH - RIGHT),
        top=_pixel(TOP),
        bottom=_pixel(HEIGHT - BOTTOM),
    )


def _with_unit(name: str, unit: str | None) -> str:
    return f"{name} [{unit}]" if unit else name


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
