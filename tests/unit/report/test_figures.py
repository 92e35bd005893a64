"""Plots: coordinates before the template prints them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bfppc_synth.report.figures import draw


def heights(points):
    return [float(point.split(",")[1]) for point in points.split()]


@pytest.mark.parametrize("rows", [2, 800, 801, 20001])
def test_a_curve_has_at_most_eight_hundred_points(design, run_of, rows):
    for plot in draw(design, run_of(design, rows)):
        for curve in plot.curves:
            assert len(curve.points.split()) == min(rows, 800)


def test_thinning_loses_no_peak(design, run_of):
    run = run_of(design, 20001)
    u = run.u.copy()
    u[12345] = 10.0
    (_, _, plain), (_, _, spiked) = (
        draw(design, each) for each in (run, dataclasses.replace(run, u=u))
    )
    assert min(heights(spiked.curves[0].points)) == pytest.approx(36.0, abs=5.0)
    assert plain.curves[0].points != spiked.curves[0].points


def test_time_runs_from_left_to_right(design, run_of):
    for plot in draw(design, run_of(design, 20001)):
        for curve in plot.curves:
            across = [float(point.split(",")[0]) for point in curve.points.split()]
            assert across == sorted(across)
            assert float(plot.left) <= across[0]
            assert across[-1] <= float(plot.right)


def test_the_same_run_gives_the_same_text(design, run):
    assert draw(design, run) == draw(design, run)


def test_the_certified_bound_is_drawn_near_the_curve_and_named_far_from_it(design, run):
    near = dataclasses.replace(run, u=run.u * 20.0)
    assert len(draw(design, near)[2].rules) == 2
    assert "beyond" not in draw(design, near)[2].caption
    assert draw(design, run)[2].rules == ()
    assert "beyond" in draw(design, run)[2].caption


def test_a_constant_signal_can_be_drawn(design, run):
    still = dataclasses.replace(run, u=np.zeros_like(run.u))
    plot = draw(design, still)[2]
    assert plot.y_ticks
    assert set(heights(plot.curves[0].points)) == {heights(plot.curves[0].points)[0]}


def test_a_run_that_blew_up_is_drawn_up_to_there(design, run):
    x = run.x.copy()
    x[2500:] = np.nan
    plots = draw(design, dataclasses.replace(run, x=x))
    assert "nan" not in "".join(curve.points for plot in plots for curve in plot.curves)


def test_the_walls_of_the_tubes_are_drawn(design, run):
    plot = draw(design, run)[1]
    assert len(plot.rules) == 2
    assert len(plot.curves) == 2
