"""One mistake at a time: where it is, what is said about it, what to do."""

import pytest

from bfppc_synth.errors import PlantFileError
from bfppc_synth.spec.load import load_spec

GOOD = """\
name: plant
states: [x1, x2]
parameters: {a: 0.5}
dynamics:
  x1: {f: a*x1, g: 2}
  x2:
    f: x1*x2
initial: {x1: 1, x2: [-1, 1]}
performance:
  accuracy: 0.15
"""


@pytest.fixture
def read(tmp_path):
    def run(text):
        path = tmp_path / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        return load_spec(path)

    return run


@pytest.fixture
def mistakes(read):
    def run(text):
        with pytest.raises(PlantFileError) as caught:
            read(text)
        return caught.value.mistakes

    return run


def test_an_accuracy_of_weight_zero_is_still_asked_for(mistakes):
    text = GOOD.replace("  accuracy: 0.15\n", "  rho: {kind: cosine, t_s: 1}\n")
    found = mistakes(text + "synthesis: {objective: {accuracy: 0, slope: 1}}\n")
    assert len(found) == 1
    assert "accuracy is missing" in found[0].message


def test_an_accuracy_that_is_searched_for_need_not_be_given(read):
    text = GOOD.replace("  accuracy: 0.15\n", "  rho: {kind: cosine, t_s: 1}\n")
    spec = read(text + "actuator: {limit: 9}\nsynthesis: {objective: accuracy}\n")
    assert spec.performance.accuracy is None
    assert not any("upper limit" in note for note in spec.notes)


def test_the_file_that_every_case_spoils_is_good(read):
    assert read(GOOD).states == ("x1", "x2")


SPOILED = [
    # what is replaced, by what, line:column:length, path, message, fix
    ("name: plant", "name: Plant", "1:7:5", "name", "1 to 24 small letters", "my_plant"),
    ("name: plant", "name: " + "a" * 25, "1:7:25", "name", "1 to 24", "prefix"),
    ("name: plant", "name: double", "1:7:6", "name", "C or Python", "double_plant"),
    ("name: plant", "name: math", "1:7:4", "name", "math.h", "math_plant"),
    ("name: plant\n", "", "1:1:1", "", "key name is missing", "add `name:`"),
    ("name: plant", "name:", "1:1:4", "name", "no value", "give one"),
    ("name: plant", "name: plant\nmame: x", "2:1:4", "mame", "unknown key", "did you mean name?"),
    ("name: plant", "name: plant\nname: plant", "2:1:4", "name", "first in line 1", "keep one"),
    ("name: plant", "name: plant\ntitle: a */ b", "2:8:6", "title", "comments", "plain text"),
    ("name: plant", "name: plant\nunits: {x3: m}", "2:9:2", "units.x3", "unknown key", "x1"),
    ("[x1, x2]", "x1", "2:9:2", "states", "a list of names", "[x1, x2]"),
    ("[x1, x2]", "[]", "2:9:2", "states", "0 states", ""),
    ("[x1, x2]", "[x1, x1]", "2:14:2", "states", "named twice", "once"),
    ("[x1, x2]", "[x1, 2x]", "2:14:2", "states", "2x is no name", "rename"),
    ("[x1, x2]", "[x1, t]", "2:14:1", "states", "t is reserved", "t_1"),
    ("[x1, x2]", "[x1, for]", "2:14:3", "states", "for is reserved", "rename"),
    ("{a: 0.5}", "{x1: 0.5}", "3:14:2", "parameters.x1", "a state already", "rename"),
    ("{a: 0.5}", "{a: 0.5, sin: 1}", "3:22:3", "parameters.sin", "reserved", "sin_1"),
    ("{a: 0.5}", "{a: '0.5'}", "3:17:5", "parameters.a", "quoted text", "remove the quotes"),
    ("{a: 0.5}", "{a: true}", "3:17:4", "parameters.a", "truth value", ""),
    ("{a: 0.5}", "{a: .nan}", "3:17:4", "parameters.a", "not finite", ""),
    ("{a: 0.5}", "{a: -.inf}", "3:17:5", "parameters.a", "not finite", ""),
    ("{a: 0.5}", "{a: inf}", "3:17:3", "parameters.a", "not finite", ""),
    ("{a: 0.5}", "{a: }", "3:14:1", "parameters.a", "no value", ""),
    ("{a: 0.5}", "{a: 0x10}", "3:18:3", "parameters.a", "operator is missing", "0*x10"),
    ("{a: 0.5}", "{a: 010}", "3:17:3", "parameters.a", "begins with 0", "write 10"),
    ("{a: 0.5}", "{a: 12:30:45}", "3:19:1", "parameters.a", "no place", ""),
    ("{a: 0.5}", "{a: 1e-9999999}", "3:17:10", "parameters.a", "outside", "units"),
    ("{a: 0.5}", "{a: 2*b}", "3:19:1", "parameters.a", "unknown name `b`", ""),
    ("{a: 0.5}", "{a: [2, 1]}", "3:17:6", "parameters.a", "2 is above the upper end 1", "[1, 2]"),
    ("{a: 0.5}", "{a: [1]}", "3:17:3", "parameters.a", "1 numbers where [lower, upper]", ""),
    ("{a: 0.5}", "{a: {b: 1}}", "3:17:6", "parameters.a", "a mapping where a number", ""),
    ("f: a*x1", "f: a*x1*x2", "5:16:2", "dynamics.x1.f", "x2 is a later state", "through g"),
    ("f: a*x1", "f: aa*x1", "5:11:2", "dynamics.x1.f", "unknown name `aa`", "did you mean `a`?"),
    ("f: a*x1", "f: sin(t)", "5:15:1", "dynamics.x1.f", "t has no place", "disturbance"),
    ("f: a*x1", "f: u", "5:11:1", "dynamics.x1.f", "last state only", ""),
    ("f: a*x1", "f: y_d", "5:11:3", "dynamics.x1.f", "reference", ""),
    ("f: a*x1", "f: __import__(x1)", "5:11:10", "dynamics.x1.f", "unknown function", ""),
    ("f: a*x1", "f: 9**9**9", "5:14:4", "dynamics.x1.f", "beyond 64", ""),
    ("f: a*x1", "f: 1/0", "5:11:3", "dynamics.x1.f", "division by zero", ""),
    ("f: a*x1", "f: log(-1)", "5:11:7", "dynamics.x1.f", "log of a negative", ""),
    ("f: a*x1", "f: true", "5:11:4", "dynamics.x1.f", "truth value", ""),
    ("f: a*x1", "f: nan", "5:11:3", "dynamics.x1.f", "not finite", ""),
    ("f: a*x1", "f: [x1]", "5:11:4", "dynamics.x1.f", "a list where an expression", ""),
    ("f: a*x1", "f: 'a*x1 + x9'", "5:19:2", "dynamics.x1.f", "unknown name `x9`", ""),
    (
        "f: a*x1",
        "f: Min(x1, 2)",
        "5:11:6",
        "dynamics.x1.f",
        "a comma ends the value, so only `Min(x1`",
        'quote the expression: f: "Min(x1, 2)"',
    ),
    (
        "f: a*x1",
        "f: Piecewise((x1, x1 < 0), (0, True))",
        "5:11:13",
        "dynamics.x1.f",
        "comma",
        'quote the expression: f: "Piecewise((x1, x1 < 0), (0, True))"',
    ),
    ("[-1, 1]", "[min(0, 1), 1]", "8:23:5", "initial.x2", "comma", 'quote the expression: "min(0'),
    ("f: a*x1, ", "", "5:7:6", "dynamics.x1", "neither f nor f_bound", "f_bound"),
    ("f: a*x1", "f: 2, f_bound: 1", "5:23:1", "dynamics.x1.f_bound", "f = 2", "at least 2"),
    ("f: a*x1", "f_bound: -1", "5:17:2", "dynamics.x1.f_bound", "negative", "0 or above"),
    ("g: 2", "g: -1", "5:20:2", "dynamics.x1.g", "g = -1 is negative", "by its negative"),
    ("g: 2", "g: 0", "5:20:1", "dynamics.x1.g", "not above 0", "positive"),
    ("g: 2", "g_bound: 2", "5:26:1", "dynamics.x1.g_bound", "g_min is needed", "add g_min"),
    ("g: 2", "g_min: 2", "5:24:1", "dynamics.x1.g_min", "g_bound is needed", "add g_bound"),
    ("g: 2", "g: 2, g_min: 3", "5:30:1", "dynamics.x1.g_min", "3 is above g = 2", ""),
    ("g: 2", "g: 2, g_bound: 1", "5:20:1", "dynamics.x1.g", "2 is above g_bound = 1", ""),
    ("g: 2", "g: 2, g_min: 0", "5:30:1", "dynamics.x1.g_min", "not above 0", ""),
    ("g: 2", "g: 2, disturbance: -1", "5:36:2", "dynamics.x1.disturbance", "negative", ""),
    ("g: 2", "h: 2", "5:17:1", "dynamics.x1.h", "unknown key", ""),
    ("    f: x1*x2\n", "    f: x1*x2\n  x3: {f: 0}\n", "8:3:2", "dynamics.x3", "no such state", ""),
    ("  x2:\n    f: x1*x2\n", "", "5:3:1", "dynamics", "state x2 is missing", "add `x2:`"),
    ("x1: 1, ", "", "8:10:1", "initial", "state x1 is missing", "add `x1:`"),
    ("x1: 1,", "x1: 1, x3: 1,", "8:18:2", "initial.x3", "no such state", "x2"),
    ("x1: 1,", "x1: 1, offset: 1,", "8:26:1", "initial.offset", "run-time", "bounds"),
    ("x1: 1,", "x1: '1',", "8:15:3", "initial.x1", "quoted", "quotes"),
    ("accuracy: 0.15", "acuracy: 0.15", "10:3:1", "performance", "accuracy is missing", "p_1"),
    ("accuracy: 0.15", "accuracy: 0", "10:13:1", "performance.accuracy", "above 0", ""),
    ("accuracy: 0.15", "accuracy: -1", "10:13:2", "performance.accuracy", "above 0", ""),
    ("accuracy: 0.15", "accuracy: 1,5", "10:14:1", "performance.accuracy", "comma", ""),
]


@pytest.mark.parametrize(("old", "new", "place", "path", "message", "fix"), SPOILED)
def test_a_mistake_has_its_place_its_sentence_and_its_cure(
    mistakes, old, new, place, path, message, fix
):
    assert GOOD.count(old) == 1
    found = mistakes(GOOD.replace(old, new))
    assert any(
        f"{item.line}:{item.column}:{item.length}" == place
        and item.path == path
        and message in item.message
        and fix in item.fix
        for item in found
    ), found


LOGARITHMIC = """\
measurement: {quantizer: {kind: logarithmic-uniform, minimum: 0.2, density: 0.1, \
threshold: 0.1, step: 0.01}}"""
ADDED = [
    # lines behind the good file (from line 11), place, path, message, fix
    ("  rho: {kind: cosine}", "11:8:14", "performance.rho", "t_s is missing", "add t_s"),
    ("  rho: {t_s: 1}", "11:8:1", "performance.rho", "kind is missing", "add `kind:`"),
    ("  rho: {kind: cos, t_s: 1}", "11:15:3", "performance.rho.kind", "one of cosine", "cosine?"),
    (
        "  rho: {kind: cosine, t_s: 1, rate_bound: 0.49}",
        "11:43:4",
        "performance.rho.rate_bound",
        "0.49 is below the true rate 1/(2 t_s) = 0.5",
        "at least 0.5",
    ),
    (
        "  rho: {kind: exponential, rate: 2, floor: 0.5, rate_bound: 0.9}",
        "11:61:3",
        "performance.rho.rate_bound",
        "0.9 is below the true rate (1 - floor) rate = 1",
        "at least 1",
    ),
    (
        "  rho: {kind: exponential, rate: 1, floor: 1}",
        "11:44:1",
        "performance.rho.floor",
        "from 0 to below 1",
        "",
    ),
    (
        "  rho: {kind: exponential, rate: 1, t_s: 1}",
        "11:42:1",
        "performance.rho.t_s",
        "does not belong to kind exponential",
        "remove",
    ),
    ("  rho: {x1: {kind: cosine, t_s: 1}}", "11:8:1", "performance.rho", "x2 is missing", "x2"),
    ("  rho: [{kind: cosine, t_s: 1}]", "11:8:24", "performance.rho", "1 entries for 2 states", ""),
    ("  funnel: 2 + x1", "11:15:2", "performance.funnel", "t alone", ""),
    ("reference: sin(x1)", "11:16:2", "reference", "t alone", "number"),
    ("reference: {value: 0, bound: 1}", "11:12:1", "reference", "rate is missing", ""),
    ("reference: {bounds: [1]}", "11:21:3", "reference.bounds", "at least 2", ""),
    ("reference: {bounds: [1, -1]}", "11:25:2", "reference.bounds", "0 or above", ""),
    ("reference: {bonds: [1, 1]}", "11:13:5", "reference.bonds", "unknown key", "bound"),
    (
        "reference: {value: -2, bound: 1, rate: 0}",
        "11:31:1",
        "reference.bound",
        "1 is below abs(y_d), y_d = -2",
        "at least 2",
    ),
    (
        "measurement: {quantizer: {kind: uniform, step: 0.3}}",
        "10:13:4",
        "performance.accuracy",
        "0.15 is equal to the resolution of x1, 0.15 (quantizer step 0.3)",
        "choose an accuracy above 0.15, or a quantizer step below 0.3",
    ),
    (
        "measurement: {noise: 0.2}",
        "10:13:4",
        "performance.accuracy",
        "0.15 is below the resolution of x1, 0.2 (noise 0.2)",
        "above 0.2",
    ),
    (
        "measurement: {noise: {x1: 0.08, x2: 0}}\nsynthesis: {anchor: exact}",
        "10:13:4",
        "performance.accuracy",
        "below twice the resolution of x1, 0.16",
        "above 0.16",
    ),
    (
        "measurement: {quantizer: {kind: uniform}}",
        "11:26:15",
        "measurement.quantizer",
        "step is missing: kind uniform needs it",
        "add step",
    ),
    (
        "measurement: {quantizer: {kind: none, step: 1}}",
        "11:45:1",
        "measurement.quantizer.step",
        "does not belong to kind none",
        "remove it",
    ),
    (
        "measurement: {quantizer: {kind: hysteresis-uniform, step: 0.1, hysteresis: 0.06}}",
        "11:76:4",
        "measurement.quantizer.hysteresis",
        "0.06 is above half the step, 0.05",
        "at most 0.05",
    ),
    (
        LOGARITHMIC.replace("density: 0.1", "density: 1"),
        "11:77:1",
        "measurement.quantizer.density",
        "between 0 and 1, both excluded",
        "",
    ),
    (
        LOGARITHMIC,
        "11:63:3",
        "measurement.quantizer.minimum",
        "0.2 is above the threshold 0.1",
        "at most 0.1",
    ),
    ("measurement: {quantizer: none}", "11:26:4", "measurement.quantizer", "a mapping with", ""),
    ("measurement: {noise: -1}", "11:22:2", "measurement.noise", "0 or above", ""),
    ("sampling: {period: -0.1}", "11:20:4", "sampling.period", "0 or above", ""),
    ("sampling: {delay: off}", "11:19:3", "sampling.delay", "truth value off", ""),
    ("actuator: {limit: 0}", "11:19:1", "actuator.limit", "above 0", ""),
    ("actuator: {limit: 1, error: 1}", "11:29:1", "actuator.error", "1 is not below the limit", ""),
    ("synthesis: {method: theorem3}", "11:21:8", "synthesis.method", "no free stage", "unified"),
    ("synthesis: {method: theorm2}", "11:21:7", "synthesis.method", "one of unified", "theorem2?"),
    (
        "synthesis: {center: nominal, method: theorem2}",
        "11:21:7",
        "synthesis.center",
        "theorem2 is proved for center performance",
        "method: unified",
    ),
    (
        "synthesis: {bounds: tight, method: theorem2}",
        "11:21:5",
        "synthesis.bounds",
        "proved for method unified, not for theorem2",
        "method: unified",
    ),
    (
        "synthesis: {objective: accuracy}",
        "11:24:8",
        "synthesis.objective",
        "no smallest accuracy without actuator.limit",
        "add `actuator: {limit: ..}`",
    ),
    (
        "synthesis: {objective: {accuracy: 1, slope: 1}}",
        "11:35:1",
        "synthesis.objective.accuracy",
        "no smallest accuracy without actuator.limit",
        "add `actuator: {limit: ..}`",
    ),
    (
        "synthesis: {objective: resolution}",
        "11:24:10",
        "synthesis.objective",
        "no state has a quantizer",
        "add `measurement:",
    ),
    (
        "synthesis: {objective: period, method: theorem2}",
        "11:24:6",
        "synthesis.objective",
        "no period to find",
        "method: unified",
    ),
    (
        "synthesis: {objective: period, method: theorem2, form: printed}",
        "11:24:6",
        "synthesis.objective",
        "form printed is never certified",
        "form: sound",
    ),
    (
        "synthesis: {objective: {accuracy: 1, period: 2}}\nactuator: {limit: 9}",
        "11:46:1",
        "synthesis.objective.period",
        "accuracy and period: one requirement",
        "sampling.period",
    ),
    (
        "synthesis: {objective: {accuracy: 1, slope: -1}}\nactuator: {limit: 9}",
        "11:45:2",
        "synthesis.objective.slope",
        "a number 0 or above",
        "",
    ),
    ("synthesis: {objective: {slope: 0}}", "11:24:10", "synthesis.objective", "no weight", ""),
    (
        "synthesis: {objective: {balanced: 1}}",
        "11:35:1",
        "synthesis.objective.balanced",
        "pair of weights",
        "slope: 1",
    ),
    ("synthesis: {stages: 2}", "11:21:1", "synthesis.stages", "where a list belongs", ""),
    ("synthesis: {handover: hold}", "11:23:4", "synthesis.handover", "one of reanchor", ""),
    (
        "synthesis: {stages: [{p: {x1: 1}, gains: {x1: {k: 1}}}]}",
        "11:26:1",
        "synthesis.stages.0.p",
        "the state x2 is missing",
        "add `x2:`",
    ),
    (
        (
            "synthesis: {method: theorem3, stages: [{p: {x1: 1, x2: 1}, gains: {x1: {M: 1}, "
            "x2: {k: 1}}}]}"
        ),
        "11:72:6",
        "synthesis.stages.0.gains.x1",
        "there is no epsilon",
        "add `epsilon:`",
    ),
    (
        "synthesis: {theorem1: {c_0: -1}}",
        "11:29:2",
        "synthesis.theorem1.c_0",
        "0 or above",
        "",
    ),
    (
        "synthesis: {gains: {x1: {gamma: 0}}}",
        "11:33:1",
        "synthesis.gains.x1.gamma",
        "above 0",
        "",
    ),
    ("synthesis: {form: printed}", "11:19:7", "synthesis.form", "no printed form", "theorem2"),
    ("synthesis: {gains: {x1: {N: 4}}}", "11:29:1", "synthesis.gains.x1.N", "4 is even", "3 or 5"),
    ("synthesis: {gains: {x1: {N: 1}}}", "11:29:1", "synthesis.gains.x1.N", "odd number", ""),
    ("synthesis: {gains: {x1: {N: 33}}}", "11:29:2", "synthesis.gains.x1.N", "3 to 31", ""),
    ("synthesis: {gains: {x1: {N: 3.0}}}", "11:29:3", "synthesis.gains.x1.N", "odd number", ""),
    ("synthesis: {gains: {x1: {k: 0}}}", "11:29:1", "synthesis.gains.x1.k", "above 0", ""),
    ("synthesis: {gains: {x1: {M: -1}}}", "11:29:2", "synthesis.gains.x1.M", "0 or above", ""),
    ("synthesis: {gains: {x3: {k: 1}}}", "11:21:2", "synthesis.gains.x3", "no such state", "x1"),
    ("synthesis: {p: {x1: 1}}", "11:21:1", "synthesis.p.x1", "performance.accuracy", "remove"),
    ("synthesis: {p: {x2: 0}}", "11:21:1", "synthesis.p.x2", "above 0", ""),
    (
        "synthesis: {p: {x2: 0.01}}\nmeasurement: {noise: 0.01}",
        "11:21:4",
        "synthesis.p.x2",
        "0.01 is equal to the resolution of x2, 0.01",
        "half-width above 0.01",
    ),
    (
        "synthesis: {method: theorem2}\nsampling: {period: 0.001, delay: 0.002}",
        "12:20:5",
        "sampling.period",
        "theorem2 is proved for continuous measurement, not for 0.001",
        "method: unified",
    ),
    (
        "synthesis: {method: theorem2}\nmeasurement: {noise: 0.001}",
        "12:22:5",
        "measurement.noise",
        "theorem2 is proved for exact measurement",
        "method: unified",
    ),
    (
        "synthesis: {method: theorem2}\nactuator: {error: 0.1}",
        "12:19:3",
        "actuator.error",
        "exact actuator",
        "method: unified",
    ),
    ("simulation: {horizon: 0}", "11:23:1", "simulation.horizon", "above 0", ""),
    ("simulation: {seed: -1}", "11:20:2", "simulation.seed", "whole number", ""),
    ("simulation: {seed: 1.5}", "11:20:3", "simulation.seed", "whole number", ""),
    (
        "simulation: {horizon: 10, period: 1e-8}",
        "11:35:4",
        "simulation.period",
        "1e+09 steps, more than 5e+07",
        "horizon below 0.5",
    ),
    (
        "simulation: {horizon: 1, period: 2}",
        "11:34:1",
        "simulation.period",
        "longer than the horizon",
        "",
    ),
    (
        "simulation: {horizon: 1e9}\nsampling: {period: 1e-3}",
        "11:23:3",
        "simulation.horizon",
        "5e",
        "",
    ),
    ("sampling: 3", "11:11:1", "sampling", "3 where a mapping with the keys period, delay", ""),
    ("sampling:", "11:1:8", "sampling", "nothing where a mapping", ""),
]


@pytest.mark.parametrize(("lines", "place", "path", "message", "fix"), ADDED)
def test_an_added_line_is_judged_at_its_place(mistakes, lines, place, path, message, fix):
    found = mistakes(GOOD + lines + "\n")
    assert any(
        f"{item.line}:{item.column}:{item.length}" == place
        and item.path == path
        and message in item.message
        and fix in item.fix
        for item in found
    ), found


def test_one_mistake_is_told_once(mistakes):
    for _, new, _, path, _, _ in SPOILED:
        old = next(case[0] for case in SPOILED if case[1] == new and case[3] == path)
        found = mistakes(GOOD.replace(old, new))
        assert len({(item.line, item.column, item.message) for item in found}) == len(found)
    assert len(mistakes(GOOD.replace("a*x1", "Min(x1, 2)"))) == 1
    assert len(mistakes(GOOD.replace("[x1, x2]", "[x1, 2x]"))) == 1
    assert len(mistakes(GOOD + "synthesis: {method: theorem1, theorem1: {c_0: 1}}\n")) == 1


def test_all_mistakes_of_a_file_come_at_once_in_file_order(mistakes):
    text = GOOD.replace("name: plant", "nam: plant").replace("a*x1", "b*x1").replace("0.15", "-1")
    found = mistakes(text + "samplig: {period: 1}\n")
    assert [(item.line, item.path) for item in found] == [
        (1, "nam"),
        (1, ""),
        (5, "dynamics.x1.f"),
        (10, "performance.accuracy"),
        (11, "samplig"),
    ]


def test_the_rendered_error_has_file_place_caret_and_fix(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(
        GOOD.replace("0.15", "0.04") + "measurement: {quantizer: {kind: uniform, step: 0.1}}\n",
        encoding="utf-8",
    )
    with pytest.raises(PlantFileError) as caught:
        load_spec(path)
    assert str(caught.value) == (
        f"{path}:10:13: error: performance.accuracy: 0.04 is below the resolution of x1, 0.05 "
        "(quantizer step 0.1): no gain can hold a tube narrower than what is measured\n"
        "   10 |   accuracy: 0.04\n"
        "      |             ^^^^\n"
        "  fix: choose an accuracy above 0.05, or a quantizer step below 0.08"
    )
    assert caught.value.exit_code == 2
