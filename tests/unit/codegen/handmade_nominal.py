"""Designs with center nominal made by hand, on top of ``handmade``.

Loaded by path from several test folders (the tests have no packages).
"""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.model.nominal import NominalModel
from bfppc_synth.model.spec import CenterKind

if TYPE_CHECKING:
    from types import ModuleType

    from bfppc_synth.model.design import Design


def _load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


handmade = _load("handmade")
T = handmade.T
X1, X2, X3, X4 = STATES = sp.symbols("x1 x2 x3 x4", real=True)
ONE = sp.Integer(1)


def make_nominal(
    f: tuple[object, ...], g: tuple[object, ...], *, T_s: float = 2.0, bounds=(), **changed
) -> Design:
    """Build a design; ``bounds`` are Y_0..Y_{n+1} of a reference supplied at run time."""
    design = handmade.make_design(**changed)
    spec = design.spec
    reference = replace(
        spec.reference, bounds=tuple(handmade.constant(str(bound)) for bound in bounds)
    )
    synthesis = replace(spec.synthesis, center=CenterKind.NOMINAL)
    model = NominalModel(
        states=STATES[: spec.order],
        f=tuple(map(sp.sympify, f)),
        g=tuple(map(sp.sympify, g)),
        left_out=((),) * spec.order,
        transition=T_s,
    )
    spec = replace(spec, reference=reference, synthesis=synthesis)
    return replace(design, spec=spec, nominal=model)


def integrator() -> Design:
    """One state: the center has one weight and the plant no model but its gain."""
    return make_nominal(
        (0,),
        (sp.Rational(3, 2),),
        T_s=0.75,
        name="integrator",
        gains=(handmade.shape(k=2.5),),
        p=(1.0,),
        initial=(("-1", "1"),),
        X=(1.5,),
        reference=sp.Rational(1, 2) + sp.cos(3 * T) / 2,
    )


def pendulum() -> Design:
    """Two states, quantized and sampled, a gain that depends on the state."""
    return make_nominal(
        (X1 / 3, -sp.Rational(3, 2) * sp.sin(X1) - X2 / 5),
        (ONE, 2 + sp.cos(X1)),
        name="pendulum",
        gains=(handmade.shape(k=1.5, M=0.8, epsilon=0.5), handmade.shape(k=3.0, c=0.25)),
        p=(1.0, 4.0),
        initial=(("-3/2", "3/2"), ("-1", "1")),
        X=(1.5, 3.0),
        delta=(0.001, 0.01),
        eta=(0.001, 0.02),
        period="1/10000",
    )


def supplied() -> Design:
    """Three states, a reference supplied at run time with its derivatives, every function."""
    return make_nominal(
        (
            sp.tanh(X1) / 4 - sp.atan(X1) / 8,
            sp.exp(-(X1**2)) * X2 / 2 + sp.sqrt(4 + X1**2) / 4,
            -X3 / (1 + X2**2) + sp.asinh(X1) * sp.cosh(X2 / 4) / 8 - sp.log(3 + sp.sin(X1)),
        ),
        (sp.Rational(7, 3), 1 + X1**2 / 16, 3 + sp.cos(X1 * X2) - sp.sinh(X3 / 64) / 4),
        bounds=("0.5", "0.6", "0.7", "0.9", "1.1"),
        name="supplied",
        gains=(handmade.shape(k=1.0), handmade.shape(k=0.5, M=1.0, epsilon=2.0), handmade.shape()),
        p=(1.0, 3.0, 6.0),
        initial=(("-1", "1"),) * 3,
        offset="1/2",
        reference=None,
        X=(1.5, 3.0, 4.0),
        delta=(0.02, 0.02, 0.02),
        period="1/1000",
        Y_0=0.5,
    )


def joint() -> Design:
    """Four states: the flexible joint of issue 5, as a nominal model."""
    return make_nominal(
        (0, -sp.Rational(333, 100) * sp.sin(X1) - sp.Rational(39, 2) * X1, 0,
         sp.Rational(243, 5) * (X1 - X3) - sp.Rational(5, 4) * X4),
        (ONE, sp.Rational(39, 2), ONE, sp.Rational(108, 5)),
        name="joint",
        gains=(handmade.shape(k=1.0),) * 4,
        p=(1.0, 2.0, 3.0, 4.0),
        initial=(("0", "2/5"), ("-1", "1"), ("0", "1/5"), ("-1", "1")),
        X=(1.0, 2.0, 3.0, 4.0),
        reference=sp.sin(T) / 2 * (1 - sp.exp(-(T**2) / 10)),
        Y_0=0.5,
    )  # fmt: skip


def vanishing() -> Design:
    """A gain with a zero and an exponential that overflows, both within the screening limits."""
    return make_nominal(
        (sp.exp(3 * X1) / 8, sp.tan(X1 / 2) * X2),
        (1 - X1 / 4, ONE),
        T_s=3.0,
        name="vanishing",
        gains=(handmade.shape(k=1.0), handmade.shape(k=1.0)),
        p=(1.0, 2.0),
        initial=(("-1", "1"), ("-1", "1")),
        X=(80.0, 3.0),
        reference=sp.tanh(T) / 2,
    )


DESIGNS = {
    "integrator": integrator,
    "pendulum": pendulum,
    "supplied": supplied,
    "joint": joint,
    "vanishing": vanishing,
}
