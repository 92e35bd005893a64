"""Certified quantized controllers for uncertain strict-feedback plants.

>>> import bfppc_synth as bs
>>> spec = bs.load_spec("examples/paper_example_2.yaml")      # doctest: +SKIP
>>> design = bs.synthesize(spec)                              # doctest: +SKIP
>>> design.certificate.require()                              # doctest: +SKIP
>>> bs.write(design, "generated/paper_example_2")             # doctest: +SKIP
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bfppc_synth.artifacts import simulate_trajectory as simulate
    from bfppc_synth.artifacts import write
    from bfppc_synth.errors import (
        BfppcError,
        NoDesignError,
        NotCertifiedError,
        PlantFileError,
        UsageError,
    )
    from bfppc_synth.spec.load import load_spec
    from bfppc_synth.synthesis.synthesize import synthesize

__all__ = [
    "BfppcError",
    "NoDesignError",
    "NotCertifiedError",
    "PlantFileError",
    "UsageError",
    "load_spec",
    "simulate",
    "synthesize",
    "write",
]

_HOMES = {
    "BfppcError": ("errors", "BfppcError"),
    "NoDesignError": ("errors", "NoDesignError"),
    "NotCertifiedError": ("errors", "NotCertifiedError"),
    "PlantFileError": ("errors", "PlantFileError"),
    "UsageError": ("errors", "UsageError"),
    "load_spec": ("spec.load", "load_spec"),
    "simulate": ("artifacts", "simulate_trajectory"),
    "synthesize": ("synthesis.synthesize", "synthesize"),
    "write": ("artifacts", "write"),
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: ``--help`` must not wait for sympy."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    module, attribute = _HOMES[name]
    return getattr(import_module(f"{__name__}.{module}"), attribute)
