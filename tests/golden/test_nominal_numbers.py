"""What center nominal reaches on the plants of docs/theory.md section 4, in floats."""

from dataclasses import replace
from pathlib import Path

import pytest

from bfppc_synth.gains.period import largest_period
from bfppc_synth.gains.problem import Weights
from bfppc_synth.gains.search import search
from bfppc_synth.gains.terms import explained, nominal_split
from bfppc_synth.spec import availability
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.nominal import prepare_nominal

PLANTS = Path(__file__).parents[1] / "plants"
PEAK_INPUT = Weights(peak_input=1.0, slope=0.01)
MARGIN = 2e-4
QUANTIZED = """measurement: {{noise: {{x1: 0.0001, x2: 0.001, x3: 0.001}}}}
sampling: {{period: {period}}}
synthesis:"""


@pytest.fixture(scope="module", autouse=True)
def center_to_come():
    """Open center nominal, which the plant file refuses until the checker proves it."""
    rows = tuple(row for row in availability.UNAVAILABLE if row.key != "center")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(availability, "UNAVAILABLE", rows)
        yield


def posed(path: Path, transition: float | None = None):
    problem, _ = prepare_nominal(load_spec(path), PEAK_INPUT, MARGIN, transition=transition)
    return problem


def solved(problem):
    found = search(problem, lambda _message: None)
    assert found is not None
    assert found.holds(MARGIN / 2)
    return found


# The prototype's numbers stand beside: termwise W_i with L_i E_i in place of B_i.
@pytest.mark.parametrize(
    ("name", "most", "feedforward", "prototype"),
    [
        ("motor_arm", 13.3, 9.4, 13.5),
        ("jerk", 12.25, 10.4, 12.4),
        ("flexible_joint", 122.5, 0.225, 280.0),
        ("joint_shared", 77.6, 0.225, 600.0),
        ("chain_of_four", 1.108, 1.001, 1.2),
    ],
)
def test_the_peak_input_is_at_most_what_was_measured(name, most, feedforward, prototype):
    problem = posed(PLANTS / f"nominal_{name}.yaml")
    found = solved(problem)
    assert found.bounds.U <= most < prototype
    assert problem.center.v <= feedforward
    assert problem.center.v <= found.bounds.U


@pytest.mark.parametrize(("period", "most"), [("0.0001", 13.95), ("0.0005", 20.25)])
def test_a_quantized_sampled_motor_arm_stays_practical(tmp_path, period, most):
    path = tmp_path / "plant.yaml"
    text = (PLANTS / "nominal_motor_arm.yaml").read_text()
    path.write_text(text.replace("synthesis:", QUANTIZED.format(period=period)))
    problem = posed(path)
    found = solved(problem)
    assert most >= found.bounds.U
    longest = largest_period(problem, found.shapes, found.half_widths)
    assert float(period) <= longest < 2.0 * float(period)


def test_a_free_transition_is_never_worse_than_a_given_one():
    path = PLANTS / "nominal_jerk.yaml"
    text = path.read_text()
    free = solved(choose(path, text))
    for transition in (0.5, 1.0, 2.0, 3.0, 5.0, 8.0):
        given = solved(posed(path, transition))
        assert free.cost <= given.cost + 1e-6


def choose(path: Path, text: str):
    spec = load_spec(path)
    assert "transition: 3" in text
    open_spec = replace(spec, performance=replace(spec.performance, transition=None))
    problem, _ = prepare_nominal(open_spec, PEAK_INPUT, MARGIN)
    assert problem.nominal is not None
    assert 3.0 < problem.nominal.model.transition < 6.0
    return problem


def test_a_short_transition_costs_feedforward():
    path = PLANTS / "nominal_jerk.yaml"
    sizes = [posed(path, transition).center.v for transition in (1.0, 2.0, 3.0)]
    assert sizes[0] > sizes[1] > sizes[2]


def test_uncertain_stiffness_costs_less_where_it_is_one_number():
    apart = solved(posed(PLANTS / "nominal_flexible_joint.yaml"))
    shared = solved(posed(PLANTS / "nominal_joint_shared.yaml"))
    assert shared.bounds.U < apart.bounds.U


def test_levitation_keeps_its_authority_around_a_nominal_center():
    found = solved(posed(PLANTS / "nominal_levitation.yaml"))
    assert found.bounds.U <= 16.5
    assert min(found.bounds.g_min) > 0.0


def test_the_split_adds_up():
    problem = posed(PLANTS / "nominal_joint_shared.yaml")
    found = solved(problem)
    split = nominal_split(problem, found)
    assert split is not None
    total = split.feedforward + split.tube + split.actuator_error
    assert total == pytest.approx(found.bounds.U)
    for step, (terms, alone) in enumerate(zip(split.disturbance, split.parameters, strict=True)):
        assert sum(size for _, size in terms) == pytest.approx(found.bounds.W[step])
        joint = dict(terms).get("model error along the center", 0.0)
        assert joint <= sum(size for _, size in alone) * (1.0 + 1e-9)
        assert joint >= max((size for _, size in alone), default=0.0) * (1.0 - 1e-9)
        shares = explained(problem, found, step)
        assert sum(share for _, share in shares) == pytest.approx(1.0)
    assert [name for name, _ in split.parameters[3]] == ["stiffness", "friction", "motor"]
