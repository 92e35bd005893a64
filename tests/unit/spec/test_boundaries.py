"""Both sides of every boundary that the file's own numbers have."""

import pytest

from bfppc_synth.errors import PlantFileError
from bfppc_synth.spec.load import load_spec

BASE = """\
name: plant
states: [x1, x2]
dynamics: {x1: {f: 0}, x2: {f: 0}}
initial: {x1: 1, x2: 0}
"""
PERFORMANCE = "performance: {accuracy: 0.15}\n"


@pytest.fixture
def read(tmp_path):
    def run(text):
        path = tmp_path / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        return load_spec(path)

    return run


UNIFORM = "measurement: {quantizer: {kind: uniform, step: STEP}}"
HYSTERESIS = "measurement: {quantizer: {kind: hysteresis-uniform, step: 0.1, hysteresis: H}}"
LOGARITHMIC = (
    "measurement: {quantizer: {kind: logarithmic-uniform, minimum: 0.01, density: D, "
    "threshold: 0.5, step: 0.01}}"
)


@pytest.mark.parametrize(
    ("accepted", "refused"),
    [
        (UNIFORM.replace("STEP", "0.299"), UNIFORM.replace("STEP", "0.3")),
        (
            UNIFORM.replace("STEP", "0.1, dead_zone: 0.149"),
            UNIFORM.replace("STEP", "0.1, dead_zone: 0.15"),
        ),
        (HYSTERESIS.replace("H}", "0.05}"), HYSTERESIS.replace("H}", "0.051}")),
        (LOGARITHMIC.replace("D,", "0.29,"), LOGARITHMIC.replace("D,", "0.3,")),
        ("measurement: {noise: 0.149}", "measurement: {noise: 0.15}"),
        (
            "measurement: {noise: 0.074}\nsynthesis: {anchor: exact}",
            "measurement: {noise: 0.075}\nsynthesis: {anchor: exact}",
        ),
        ("synthesis: {gains: {x1: {N: 31}}}", "synthesis: {gains: {x1: {N: 33}}}"),
        ("synthesis: {gains: {x1: {c: 0}}}", "synthesis: {gains: {x1: {epsilon: 0}}}"),
        (
            "synthesis: {method: theorem2, form: printed}",
            "synthesis: {method: unified, form: printed}",
        ),
        (
            "synthesis: {method: theorem2}\nsampling: {period: 0}",
            "synthesis: {method: theorem2}\nsampling: {period: 1e-9}",
        ),
        (
            "synthesis: {method: theorem2}\nmeasurement: {quantizer: {kind: none}}",
            "synthesis: {method: theorem2}\nmeasurement: {quantizer: {kind: uniform, step: 1e-6}}",
        ),
        ("actuator: {limit: 1, error: 0.999}", "actuator: {limit: 1, error: 1}"),
        ("simulation: {horizon: 5, period: 1e-7}", "simulation: {horizon: 5.1, period: 1e-7}"),
        ("simulation: {horizon: 1, period: 1}", "simulation: {horizon: 1, period: 1.01}"),
        ("parameters: {a: [1, 1]}", "parameters: {a: [1.01, 1]}"),
        ("reference: {value: 1, bound: 1, rate: 0}", "reference: {value: 1, bound: 0.9, rate: 0}"),
        ("reference: {bounds: [0, 0]}", "reference: {bounds: [0]}"),
    ],
)
def test_a_number_is_accepted_on_one_side_and_refused_on_the_other(read, accepted, refused):
    assert read(BASE + PERFORMANCE + accepted + "\n")
    with pytest.raises(PlantFileError):
        read(BASE + PERFORMANCE + refused + "\n")


@pytest.mark.parametrize(
    ("accepted", "refused"),
    [
        ("{kind: cosine, t_s: 1, rate_bound: 0.5}", "{kind: cosine, t_s: 1, rate_bound: 0.4999}"),
        ("{kind: cosine, t_s: pi, rate_bound: 0.16}", "{kind: cosine, t_s: pi, rate_bound: 0.159}"),
        (
            "{kind: exponential, rate: 2, floor: 0.5, rate_bound: 1}",
            "{kind: exponential, rate: 2, floor: 0.5, rate_bound: 0.99}",
        ),
        ("{kind: exponential, rate: 1, floor: 0.99}", "{kind: exponential, rate: 1, floor: 1}"),
        ("{kind: exponential, rate: 1e-9}", "{kind: exponential, rate: 0}"),
    ],
)
def test_a_performance_function_is_judged_on_both_sides(read, accepted, refused):
    for rho, good in ((accepted, True), (refused, False)):
        text = f"{BASE}performance: {{accuracy: 0.15, rho: {rho}}}\n"
        if good:
            assert read(text)
        else:
            with pytest.raises(PlantFileError):
                read(text)


@pytest.mark.parametrize(
    ("accepted", "refused"),
    [
        ("f: 0, g_bound: 2, g_min: 1", "f: 0, g_bound: 2"),
        ("f: 0, g_bound: 2, g_min: 2", "f: 0, g_bound: 2, g_min: 2.1"),
        ("f: 0, g: 2, g_bound: 2", "f: 0, g: 2, g_bound: 1.9"),
        ("f: 0, g: 1e-9", "f: 0, g: -1e-9"),
        ("f: -2, f_bound: 2", "f: -2, f_bound: 1.9"),
        ("f_bound: 0", "f_bound: -0.1"),
        ("f_bound: x1", "g: x1"),
        ("f: 0, disturbance: 0", "f: 0, disturbance: -0.1"),
        ("f: a*x1", "f: a*x2"),
    ],
)
def test_a_channel_is_judged_on_both_sides(read, accepted, refused):
    def text(channel):
        return BASE.replace("x1: {f: 0}", f"x1: {{{channel}}}") + PERFORMANCE + "parameters: {a: 1}"

    assert read(text(accepted))
    with pytest.raises(PlantFileError):
        read(text(refused))


@pytest.mark.parametrize(("count", "good"), [(1, True), (12, True), (13, False)])
def test_one_to_twelve_states_are_read(read, count, good):
    names = [f"x{index}" for index in range(1, count + 1)]
    text = (
        f"name: chain\nstates: [{', '.join(names)}]\n"
        f"dynamics: {{{', '.join(f'{name}: {{f: 0}}' for name in names)}}}\n"
        f"initial: {{{', '.join(f'{name}: 0' for name in names)}}}\n{PERFORMANCE}"
    )
    if good:
        assert read(text).order == count
    else:
        with pytest.raises(PlantFileError, match="13 states where 1 to 12"):
            read(text)
