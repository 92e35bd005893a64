"""Center nominal is posed with what it needs, refused where it cannot be, and searched over T_s."""

import pytest

from bfppc_synth.errors import NoDesignError, PlantFileError
from bfppc_synth.gains.diagnose import no_design
from bfppc_synth.gains.problem import Weights
from bfppc_synth.gains.search import search
from bfppc_synth.gains.terms import explained, nominal_split, sources
from bfppc_synth.spec import availability
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.nominal import prepare_nominal
from bfppc_synth.synthesis.prepare import prepare

PEAK_INPUT = Weights(peak_input=1.0, slope=0.01)
MARGIN = 2e-4
TEMPLATE = """name: plant
parameters: {{a: [0.9, 1.1]}}
states: [x1, x2]
dynamics:
  x1: {{f: 0, g: {g}}}
  x2: {{f: "{f}", g: 2}}
reference: {reference}
initial: {{x1: {start}, x2: 0}}
performance: {{accuracy: 0.05{transition}}}
actuator: {{limit: {limit}}}
synthesis: {{center: {center}{more}}}
"""


@pytest.fixture(scope="module", autouse=True)
def center_to_come():
    """Open center nominal, which the plant file refuses until the checker proves it."""
    rows = tuple(row for row in availability.UNAVAILABLE if row.key != "center")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(availability, "UNAVAILABLE", rows)
        yield


@pytest.fixture
def spec_of(tmp_path):
    def make(**changes):
        given = {
            "g": "1",
            "f": "-a*sin(x1)",
            "start": "0.3",
            "reference": "sin(t)",
            "transition": ", transition: 2",
            "limit": "100",
            "center": "nominal",
            "more": "",
        }
        path = tmp_path / "plant.yaml"
        path.write_text(TEMPLATE.format(**(given | changes)))
        return load_spec(path)

    return make


def posed(spec, **changes):
    problem, _ = prepare_nominal(spec, PEAK_INPUT, MARGIN, **changes)
    return problem


def solved(problem):
    found = search(problem, lambda _message: None)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("changes", "path", "message"),
    [
        ({"more": ", method: theorem2"}, "synthesis.center", "theorem2 is proved for center perf"),
        ({"more": ", anchor: exact"}, "synthesis.anchor", "starts from what is measured"),
        (
            {"reference": "{value: sin(t), bound: 1, rate: 1}"},
            "reference",
            "bounds on the reference and its first 3 derivatives, and the file dec",
        ),
        (
            {"reference": "{bounds: [1, 1, 1]}"},
            "reference.bounds",
            "first 3 derivatives, 4 in all, and there are 3",
        ),
        ({"reference": "t"}, "reference", "cannot be enclosed over all t >= 0"),
        (
            {"reference": "0.1*(sin(t) + sin(sqrt(2)*t) + sin(sqrt(3)*t) + sin(pi*t))"},
            "reference",
            "does not settle on a periodic signal",
        ),
        ({"reference": "abs(sin(t))"}, "reference", "has a kink or a jump"),
        ({"g": '"2 + min(x1, 1)"'}, "dynamics.x1.g", "has a kink, a jump or an odd root"),
        ({"g": "2 + abs(x1)"}, "synthesis.center", "has a kink where x1 is 0"),
        ({"g": "0.5 + x1"}, "dynamics.x1.g", "may be 0 along the center"),
        ({"f": "1/(x1 - 0.6)"}, "dynamics.x2.f", "may be 0 along the center"),
        ({"f": "log(x1)"}, "dynamics.x2.f", "the argument of a logarithm may be 0"),
        # e^1000 is no number; e^300, which is one, has powers that are none.
        ({"f": "exp(1000*x1)"}, "dynamics.x2.f", "along the center u would reach inf"),
        ({"f": "exp(300*x1)"}, "dynamics.x2.f", "along the center u would reach 9.7"),
        ({"reference": "1e120*sin(t)"}, "reference", "along the center x1 would reach 1e+120"),
        ({"start": "1e150"}, "initial.x1", "1e+150 is beyond 1e+100"),
        ({"start": "1e15"}, "performance.accuracy", "one unit in the last place of a x1 of 1e+15"),
    ],
)
def test_what_center_nominal_cannot_take_is_refused_at_its_place(spec_of, changes, path, message):
    with pytest.raises(PlantFileError) as caught:
        posed(spec_of(**changes))
    (mistake,) = caught.value.mistakes
    assert mistake.path == path
    assert message in mistake.message
    assert mistake.fix


@pytest.mark.parametrize(
    "changes",
    [
        {"f": "1/(x1 - 1.2)"},
        {"f": "exp(100*x1)"},
        {"start": "1e12"},
        {"reference": "0.2*sin(sin(t))"},
        {"reference": "0.1*(sin(t) + sin(sqrt(2)*t) + sin(sqrt(3)*t))"},
    ],
)
def test_what_comes_close_is_taken(spec_of, changes):
    problem = posed(spec_of(**changes))
    assert problem.center.v < 1e100


@pytest.mark.parametrize(
    "changes",
    [{}, {"reference": "{bounds: [1, 1, 1, 1]}"}, {"g": "1.5 + 0.5*sin(x1)"}],
    ids=["known", "at run time", "gain"],
)
def test_a_nominal_problem_has_a_design(spec_of, changes):
    problem = posed(spec_of(**changes))
    found = solved(problem)
    assert found.holds(MARGIN / 2)
    assert problem.center.v < found.bounds.U < 20.0


def test_the_nominal_center_needs_less_input_than_the_papers(spec_of):
    performance, _ = prepare(spec_of(center="performance"))
    assert solved(posed(spec_of())).bounds.U < 0.2 * solved(performance).bounds.U


def test_only_a_nominal_problem_has_a_split(spec_of):
    performance, _ = prepare(spec_of(center="performance"))
    found = solved(performance)
    assert nominal_split(performance, found) is None
    assert sources(performance, found.bounds, 0) == ()
    names = [name for name, _ in explained(performance, found, 1)]
    assert "|d alpha_1|" in names
    assert "sup|dr_2|" not in names


def test_the_terms_of_a_nominal_step_name_their_source(spec_of):
    problem = posed(spec_of())
    names = {name for name, _ in explained(problem, solved(problem), 1)}
    assert names == {"model error along the center", "deviation of x1", "|d alpha_1|"}


def test_a_given_transition_is_kept_and_one_read_back_wins(spec_of):
    assert posed(spec_of()).nominal.model.transition == 2.0
    assert posed(spec_of(), transition=0.75).nominal.model.transition == 0.75


def test_a_free_transition_beats_every_given_one(spec_of):
    free = posed(spec_of(transition=""))
    cost = solved(free).cost
    for transition in (0.3, 0.7, 1.5, 3.0, 7.0):
        assert cost <= solved(posed(spec_of(), transition=transition)).cost + 1e-6


def test_a_transition_is_chosen_even_where_the_limit_leaves_no_design(spec_of):
    problem = posed(spec_of(transition="", limit="0.3"))
    assert search(problem, lambda _message: None) is None
    error = no_design(problem, free=True)
    assert isinstance(error, NoDesignError)
    assert "above actuator.limit 0.3" in str(error)
    assert "what drives it" in str(error)


def test_a_long_transition_is_preferred_where_the_feedforward_of_a_short_one_breaks_the_limit(
    spec_of,
):
    problem = posed(spec_of(transition="", limit="2"))
    found = solved(problem)
    assert problem.nominal.model.transition > 0.5
    assert found.bounds.U <= 2.0
    assert search(posed(spec_of(limit="2"), transition=0.2), lambda _message: None) is None


def test_gains_that_are_all_given_get_the_transition_that_leaves_them_most_room(spec_of):
    found = solved(posed(spec_of(), transition=3.0))
    gains = ", ".join(
        f"x{i}: {{k: {g.k + 1e-9!r}, M: {g.M!r}, epsilon: {g.epsilon!r}, c: {g.c!r}}}"
        for i, g in enumerate(found.shapes, start=1)
    )
    more = f", gains: {{{gains}}}, p: {{x2: {found.half_widths[1]!r}}}"
    judged = solved(posed(spec_of(transition="", more=more)))
    for transition in (0.5, 1.0, 3.0, 8.0):
        given = solved(posed(spec_of(more=more), transition=transition))
        assert judged.shortfall <= given.shortfall + 1e-9
