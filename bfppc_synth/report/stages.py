"""The part of report.json about the stages of theorem3 (docs/theory.md section 8)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.model.spec import Form
from bfppc_synth.model.stages import Handover
from bfppc_synth.report.numbers import finite, finites

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.stages import Stage
    from bfppc_synth.model.trajectory import StagePeaks


def stages_entry(design: Design) -> dict[str, object]:
    """Lay out all K stages, the last one too: empty for the other methods.

    Parameters
    ----------
    design : Design
        Its ``stages`` are 1..K-1.

    Returns
    -------
    dict[str, object]
        ``stages``: gains, omega, and of the free ones the widened tube, the speeds and the
        peak command; ``handover``: what happens at a switch, and ``excess``, by how much
        |y - y_d - rho_1 a| may exceed ``accuracy`` until the handovers have faded [unit of y].

    References
    ----------
    docs/theory.md section 8.
    """
    if not design.stages:
        return {}
    synthesis = design.spec.synthesis
    excess = sum(stage.anchor_limit for stage in design.stages) if reanchors(design) else 0.0
    last: dict[str, object] = {
        "gains": [_gain(gain) for gain in design.gains],
        "omega": {"p": list(design.omega)},
    }
    return {
        "stages": [*(_free(stage) for stage in design.stages), last],
        "handover": {
            "kind": str(synthesis.handover) if synthesis.form is Form.SOUND else "printed",
            "excess": finite(excess),
        },
    }


def reanchors(design: Design) -> bool:
    """Whether a switch moves the center, and with it the promise."""
    synthesis = design.spec.synthesis
    sound = synthesis.form is Form.SOUND
    return bool(design.stages) and sound and synthesis.handover is Handover.REANCHOR


def handover_sentences() -> tuple[str, ...]:
    """Say, for ``sentences.prose``, what a switch does to the output's promise."""
    curve = r"y_d(t) + \rho_1(t) a + \sum_l \rho_1(t - t_l)\, r_1^{(l)}"
    return (
        (
            r"Before the first switch. The output stays within #stages/0/omega/widened/0# of "
            r"$y_d(t) + \rho_1(t) a$."
        ),
        (
            "Switches. A stage is left for ever at the first sample whose measured errors are "
            r"outside its half-widths. At switch $l$, at $t_l$, the measured error "
            rf"$r_1^{{(l)}}$ becomes part of the known curve, from then on ${curve}$. In the last "
            r"stage the output stays within $p_1$ = #omega/p/0# of it; the handovers add at most "
            r"#handover/excess# to $\left|y - y_d - \rho_1 a\right|$, and fade as $\rho_1$ does."
        ),
    )


def _free(stage: Stage) -> dict[str, object]:
    return {
        "gains": [_gain(gain) for gain in stage.gains],
        "omega": {"p": list(stage.omega), "widened": finites(stage.widened)},
        "bounds": {
            "X": finites(stage.bounds.X),
            "A": finites(stage.bounds.A),
            "eta": finites(stage.bounds.eta),
            "speed": finites(stage.speed),
            "U": finite(stage.peak),
        },
    }


def _gain(gain: Gain) -> dict[str, object]:
    return {"k": gain.k, "M": gain.M, "epsilon": gain.epsilon, "c": gain.c, "N": gain.N}


def peaks_entry(stages: tuple[StagePeaks, ...]) -> dict[str, object]:
    """Lay out what every stage that a run was in came to; empty without stages."""
    if not stages:
        return {}
    return {
        "stages": [
            {
                "stage": entry.stage,
                "max_abs_e": finites(entry.max_abs_e),
                "half_widths": finites(entry.half_widths),
                "within_bounds": entry.within_bounds,
            }
            for entry in stages
        ]
    }
