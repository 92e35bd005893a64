"""Python lines become C lines with the same tree; nothing else is translated."""

from __future__ import annotations

import ctypes
import math

import pytest

from bfppc_synth.errors import ShapeError
from bfppc_synth.simulation.compiled.build import NoCompilerError, build, find_compiler
from bfppc_synth.simulation.compiled.translate import PRELUDE, translate
from bfppc_synth.simulation.loading import load_text
from bfppc_synth.simulation.plant import IMPORTS

BODY = """
def several(a, b):
    v0 = a - b - (a - b * 3.0) / 7.0
    v1 = exp(v0) if v0 < 2.0 else (-v0)
    v2 = v1 / b if b else nan
    v3 = copysign(pow(abs(v2), 0.3333333333333333), v2)
    a = tanh(v3) * cosh(0.25) + asinh(a)
    return (v1, v2, a, sin(a) * cos(b) + atan(tan(v3)))
"""
HEAD = '#include <math.h>\n#define EXPORT __attribute__((visibility("default")))\n'
CALL = "EXPORT int call(double a, double b, double *out)\n{ int bad = 0; Sim_several(a, b, out, &bad); return bad; }\n"  # noqa: E501


@pytest.fixture(scope="module")
def both():
    (function,) = translate(BODY)
    assert function.results == 4
    library = build((("t.c", HEAD + PRELUDE + function.text + CALL),), "t.c")
    library.call.argtypes = (ctypes.c_double, ctypes.c_double, ctypes.POINTER(ctypes.c_double))
    python = load_text(f"{IMPORTS}\n{BODY}", name="t", origin="t").several

    def run(a, b):
        out = (ctypes.c_double * 4)()
        bad = library.call(a, b, out)
        return (None if bad else list(out)), python

    return run


def test_values_are_equal_to_the_last_bit(both):
    for k in range(400):
        a, b = 2.5 * math.sin(k), 1.5 * math.cos(7 * k)
        found, python = both(a, b)
        assert found == list(python(a, b))


@pytest.mark.parametrize(("a", "b"), [(1.0, math.inf), (-1e300, 1e308)])
def test_where_python_raises_the_flag_is_set(both, a, b):
    found, python = both(a, b)
    with pytest.raises((OverflowError, ValueError)):
        python(a, b)
    assert found is None


@pytest.mark.parametrize(
    "text",
    [
        "def f(a):\n    a += 1.0\n    return a",
        "def f(a):\n    b = a\n",
        "def f(a):\n    return a ** 2.0",
        "def f(a):\n    return open(a)",
        "def f(a):\n    return 1 if a and a else 2.0",
        "def f(a):\n    return 'text'",
    ],
)
def test_other_lines_are_refused(text):
    with pytest.raises(ShapeError):
        translate(text)


def test_a_text_that_no_compiler_takes_is_said():
    assert find_compiler() is not None
    with pytest.raises(NoCompilerError, match="refuses the loop"):
        build((("broken.c", "int broken = ;\n"),), "broken.c")
