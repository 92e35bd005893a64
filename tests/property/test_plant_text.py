"""Whatever a plant file contains: a PlantSpec, or mistakes that lie inside of the file."""

import string

from hypothesis import given
from hypothesis import strategies as st

from bfppc_synth.errors import PlantFileError
from bfppc_synth.spec.load import load_spec

GOOD = """\
name: plant
states: [x1, x2]
parameters: {a: 0.5, b: [1, 2]}
dynamics:
  x1: {f: a*x1 + sin(x1), g: 2, f_bound: "Max(abs(x1), 2)*2"}
  x2:
    f: x1*x2
reference: {value: sin(t), bound: 1, rate: 1}
initial: {x1: 1, x2: [-1, 1]}
performance: {accuracy: 0.15, rho: {x1: {kind: cosine, t_s: 1}, x2: {kind: cosine, t_s: 2}}}
measurement: {quantizer: {kind: uniform, step: 0.01}, noise: [0, 0.1]}
synthesis: {gains: {x1: {N: 5}}, objective: {slope: 1}}
"""
PIECES = [
    *"{}[]:,-?&*!|>'\"%@`#\n\t~=<>()^.0eE",
    *("- ", "? ", ": ", "\n  ", "---\n", "...\n", "%YAML 1.1\n", "<<: ", "!!str ", "&a ", "*a"),
    *("|\n  ", ">-\n ", "\x00", "\x85", "\u2028", "\r\n", "\r", "inf", ".nan", "true", "null"),
    *("x1", "x3", "t", "1e9999", "9**9**9", "{}", "[]", "[[[[", "\ufeff", "\u00b2"),
]


def outcome(path, text):
    path.write_bytes(text.encode("utf-8", errors="surrogatepass"))
    try:
        return load_spec(path)
    except PlantFileError as error:
        return error


def require_places(error, text):
    lines = [*text.splitlines(), ""]
    for mistake in error.mistakes:
        assert mistake.message
        assert mistake.length >= 1
        assert 1 <= mistake.line <= len(lines) + 1
        if error.source:
            line = lines[mistake.line - 1] if mistake.line <= len(lines) else ""
            assert 1 <= mistake.column <= len(line) + 1
    places = [(item.line, item.column) for item in error.mistakes]
    assert places == sorted(places)
    assert str(error)


@given(
    edits=st.lists(
        st.tuples(st.integers(0, len(GOOD)), st.integers(0, 12), st.sampled_from(PIECES)),
        min_size=1,
        max_size=4,
    )
)
def test_a_spoiled_plant_file_is_read_or_refused_with_places(tmp_path_factory, edits):
    text = GOOD
    for start, length, piece in edits:
        text = text[:start] + piece + text[start + length :]
    found = outcome(tmp_path_factory.getbasetemp() / "spoiled.yaml", text)
    if isinstance(found, PlantFileError):
        require_places(found, text)
    else:
        assert found.states


@given(text=st.text(max_size=60) | st.text(alphabet=string.printable, max_size=120))
def test_any_text_is_refused_as_a_plant_file(tmp_path_factory, text):
    found = outcome(tmp_path_factory.getbasetemp() / "random.yaml", text)
    assert isinstance(found, PlantFileError)
    require_places(found, text)
