"""Quantizers: what the controller gets to see of a state (docs/theory.md sections 0 and 3)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from bfppc_synth.errors import ShapeError
from bfppc_synth.model.spec import QuantizerKind

if TYPE_CHECKING:
    from bfppc_synth.model.expression import Constant
    from bfppc_synth.model.spec import QuantizerSpec


class Quantizer(Protocol):
    """A map q with |q(x) - x| <= resolution; one with memory forgets it at ``reset``."""

    @property
    def resolution(self) -> float:
        """delta_0, the bound on |q(x) - x| [unit of x]."""

    def reset(self) -> None:
        """Forget what an earlier run left behind."""

    def __call__(self, x: float) -> float:
        """Measure x [unit of x]."""


class Exact:
    """No quantizer: q(x) = x."""

    __slots__ = ()
    resolution = 0.0

    def reset(self) -> None:
        """Do nothing: there is no memory."""

    def __call__(self, x: float) -> float:
        """Return x."""
        return x


class Uniform:
    """Levels k l, the cell of each half a step to either side: the paper's (3), corrected.

    As printed, (3) leaves a gap and overlaps (docs/theory.md section 7, item 4).
    """

    __slots__ = ("resolution", "step")

    def __init__(self, step: float) -> None:
        self.step = step
        self.resolution = step / 2.0

    def reset(self) -> None:
        """Do nothing: there is no memory."""

    def __call__(self, x: float) -> float:
        """Round x to the nearest level."""
        return self.step * math.floor(x / self.step + 0.5)


class DeadZoneUniform:
    """0 for |x| < l_0, then cells of width l from l_0 on, each read as its middle."""

    __slots__ = ("dead_zone", "resolution", "step")

    def __init__(self, step: float, dead_zone: float) -> None:
        self.step = step
        self.dead_zone = dead_zone
        self.resolution = max(dead_zone, step / 2.0)

    def reset(self) -> None:
        """Do nothing: there is no memory."""

    def __call__(self, x: float) -> float:
        """Return 0 inside the dead zone, else the middle of the cell."""
        size = abs(x)
        if x == 0.0 or size < self.dead_zone:
            return 0.0
        cell = math.floor((size - self.dead_zone) / self.step)
        return math.copysign(self.dead_zone + self.step * (cell + 0.5), x)


class HysteresisUniform:
    """Levels s l of a state machine that moves only beyond its cell by the hysteresis h.

    Up at x >= (s + 1/2) l + h, down at x <= (s - 1/2) l - h. Free of the sign of dx, so it
    can be evaluated from samples. The first call runs the machine from level 0: the
    controller latches its answer, which already keeps the bound.
    """

    __slots__ = ("hysteresis", "level", "resolution", "step")

    def __init__(self, step: float, hysteresis: float) -> None:
        self.step = step
        self.hysteresis = hysteresis
        self.resolution = step / 2.0 + hysteresis
        self.level = 0

    def reset(self) -> None:
        """Return to level 0."""
        self.level = 0

    def __call__(self, x: float) -> float:
        """Move the machine until x lies inside its cell, then read the level."""
        step, hysteresis = self.step, self.hysteresis
        # The closed forms jump over many levels at once; the loops only repair their rounding.
        if x >= (self.level + 0.5) * step + hysteresis:
            self.level = max(self.level, math.floor((x - hysteresis) / step - 0.5))
            while x >= (self.level + 0.5) * step + hysteresis:
                self.level += 1
        elif x <= (self.level - 0.5) * step - hysteresis:
            self.level = min(self.level, math.ceil((x + hysteresis) / step + 0.5))
            while x <= (self.level - 0.5) * step - hysteresis:
                self.level -= 1
        return step * self.level


class LogarithmicUniform:
    """0 up to the minimum, logarithmic levels below the threshold, uniform cells above it.

    Levels u_1 = (1 + d) minimum and u_{k+1} = u_k (1+d)/(1-d), so that the error is at most
    d |x|; a logarithmic quantizer alone has no bound for all x.
    """

    __slots__ = ("density", "minimum", "ratio", "resolution", "step", "threshold")

    def __init__(self, minimum: float, density: float, threshold: float, step: float) -> None:
        self.minimum = minimum
        self.density = density
        self.threshold = threshold
        self.step = step
        self.ratio = (1.0 + density) / (1.0 - density)
        self.resolution = max(minimum, density * threshold, step / 2.0)

    def reset(self) -> None:
        """Do nothing: there is no memory."""

    def __call__(self, x: float) -> float:
        """Return the level of the cell that holds x."""
        size = abs(x)
        if size >= self.threshold:
            cell = math.floor((size - self.threshold) / self.step)
            return math.copysign(self.threshold + self.step * (cell + 0.5), x)
        if size <= self.minimum:
            return 0.0
        ratio = self.ratio
        count = math.ceil(math.log(size / self.minimum) / math.log(ratio)) - 1
        edge = self.minimum * ratio ** max(count, 0)
        # The logarithm may land one cell off: the cell is (edge, edge * ratio].
        if size > edge * ratio:
            edge *= ratio
        elif size <= edge:
            edge /= ratio
        return math.copysign(edge * (1.0 + self.density), x)


def make_quantizer(spec: QuantizerSpec) -> Quantizer:
    """Make the quantizer of a state, with its memory at the start.

    Parameters
    ----------
    spec : QuantizerSpec
        The kind and its keys as in the plant file [unit of the state].

    Returns
    -------
    Quantizer
        A callable; ``resolution`` is the delta_0 that the certificate assumes.

    References
    ----------
    docs/theory.md section 3; SPEC section 1, ``measurement.quantizer``.
    """
    if spec.kind is QuantizerKind.UNIFORM:
        # An absent dead zone is half a step: the plain rounding of (3).
        if spec.dead_zone is None:
            return Uniform(_number(spec.step))
        return DeadZoneUniform(_number(spec.step), _number(spec.dead_zone))
    if spec.kind is QuantizerKind.HYSTERESIS_UNIFORM:
        return HysteresisUniform(_number(spec.step), _number(spec.hysteresis))
    if spec.kind is QuantizerKind.LOGARITHMIC_UNIFORM:
        return LogarithmicUniform(
            _number(spec.minimum),
            _number(spec.density),
            _number(spec.threshold),
            _number(spec.step),
        )
    return Exact()


def _number(constant: Constant | None) -> float:
    """Nearest binary64 of a key that the quantizer's kind has."""
    if constant is None:
        raise ShapeError("measurement.quantizer: a key that its kind needs is missing")
    return constant.approximate
