"""What the C package brings along to test, prove and measure itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from bfppc_synth.codegen.cost import step_cost

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.model.law import Law

#: Path under the generated folder: its template. The vectors of test/ come from a simulation.
CHECKS: Final = {
    "c/test/golden.c": "c/test/golden.c.jinja",
    "c/test/fuzz.c": "c/test/fuzz.c.jinja",
    "c/verify/harness.c": "c/verify/harness.c.jinja",
    "c/verify/libm.h": "c/verify/libm.h.jinja",
    "c/verify/caller.c": "c/verify/caller.c.jinja",
    "c/verify/clang-tidy.yaml": "c/verify/clang-tidy.yaml.jinja",
    "c/verify/run.sh": "c/verify/run.sh.jinja",
    "c/target/startup.c": "c/target/startup.c.jinja",
    "c/target/mps2_an386.ld": "c/target/mps2_an386.ld.jinja",
    "c/target/measure.c": "c/target/measure.c.jinja",
}


def beyond_limits(law: Law, literal: Callable[[float], str]) -> dict[str, object]:
    """Write what the tests go beyond, and what the README says of time.

    Parameters
    ----------
    law : Law
        The controller.
    literal : Callable
        Writes a number in C.

    Returns
    -------
    dict[str, object]
        Part of the context of the templates of ``CHECKS`` and of c/README.md.
    """
    limits = {constant.name: float(constant.value) for constant in law.limits}
    return {
        "u_limit": literal(law.u_max),
        "x_limits": [literal(limits[test.upper]) for test in law.inputs],
        "y_limits": [literal(limits[test.upper]) for test in law.reference_ranges],
        "example_period": literal(law.period or 0.001),
        "call_period": law.period or None,
        "operations": step_cost(law).words(),
    }
