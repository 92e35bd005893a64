"""What a method of comparison is: its gains with their ranges, its law, its operations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bfppc_synth.simulation.baselines.path import Path

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from bfppc_synth.simulation.baselines.arrays import Array

    # The path of the runs, the samples [s], the gains by name, each (1, C) -> the law before
    # its first sample.
    Build = Callable[[Path, Array, Mapping[str, Array]], "Law"]


class Law(Protocol):
    """A control law under way, for arrays of shape (R, C): R runs, C sets of gains."""

    def command(self, k: int, measured: Sequence[Array]) -> Array:
        """Return u at sample k; NaN or infinite where the law has no value."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tunable:
    """A number that the search chooses, uniformly in its logarithm."""

    name: str
    lower: float
    upper: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """One method, made for one plant.

    ``key`` names it in files, ``source`` says where its law is from, ``fixed`` what is not
    searched; ``missing`` says why the method cannot be used for this plant, and is empty where
    it can.
    """

    key: str
    title: str
    source: str
    fixed: str
    tunables: tuple[Tunable, ...]
    build: Build | None
    missing: str = ""


class _Counted(np.lib.mixins.NDArrayOperatorsMixin):
    """A number that counts what is done with it."""

    def __init__(self, value: Any, tally: list[str]) -> None:
        self.value, self._tally = value, tally

    def __array_ufunc__(self, ufunc: Any, way: str, *inputs: Any, **others: Any) -> _Counted:
        self._tally.append(ufunc.__name__)
        plain = [item.value if isinstance(item, _Counted) else item for item in inputs]
        return _Counted(getattr(ufunc, way)(*plain, **others), self._tally)

    def __array_function__(self, function: Any, types: Any, inputs: Any, others: Any) -> _Counted:
        del types
        self._tally.append(function.__name__)
        plain = [item.value if isinstance(item, _Counted) else item for item in inputs]
        return _Counted(function(*plain, **others), self._tally)

    def copy(self) -> _Counted:
        """Return itself: nothing changes it."""
        return self


def count_operations(method: Method, order: int) -> int | None:
    """Count the operations of one step of a method's law, the path r_1 given.

    Parameters
    ----------
    method : Method
        Its law is run on numbers that count.
    order : int
        Number of states n.

    Returns
    -------
    int | None
        Sums, products, quotients and function calls of the second step; None where the method
        has no law for the plant.
    """
    if method.build is None:
        return None
    tally: list[str] = []
    one = np.full((1, 1), 0.5)
    flat = np.full((2, 1), 0.5)
    path = Path(
        derivatives=np.full((order + 1, 2, 1), 0.5),
        y_d=flat,
        edge=flat,
        fade=np.full((2, max(1, order - 1)), 0.5),
        missing="",
    )
    chosen: Any = {item.name: _Counted(one, tally) for item in method.tunables}
    law = method.build(path, np.array([0.0, 1e-3]), chosen)
    states: Any = [_Counted(one, tally) for _ in range(order)]
    with np.errstate(all="ignore"):
        law.command(0, states)
        tally.clear()
        law.command(1, states)
    return len(tally)
