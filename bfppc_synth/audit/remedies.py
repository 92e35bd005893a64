"""Which number decides an inequality, and which value of it would do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from bfppc_synth.audit.judging import holds
from bfppc_synth.audit.records import Remedy
from bfppc_synth.audit.variants import C_0
from bfppc_synth.model.shapes import Theorem1Gain

if TYPE_CHECKING:
    from bfppc_synth.audit.judging import FormJudge, Judged
    from bfppc_synth.audit.records import Candidate
    from bfppc_synth.gains.methods.demands import Demand
    from bfppc_synth.model.shapes import Gain, Shape
    from bfppc_synth.model.spec import PlantSpec

# Looked for by factors of 4 up to 4^30 and down to 4^-30, then narrowed to 1e-9.
_FACTOR = 4.0
_REACH = 30
_NARROW = 60

Turn = Callable[["Candidate", float], "Candidate"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Knob:
    """A number of the file: its path, what the paper calls it, its value, and how it is set."""

    path: str
    symbol: str
    value: float
    turn: Turn


def remedies(
    judge: FormJudge,
    candidate: Candidate,
    judged: Judged,
    demand: Demand[float],
    spec: PlantSpec,
) -> tuple[Remedy, ...]:
    """Find the numbers that decide an inequality, the most telling one first.

    Parameters
    ----------
    judge : FormJudge
        The form that the inequality belongs to.
    candidate : Candidate
        What is audited.
    judged : Judged
        Its constants; the alternative stays the same while a number is turned.
    demand : Demand[float]
        One of ``judged.demands``.
    spec : PlantSpec
        For the paths.

    Returns
    -------
    tuple[Remedy, ...]
        At least one where a gain or half-width decides; where the first alone cannot satisfy
        the inequality, the others that were tried follow it up to one that can.
    """
    relation = judge.relation(demand)
    out: list[Remedy] = []
    if demand.name == "T1.c":
        # Its only left side: what (39) asks for is read off.
        path = c_0_path(spec)
        direct = demand.rhs if relation == ">=" else demand.rhs * (1.0 + 1e-9)
        out.append(Remedy(path=path, symbol="c_0", have=demand.lhs, need=direct))
        if holds(demand, relation):
            return tuple(out)
    for knob in knobs(candidate, demand, spec):

        def met(value: float, knob: Knob = knob) -> bool:
            found = judge.judge(knob.turn(candidate, value), judged.alternative)
            same = () if found is None else found.demands
            return any(
                holds(_read(demand, turned), relation)
                for turned in same
                if (turned.name, turned.step) == (demand.name, demand.step)
            )

        need = _nearest(met, knob.value, max(abs(demand.rhs), 1e-12))
        out.append(Remedy(path=knob.path, symbol=knob.symbol, have=knob.value, need=need))
        if need is not None:
            break
    return tuple(out)


def _read(before: Demand[float], turned: Demand[float]) -> Demand[float]:
    """Theorem 1 takes its numbers in an order: one side is read, the other stays as it stands.

    A larger gamma_1 also widens D_2 and leaves eps_2 negative; it must not count as met so.
    """
    if not before.name.startswith("T1"):
        return turned
    return turned if turned.lhs == before.lhs else replace(turned, rhs=before.rhs)


def c_0_path(spec: PlantSpec) -> str:
    """Where c_0 stands: in the file, else in p_2, whose printed formula leaves the rest to it."""
    known = dict(spec.places)
    room = f"synthesis.theorem1.epsilon.{spec.states[1]}" if spec.order > 1 else ""
    implied = C_0 not in known and room in known
    return f"synthesis.p.{spec.states[1]}" if implied else C_0


def knobs(candidate: Candidate, demand: Demand[float], spec: PlantSpec) -> tuple[Knob, ...]:
    """List the numbers that may decide an inequality, the most telling one first."""
    i, family = demand.step, demand.name.partition(".")[0]
    gain = candidate.gains[i]
    if demand.name == "T1.H":
        return (_gain_knob(candidate, i, "H", spec),)
    if demand.name == "T1.c":
        return (_gain_knob(candidate, i, "c", spec),)
    if demand.name in ("T1.gamma", "T1'.gamma"):
        return (_gain_knob(candidate, i, "gamma", spec), _gain_knob(candidate, i, "c", spec))
    if demand.name == "limit" or demand.name.startswith("T3.stage"):
        return ()
    width = _width_knob(candidate, i, spec)
    if family in ("U0", "T3") or demand.name in ("T1.p", "U2.room", "U2'.room"):
        return (width,)
    terms = sorted(_terms(gain, candidate.half_widths[i]), reverse=True)
    gains = [_gain_knob(candidate, i, name, spec) for share, name in terms if share > 0.0]
    return (*(gains or [_gain_knob(candidate, i, "k", spec)]), width)


def _terms(gain: Gain, p: float) -> list[tuple[float, str]]:
    """Bound what each term adds to phi_i(p_i)."""
    return [(gain.k * p, "k"), (gain.M, "M"), (gain.c * p**gain.N, "c")]


def _width_knob(candidate: Candidate, i: int, spec: PlantSpec) -> Knob:
    def turn(base: Candidate, value: float) -> Candidate:
        widths = base.half_widths
        return replace(base, half_widths=(*widths[:i], value, *widths[i + 1 :]))

    path = "performance.accuracy" if i == 0 else f"synthesis.p.{spec.states[i]}"
    return Knob(path=path, symbol=f"p_{i + 1}", value=candidate.half_widths[i], turn=turn)


def _gain_knob(candidate: Candidate, i: int, name: str, spec: PlantSpec) -> Knob:
    def turn(base: Candidate, value: float) -> Candidate:
        gains = base.gains
        return replace(base, gains=(*gains[:i], _set(gains[i], name, value), *gains[i + 1 :]))

    gain = candidate.gains[i]
    if name == "H" and isinstance(gain, Theorem1Gain):
        symbol = f"H_{i + 1}" if len(gain.H) == 1 else f"H_{i + 1}(1)"
        value = gain.height(1.0)
    else:
        symbol, value = f"{name}_{i + 1}", float(getattr(gain, name))
    return Knob(
        path=f"synthesis.gains.{spec.states[i]}.{name}", symbol=symbol, value=value, turn=turn
    )


def _set(gain: Gain, name: str, value: float) -> Gain:
    if not isinstance(gain, Theorem1Gain):
        return _set_shape(gain, name, value)
    if name == "gamma":
        return replace(gain, gamma=value)
    if name == "c":
        return replace(gain, c=value)
    height = gain.height(1.0)
    # A polynomial is scaled as a whole.
    return replace(gain, H=tuple(h * value / height for h in gain.H) if height else (value,))


def _set_shape(gain: Shape, name: str, value: float) -> Gain:
    match name:
        case "k":
            return replace(gain, k=value)
        case "M":
            return replace(gain, M=value)
    return replace(gain, c=value)


def _nearest(met: Callable[[float], bool], have: float, scale: float) -> float | None:
    """Value nearest to ``have`` that is met; where ``have`` is, the smallest one below it."""
    powers = [_FACTOR**k for k in range(1, _REACH + 1)]
    if met(have):
        if have == 0.0 or met(0.0):
            return 0.0
        last = have
        for power in powers:
            if not met(have / power):
                return _edge(met, last, have / power)
            last = have / power
        # Met however small: only 0 itself is not.
        return 0.0
    upward = (
        [have * power for power in powers]
        if have > 0.0
        else [scale * _FACTOR ** (k - _REACH // 2) for k in range(2 * _REACH)]
    )
    downward = [*(have / power for power in powers), 0.0] if have > 0.0 else []
    tried = have
    lower, below = have, None
    for value in downward:
        if met(value):
            below = _edge(met, value, lower)
            break
        lower = value
    for value in upward:
        if met(value):
            above = _edge(met, value, tried)
            # Of two the one that changes the number by the smaller factor.
            if below is not None and below > 0.0 and have / below < above / have:
                return below
            return above
        tried = value
    return below


def _edge(met: Callable[[float], bool], good: float, bad: float) -> float:
    """Narrow [good, bad] down to where the inequality begins to hold; the good end."""
    for _ in range(_NARROW):
        middle = 0.5 * (good + bad)
        if abs(good - bad) <= 1e-9 * max(abs(good), abs(bad)):
            break
        if met(middle):
            good = middle
        else:
            bad = middle
    return good
