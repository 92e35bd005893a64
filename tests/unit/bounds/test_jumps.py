"""How far an error jumps when the gains change (docs/theory.md section 8, containment)."""

from __future__ import annotations

import numpy as np
import pytest

from bfppc_synth.bounds.jumps import largest_jump
from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.model.shapes import Shape

LINEAR = Shape(k=40.0, M=0.0, epsilon=1.0, c=0.0, N=3)
TANH = Shape(k=0.0, M=14.0, epsilon=0.9, c=0.0, N=3)
PRINTED = Shape(k=2.0, M=6.0, epsilon=0.5, c=0.1, N=3)
POWER = Shape(k=1.0, M=0.0, epsilon=1.0, c=30.0, N=5)


def phi(shape, e):
    return shape.k * e + shape.M * np.tanh(shape.M * e / shape.epsilon) + shape.c * e**shape.N


@pytest.mark.parametrize("later", [LINEAR, TANH, PRINTED, POWER])
@pytest.mark.parametrize("earlier", [LINEAR, TANH, PRINTED, POWER])
@pytest.mark.parametrize(("reach", "shift"), [(0.05, 0.0), (0.05, 0.01), (1.3, 0.2)])
def test_no_sampled_jump_exceeds_the_bound_and_the_bound_is_tight(later, earlier, reach, shift):
    bound = largest_jump(later.generic, shift, earlier.generic, reach, FloatNumbers())
    e = np.linspace(-reach, reach, 4001)
    jumps = [abs(phi(later, e + d) - phi(earlier, e)) for d in np.linspace(-shift, shift, 9)]
    sampled = float(np.max(jumps))
    assert sampled <= bound <= sampled * (1.0 + 1e-5) + 1e-6


def test_a_jump_may_be_largest_inside_and_not_at_a_corner():
    # tanh rises first and saturates: at the corner e = p^ the linear law has caught up.
    steep = Shape(k=0.0, M=10.0, epsilon=0.5, c=0.0, N=3)
    slow = Shape(k=10.0, M=0.0, epsilon=1.0, c=0.0, N=3)
    bound = largest_jump(steep.generic, 0.0, slow.generic, 1.0, FloatNumbers())
    corner = float(phi(steep, 1.0) - phi(slow, 1.0))
    assert corner < 1e-6
    assert bound > 8.0
