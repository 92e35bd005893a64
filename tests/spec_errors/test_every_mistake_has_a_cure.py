"""Every mistake that any test knows, and many that none does: each is answered with a `fix:`."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bfppc_synth.errors import PlantFileError
from bfppc_synth.expressions.names import ALIASES, FUNCTIONS, KEYWORDS
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.prepare import prepare
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from types import ModuleType

TESTS = Path(__file__).parents[1]


def cases_of(path: str) -> ModuleType:
    """Import another test file for its table of cases."""
    spec = importlib.util.spec_from_file_location(f"cases_{Path(path).stem}", TESTS / path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def parameters(test: object) -> list[object]:
    """The rows that pytest would run a test with."""
    return [row for mark in test.pytestmark if mark.name == "parametrize" for row in mark.args[1]]


LISTED = cases_of("spec_errors/test_mistakes.py")
THEOREM1 = cases_of("spec_errors/test_theorem1_files.py")
NOMINAL = cases_of("spec_errors/test_nominal_files.py")
FILES = cases_of("refusal/test_plant_files.py")
TERMS = cases_of("unit/expressions/test_parse.py")

EXPRESSION = """\
name: plant
states: [x1, x2]
parameters: {{a: 0.5}}
dynamics:
  x1: {{f: 0}}
  x2:
    f: "{}"
initial: {{x1: 1, x2: 1}}
performance: {{accuracy: 0.1}}
"""
TEXTS = [
    *(LISTED.GOOD.replace(row[0], row[1]) for row in LISTED.SPOILED),
    *(LISTED.GOOD + row[0] + "\n" for row in LISTED.ADDED),
    *(THEOREM1.GOOD.replace(row[0], row[1]) for row in THEOREM1.REFUSED),
    *(NOMINAL.GOOD.replace(row[0], row[1]) for row in NOMINAL.REFUSED),
    *(row[0] for row in parameters(FILES.test_what_is_no_plant_file_is_refused_at_its_place)),
    *(
        FILES.HEAD + f"dynamics:\n  x1:\n    f: {text}\n" + FILES.TAIL
        for text in parameters(FILES.test_hostile_mathematics_is_refused_at_once_and_never_run)
    ),
    *(EXPRESSION.format(row[0]) for row in TERMS.REFUSED if '"' not in row[0]),
    *(EXPRESSION.format(row[1]) for row in parameters(TERMS.test_each_limit_holds_on_both_sides)),
    # Those that once had no cure.
    *(
        EXPRESSION.format(text)
        for text in (
            *("x1!", "x1 if x2 else 1", "tan(pi/2)", "(10**60)**60", "sin()", "Min(x1)", "x1 +"),
            *("", "*x1", "sin(*x1)", "Piecewise((x1, True), (0, True))", "1" * 400, "x1*(", "()"),
            "Min(" + ",".join(["x1"] * 33) + ")",
            "Piecewise(" + "(x1, x1 < 0), " * 40 + "(0, True))",
        )
    ),
]


def refusal(path: Path, text: str | bytes) -> PlantFileError | None:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    try:
        load_spec(path)
    except PlantFileError as error:
        return error
    return None


def require_cures(error: PlantFileError) -> None:
    for mistake in error.mistakes:
        assert mistake.fix.strip(), mistake
        assert "\n" not in mistake.message + mistake.fix, mistake
    assert str(error).count("\n  fix: ") == len(error.mistakes)


def require_carets(error: PlantFileError) -> None:
    """A line of the file and a caret under it for each mistake."""
    lines = error.source.splitlines()
    if lines:
        assert str(error).count("\n      | ") == len(error.mistakes)
        for mistake in error.mistakes:
            assert 1 <= mistake.line <= len(lines), mistake
            assert 1 <= mistake.column <= len(lines[mistake.line - 1]) + 1, mistake


def test_every_listed_mistake_has_a_cure_and_a_caret(tmp_path: Path) -> None:
    assert len(TEXTS) > 250
    refused = 0
    for text in TEXTS:
        error = refusal(tmp_path / "plant.yaml", text)
        assert error is not None, text
        require_cures(error)
        require_carets(error)
        refused += len(error.mistakes)
    assert refused > len(TEXTS)


@given(
    pieces=st.lists(
        st.sampled_from(
            [
                *("x1", "x2", "x3", "a", "t", "pi", "2", "0", "1e400", "010", ".5", "9", "64"),
                *("+", "-", "*", "/", "**", "^", "(", ")", ",", "<", "<=", "==", "=", "!", "%"),
                *(" ", "[", "}", "&", "|", ".", "'", "~", "@", "//", "\u00b2", "\u2212"),
                *(f"{name}(" for name in sorted({*FUNCTIONS, *ALIASES, "Piecewise"})),
                *sorted(KEYWORDS)[:8],
            ]
        ),
        min_size=1,
        max_size=9,
    )
)
def test_every_mistake_in_a_random_expression_has_a_cure(
    tmp_path_factory: pytest.TempPathFactory, pieces: list[str]
) -> None:
    path = tmp_path_factory.getbasetemp() / "expression.yaml"
    error = refusal(path, EXPRESSION.format("".join(pieces)))
    if error is None:
        assert load_spec(path).order == 2
    else:
        require_cures(error)
        require_carets(error)


@given(
    end=st.integers(0, len(LISTED.GOOD)),
    tail=st.sampled_from(["", "'", '"', "[", "{", "- ", ": ", "|", "? ", "&a", "x1: [1, '"]),
)
def test_a_file_that_ends_early_has_a_cure_and_a_caret(
    tmp_path_factory: pytest.TempPathFactory, end: int, tail: str
) -> None:
    path = tmp_path_factory.getbasetemp() / "early.yaml"
    error = refusal(path, LISTED.GOOD[:end] + tail)
    if error is None:
        assert load_spec(path).order == 2
    else:
        require_cures(error)
        require_carets(error)


# What only shows when bounds are computed: (dynamics of x1, reference, further lines).
BOUNDED = [
    ("{f: 1/x1}", "0"),
    ("{f: log(x1)}", "0"),
    ("{f: sqrt(x1 - 0.5)}", "0"),
    ("{f: tan(9*x1)}", "0"),
    ("{f: 0, g: x1}", "0"),
    ("{f: 0, g: sin(x1) - 2}", "0"),
    ("{f: 0, g: 2, g_min: x1 - 3}", "0"),
    ("{f: 0*log(x1)}", "0"),
    ("{f: 0/x1}", "0"),
    ("{f: 1/(x1 - x1)}", "0"),
    ("{f: 0}", "t"),
    ("{f: 0}", "exp(t)"),
    ("{f: 0}", "tan(t)"),
    ("{f: 0}", "sign(t - 1)"),
    ("{f: 0}", "sin(t**2)"),
    ("{f: 0}", "1/(t - 5)"),
    ("{f: 0}", "0.3 + 0*log(50 - t)"),
    ("{f: 0}", "{value: sin(t), bound: 0.5, rate: 0.5}"),
    ("{f: 0}", "{value: log(50 - t), bound: 99, rate: 99}"),
]


@pytest.mark.parametrize(("channel", "reference"), BOUNDED)
def test_every_mistake_that_needs_bounds_has_a_cure(
    tmp_path: Path, channel: str, reference: str
) -> None:
    path = tmp_path / "plant.yaml"
    path.write_text(
        f"name: plant\nstates: [x1]\ndynamics:\n  x1: {channel}\nreference: {reference}\n"
        "initial: {x1: [-0.1, 0.1]}\nperformance: {accuracy: 0.1}\n",
        encoding="utf-8",
    )
    with pytest.raises(PlantFileError) as caught:
        synthesize(load_spec(path))
    require_cures(caught.value)
    require_carets(caught.value)
    assert all(
        item.path.startswith(("dynamics.x1.", "reference")) for item in caught.value.mistakes
    )


HIDDEN = [
    # f of x2 from x1(0) = 0.3, x2(0) = 0.1, accuracy 0.1; words of the answer; one that is good
    ("x2**(-2)*0", "has a pole", "(2 + x2)**(-2)*0"),
    ("0/x2", "has a pole", "0/(2 + x2)"),
    ("x1/x1", "has a pole", "(x1 + 2)/(x1 + 2)"),
    ("1/x1 - 1/x1", "has a pole", "1/(x1 + 2) - 1/(x1 + 2)"),
    ("x2 + 0*log(x1)", "is a logarithm down to 0", "x2 + 0*log(x1 + 2)"),
    ("sqrt(x1 - 0.2)**2", "what may be negative", "sqrt(x1 + 0.2)**2"),
    ("0*tan(9*x1)", "tan(9*x1)", "0*tan(x1)"),
    ("(1/x2)**0", "has a pole", "(1/(2 + x2))**0"),
]


@pytest.mark.parametrize(("hidden", "words", "good"), HIDDEN)
def test_a_domain_hidden_by_a_zero_is_refused_at_its_expression(
    tmp_path: Path, hidden: str, words: str, good: str
) -> None:
    text = (
        "name: plant\nstates: [x1, x2]\ndynamics:\n  x1: {{f: x1}}\n  x2:\n    f: {}\n"
        "initial: {{x1: 0.3, x2: 0.1}}\nperformance: {{accuracy: 0.1}}\n"
    )
    path = tmp_path / "plant.yaml"
    path.write_text(text.format(good), encoding="utf-8")
    prepare(load_spec(path))
    path.write_text(text.format(hidden), encoding="utf-8")
    with pytest.raises(PlantFileError, match=r"dynamics\.x2\.f: ") as caught:
        prepare(load_spec(path))
    (mistake,) = caught.value.mistakes
    assert (mistake.line, mistake.column, mistake.length) == (6, 8, len(hidden))
    assert words in mistake.message


@pytest.mark.parametrize(
    ("bad", "good"),
    [
        ("0.3 + 0*log(9e5 - t)", "0.3 + 0*log(1.1e6 - t)"),
        ("0.3*(t - 50)/(t - 50)", "0.3*(t + 50)/(t + 50)"),
        ("0.3*sqrt(t - 0.1)**2/(1 + t)", "0.3*sqrt(t + 0.1)**2/(1 + t)"),
    ],
)
def test_a_reference_is_defined_as_long_as_the_controller_runs(
    tmp_path: Path, bad: str, good: str
) -> None:
    text = (
        "name: plant\nstates: [x1]\ndynamics: {{x1: {{f: x1}}}}\nreference: {}\n"
        "initial: {{x1: 0.3}}\nperformance: {{accuracy: 0.1}}\n"
    )
    path = tmp_path / "plant.yaml"
    path.write_text(text.format(good), encoding="utf-8")
    prepare(load_spec(path))
    path.write_text(text.format(bad), encoding="utf-8")
    with pytest.raises(PlantFileError, match="reference: for t from ") as caught:
        prepare(load_spec(path))
    (mistake,) = caught.value.mistakes
    assert (mistake.line, mistake.column) == (4, 12)
    assert mistake.fix == "keep it defined for 0 <= t <= 1e6 s"
