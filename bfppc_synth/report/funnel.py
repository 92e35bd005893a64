"""The funnel of the plant file on the page: its promise and its edges in the figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.bounds.funnel_values import funnel_values
from bfppc_synth.report.formulas import expression_latex

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.trajectory import Trajectory


def funnel_promise(design: Design) -> tuple[str, ...]:
    """Say that the output stays in the funnel: one sentence for ``prose``, none without one."""
    funnel = design.plant.funnel
    if funnel is None:
        return ()
    return (
        (
            r"Funnel. $\left|y - y_d\right| \le F(t)$ at every time $t \ge 0$, where $F(t)$ = "
            f"${expression_latex(funnel)}$: the curve and its tube fit into the funnel of the "
            "plant file."
        ),
    )


def funnel_curves(
    design: Design, nominal: Trajectory, rows: slice
) -> tuple[tuple[str, str, NDArray[np.float64]], ...]:
    """Both edges of the funnel around y_d, as ``plot`` takes curves."""
    width = funnel_values(design.plant, nominal.t[rows])
    if width is None:
        return ()
    y_d = nominal.y_d[rows]
    return (("rule", r"funnel $y_d \pm F(t)$", y_d + width), ("rule", "", y_d - width))
