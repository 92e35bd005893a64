"""How the code is called and checked again: lines that a user types."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bfppc_synth.model.spec import CenterKind, ReferenceKind
from bfppc_synth.report.numbers import look_up

if TYPE_CHECKING:
    from collections.abc import Mapping

_VERIFY = (
    "python verify.py            # proves the inequalities again; needs no package",
    "bfppc-synth verify .        # the same, with the package",
)
_PASSED = "y_d lists the reference at t and its exact derivatives, order 1 to {order}."
# (real, math): what is said of it, and how near C is to Python.
_ARITHMETIC = {
    ("double", "libm"): ((), ", the same bits"),
    ("double", "portable"): (
        (
            (
                "The code computes in binary64, with tanh, sin, cos and exp of its own, made of"
                " + - * / and comparisons: no libm is assumed."
            ),
        ),
        ", the same bits on every machine",
    ),
    ("float", "libm"): (
        (
            (
                "The C code computes in binary32, every constant and every rounding of it is in the"
                " certificate; controller.py rounds as it does."
            ),
        ),
        "; tanhf, sinf, cosf, expf may differ from Python in the last digits",
    ),
    ("float", "portable"): (
        (
            (
                "The C code computes in binary32, with tanh, sin, cos and exp of its own, made of"
                " + - * / and comparisons: no libm is assumed; controller.py rounds as it does."
            ),
        ),
        ", the same bits on every machine",
    ),
}
_SIMULATE = "bfppc-synth simulate .      # runs controller.py against the plant again"


def call_lines(document: Mapping[str, object]) -> dict[str, object]:
    """Give the lines that a user types; they depend on the reference and on the certificate.

    Parameters
    ----------
    document : Mapping[str, object]
        report.json.

    Returns
    -------
    dict[str, object]
        What templates/report/use.html.jinja and README.md.jinja print.
    """
    supplied = look_up(document, ("reference", "kind")) == str(ReferenceKind.RUNTIME)
    nominal = document["center"] == str(CenterKind.NOMINAL)
    certificate = document["certificate"]
    return {
        "python_reference": ", y_d" if supplied else "",
        "c_reference": "y_d" if supplied else f"{document['name']}_reference(t)",
        "passed": _PASSED.format(order=document["order"]) if supplied and nominal else "",
        "certificates": [certificate] if certificate else [],
        **_arithmetic(document),
        "commands": [*(_VERIFY if certificate else ()), _SIMULATE],
    }


def _arithmetic(document: Mapping[str, object]) -> dict[str, object]:
    """Say what the code computes with, unless it is binary64 and the libm, and what is equal."""
    given: Any = document.get("arithmetic", {"real": "double", "math": "libm"})
    kind = given["real"], given["math"]
    return {"arithmetic": list(_ARITHMETIC[kind][0]), "same": _ARITHMETIC[kind][1]}
