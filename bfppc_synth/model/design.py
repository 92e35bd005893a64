"""A design: gains, tube, bounds, certificate."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from bfppc_synth.model.arithmetic import DEFAULT

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.bounds import (
        CenterBounds,
        ChainBounds,
        Conditions,
        Majorants,
        SignalBounds,
    )
    from bfppc_synth.model.certificate import Certificate
    from bfppc_synth.model.nominal import NominalModel, NominalSplit
    from bfppc_synth.model.optimality import Optimality
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.sensitivity import Sensitivity
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.model.stages import Stage
    from bfppc_synth.model.theorem1 import Theorem1Bounds
    from bfppc_synth.model.tight import Termwise, TightBounds


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """Everything that the code generation, the simulation and the report read.

    ``gains`` phi_1..phi_n, ``omega`` p_1..p_n; ``largest_certified_period`` is a lower bound
    on the sample period [s] that these gains tolerate; ``stages`` are the free stages of
    theorem3, whose last stage everything else here is about (``signals`` are common to all);
    ``theorem1`` is there with that method only, ``nominal`` and
    ``nominal_split`` with that center only, ``tight`` and ``termwise`` with ``bounds: tight`` only.
    ``arithmetic`` is what the code computes with: the certificate is about it, and in binary32
    ``bounds`` contain its rounding. ``sensitivities`` estimate what each requirement costs.
    ``optimality`` is what the search knows of its optimum, None where nothing was searched or the
    design was read back.
    """

    spec: PlantSpec
    plant: Plant
    majorants: Majorants
    signals: SignalBounds
    center: CenterBounds
    conditions: Conditions
    gains: tuple[Gain, ...]
    omega: tuple[float, ...]
    bounds: ChainBounds[float]
    certificate: Certificate
    largest_certified_period: float
    stages: tuple[Stage, ...] = ()
    theorem1: Theorem1Bounds | None = None
    nominal: NominalModel | None = None
    nominal_split: NominalSplit | None = None
    tight: TightBounds | None = None
    termwise: Termwise | None = None
    arithmetic: Arithmetic = DEFAULT
    sensitivities: tuple[Sensitivity, ...] = ()
    optimality: Optimality | None = None

    def _repr_html_(self) -> str:
        """Show the tables of the report in a notebook."""
        return str(_display("notebook_html")(self))

    def _repr_latex_(self) -> str:
        """Show them in a notebook that is printed through LaTeX."""
        return str(_display("notebook_latex")(self))


def _display(name: str) -> Callable[[Design], str]:
    # By name, as bfppc_synth/__init__.py does: the record stays below the room that shows it.
    return getattr(import_module("bfppc_synth.report.notebook"), name)  # type: ignore[no-any-return]
