"""Units of the states do not matter: x_i replaced by s_i x_i gives the same design times s_i."""

from __future__ import annotations

import json
import os
import random
import re
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from bfppc_synth.gains.search import search
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.spec.load import load_text
from bfppc_synth.synthesis.prepare import prepare
from bfppc_synth.synthesis.proof import proved

ROOT = Path(__file__).parents[2]
EVERY = os.environ.get("BFPPC_TESTS") == "all"
EXAMPLES = ("paper_example_2", "van_der_pol", "compressor_surge", "cart_pendulum", "motor_arm")
SERVO = """\
name: servo
states: [x1, x2, x3]
parameters: {A: 3.35e-4, alpha: 4.515e13}
dynamics:
  x1: {f: 0}
  x2: {f: (-16010*x1 - 310*x2)/24, g: A/24}
  x3:
    f: -alpha*A*x2 - x3
    g_min: 1.545e9*sqrt(10342500 - Abs(x3))
    g_bound: 1.545e9*sqrt(10342500 + Abs(x3))
reference: 0.01*sin(t)
initial: {x1: 0, x2: 0, x3: 0}
performance: {accuracy: 0.001}
sampling: {period: 1e-7}
synthesis: {center: performance}
"""


def times(scale: float, text: object) -> str:
    return f"{scale!r}*({text})"


def scaled_copy(source: str, scales: list[float]) -> str:
    """Write the plant of s_i x_i and s_u u; ``scales`` are s_1..s_n and s_u."""
    plant = YAML(typ="safe", pure=True).load(source)
    states = plant["states"]
    size = dict(zip(states, scales, strict=False))

    def own(text: object) -> str:
        names = "|".join(states)
        return re.sub(rf"\b({names})\b", lambda m: f"({m[1]}/{size[m[1]]!r})", str(text))

    for state, s, ahead in zip(states, scales, scales[1:], strict=False):
        channel = plant["dynamics"][state]
        ratio = s / ahead
        if not {"g", "g_min", "g_bound"} & set(channel):
            channel["g"] = 1
        for key in channel:
            factor = ratio if key in ("g", "g_min", "g_bound") else s
            channel[key] = times(factor, own(channel[key]))
        plant["initial"][state] = times(s, plant["initial"][state])
    plant["reference"] = times(scales[0], plant.get("reference", 0))
    plant["performance"]["accuracy"] *= scales[0]
    text = json.dumps(plant)
    # A number that has to be computed is no quoted one.
    return re.sub(r'"(initial)": \{([^}]*)\}', lambda m: m[0].replace('"', ""), text)


def designed(source: str):
    problem, _ = prepare(load_text(source, "copy.yaml"))
    found = search(problem, lambda _message: None)
    assert found is not None
    return problem, found


def cases():
    rng = random.Random(7)  # noqa: S311 -- scales, no secrets
    names = (*EXAMPLES, "servo")
    for name in names if EVERY else ("van_der_pol", "servo"):
        for _ in range(6 if EVERY else 1):
            yield name, [10.0 ** rng.uniform(-6.0, 7.0) for _ in range(4)]


@pytest.mark.parametrize(("name", "scales"), list(cases()))
def test_a_copy_in_other_units_has_the_same_design(name, scales):
    path = ROOT / "examples" / f"{name}.yaml"
    source = SERVO if name == "servo" else path.read_text(encoding="utf-8")
    _, first = designed(source)
    order = len(first.half_widths)
    scales = scales[: order + 1]
    problem, second = designed(scaled_copy(source, scales))
    widths = [p / s for p, s in zip(second.half_widths, scales, strict=False)]
    assert widths == pytest.approx(first.half_widths, rel=0.01)
    assert second.bounds.U / scales[-1] == pytest.approx(first.bounds.U, rel=0.01)
    for one, other in zip(first.demands, second.demands, strict=True):
        assert other.lhs * one.rhs == pytest.approx(other.rhs * one.lhs, rel=0.01)
    # A declared bound that touches what it bounds is proved where the factors are exact only.
    touching = tuple(f"{key}[" for key in ("f_bound", "g_bound", "g_min"))
    failures = proved(problem, second).failures
    assert [line for line in failures if not line.startswith(touching)] == []


def chain(order: int) -> str:
    """A chain whose terms couple every state to the first one."""
    lines = [f"name: chain_{order}", f"states: [{', '.join(f'x{i + 1}' for i in range(order))}]"]
    lines.append("dynamics:")
    for i in range(1, order + 1):
        drift = f"0.2*sin(x{i})" + (f" + 0.1*x1*x{i}" if i > 1 else "")
        lines.append(f"  x{i}: {{f: {drift}, g: 1.5 + 0.5*cos(x1)}}")
    starts = ", ".join(f"x{i + 1}: {0.1 if i == 0 else 0}" for i in range(order))
    lines.append(f"initial: {{{starts}}}")
    lines.append("performance: {accuracy: 0.2}\nsynthesis: {center: performance}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("order", range(3, 11) if EVERY else (10,))
def test_a_chain_of_up_to_ten_states_is_certified(order):
    problem, found = designed(chain(order))
    assert found.bounds.U > 0.0
    assert proved(problem, found).verdict is Verdict.CERTIFIED
