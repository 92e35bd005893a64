"""Plots as inline SVG: coordinates are decided here, templates/report/plot.html.jinja prints."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.model.certificate import Verdict
from bfppc_synth.report.funnel import funnel_curves
from bfppc_synth.report.numbers import constant
from bfppc_synth.report.plots import Plot, plot

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.trajectory import Trajectory

# A bound this many times higher than the curve would flatten it: it is named, not drawn.
OFF_SCALE = 4.0


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
        Three plots, with center nominal the center before them; at most 800 points a curve,
        the same text for the same numbers.

    References
    ----------
    docs/theory.md sections 3 (what the tubes and U bound) and 4 (the center).
    """
    usable = np.isfinite(nominal.x).all(axis=1) & np.isfinite(nominal.e).all(axis=1)
    usable &= np.isfinite(nominal.r).all(axis=1) & np.isfinite(nominal.u)
    count = len(usable) if bool(usable.all()) else max(2, int(usable.argmin()))
    rows = slice(0, count)
    units = dict(design.spec.units)
    output = _output(design, nominal, rows, units)
    plots = (output, _errors(design, nominal, rows), _input(design, nominal, rows, units))
    return plots if design.nominal is None else (_center(design, nominal, count, units), *plots)


def _output(design: Design, nominal: Trajectory, rows: slice, units: dict[str, str]) -> Plot:
    state = design.spec.states[0]
    certified = design.certificate.verdict is Verdict.CERTIFIED
    claim = "is proved never to leave it" if certified else "is not proved to stay inside"
    t, width = nominal.t[rows], design.omega[0]
    lower, upper = nominal.r[rows, 0] - width, nominal.r[rows, 0] + width
    series = (
        ("curve-1", f"output `{state}`", nominal.x[rows, 0]),
        ("curve-2 dashed", "reference $y_d$", nominal.y_d[rows]),
        *funnel_curves(design, nominal, rows),
    )
    return plot(
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


def _center(design: Design, nominal: Trajectory, count: int, units: dict[str, str]) -> Plot:
    """Draw r_1 against y_d while the start is carried over, twice T_s."""
    if design.nominal is None:
        raise LookupError("nominal")
    state, width, start = design.spec.states[0], design.omega[0], design.spec.initial[0]
    shown = int(np.searchsorted(nominal.t[:count], 2.0 * design.nominal.transition, side="right"))
    rows = slice(0, min(count, max(shown, 2)))
    center = nominal.r[rows, 0]
    return plot(
        key="center",
        title="Center and reference",
        description=f"The center r_1 = y_d + b and the reference y_d over time; the shaded band is "
        f"the envelope of half-width p_1 around r_1, the bar at the left the starts of {state}.",
        caption=r"The center leads the start to the reference: $r_1 = y_d + b$, and $b$ is zero "
        "from $T_s$ = #performance/transition# s on.",
        y_label=_with_unit(state, units.get(state)),
        t=nominal.t[rows],
        series=(
            ("curve-1", "center $r_1 = y_d + b$", center),
            ("curve-2 dashed", "reference $y_d$", nominal.y_d[rows]),
        ),
        band=(center - width, center + width, r"envelope $r_1 \pm p_1$"),
        start=((constant(start.lower), constant(start.upper)), f"starts of `{state}`"),
    )


def _errors(design: Design, nominal: Trajectory, rows: slice) -> Plot:
    series = tuple(
        (f"curve-{1 + i % 6}", f"$e_{{{i + 1}}} / p_{{{i + 1}}}$", nominal.e[rows, i] / width)
        for i, width in enumerate(design.omega)
    )
    return plot(
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
    return plot(
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


def _with_unit(name: str, unit: str | None) -> str:
    return f"{name} [{unit}]" if unit else name
