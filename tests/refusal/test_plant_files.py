"""Files that are no plant files: refused with a place, without a traceback, without being run."""

import subprocess
import sys

import pytest

from bfppc_synth.errors import PlantFileError
from bfppc_synth.spec.load import load_spec

HEAD = "name: plant\nstates: [x1]\n"
TAIL = "initial: {x1: 0}\nperformance: {accuracy: 1}\n"
GOOD = HEAD + "dynamics: {x1: {f: 0}}\n" + TAIL


def refusal(path):
    with pytest.raises(PlantFileError) as caught:
        load_spec(path)
    assert caught.value.exit_code == 2
    return caught.value


@pytest.mark.parametrize(
    ("data", "place", "words"),
    [
        (b"", "1:1", "an empty file"),
        (b"# nothing\n", "1:1", "an empty file"),
        (b"~\n", "1:1", "an empty file"),
        (b"[x1, x2]\n", "1:1", "no mapping"),
        (b"just words\n", "1:1", "no mapping"),
        (b"\x7fELF\x02\x01\x01\x00", "1:1", "control character"),
        (b"name: plant\nstates: \xff\xfe\n", "2:9", "no UTF-8"),
        (b"name: plant\x00\n", "1:12", "U+0000"),
        (b"name: a\xc2\x85b\n", "1:8", "U+0085"),
        (b"name: plant\n\tstates: [x1]\n", "2:1", "a tab"),
        (b"name: plant\nstates:\n\t- x1\n", "3:1", "a tab"),
        (b"name: plant\nstates: [x1\n", "2:9", "not YAML"),
        (b"name: 'plant\n", "1:7", "not YAML"),
        (b"name: plant: x\n", "1:12", "not YAML"),
        (b"name: plant\n states: [x1]\n", "2:8", "not YAML"),
        (b"name: plant\nstates x1\n", "2:1", "not YAML"),
        (b"name: @plant\n", "1:7", "not YAML"),
        (b"name: &a plant\n", "1:7", "anchor"),
        (b"name: *a\n", "1:7", "alias"),
        (b"a: &x [1, 1]\nb: [*x, *x]\n", "1:4", "anchor"),
        (b"<<: {name: plant}\n", "1:1", "unknown key"),
        (b"name: !!python/object/apply:os.system ['true']\n", "1:7", "the tag"),
        (b"name: !!str plant\n", "1:7", "the tag"),
        (b"%YAML 1.1\n---\nname: plant\n", "2:1", "directive"),
        (b"name: plant\n---\nname: plant\n", "2:1", "second document"),
        (b"? [a]\n: b\n", "1:3", "no plain word"),
        (b"{[a]: b}\n", "1:2", "no plain word"),
        (b"a: [[[[[[[[[[[[[[1]]]]]]]]]]]]]]\n", "1:15", "nested deeper than 12"),
        (b"a: " + b"x" * 6000 + b"\n", "1:5000", "a line of 6003 characters"),
        (b"#\n" * 60_000, "1:1", "more than 100000 bytes"),
        (b"a: [\n" + b"1,\n" * 6000 + b"]\n", "4998:1", "too many values"),
    ],
)
def test_what_is_no_plant_file_is_refused_at_its_place(tmp_path, data, place, words):
    path = tmp_path / "plant.yaml"
    path.write_bytes(data)
    error = refusal(path)
    assert any(
        f"{item.line}:{item.column}" == place and words in item.message for item in error.mistakes
    ), error.mistakes
    assert str(error).startswith(f"{path}:{error.mistakes[0].line}:")


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    assert "no such file" in str(refusal(tmp_path / "nowhere.yaml"))
    assert "a folder" in str(refusal(tmp_path))
    assert "cannot be read" in str(refusal("plant\0.yaml"))


@pytest.mark.parametrize(
    "text",
    [
        '__import__("pathlib").Path("made").touch()',
        '().__class__.__base__.__subclasses__()[0].__init__.__globals__["system"]("touch made")',
        "exec(x1)",
        "open(x1)",
        "(lambda:x1)()",
        "x1.__class__",
        "f'{x1}'",
        "9**9**9",
        "9**(9**(9**9))",
        "factorial(10**6)",
        "1e-9999999",
        "1e9999999999",
        "(((((1e300**64)**64)**64)**64)**64)",
        "(" * 2000 + "x1" + ")" * 1900,
        "-" * 3000 + "x1",
        "x1" + "**2" * 900,
    ],
)
def test_hostile_mathematics_is_refused_at_once_and_never_run(tmp_path, monkeypatch, text):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "plant.yaml"
    path.write_text(f"{HEAD}dynamics:\n  x1:\n    f: {text}\n{TAIL}", encoding="utf-8")
    error = refusal(path)
    assert [item.path for item in error.mistakes] == ["dynamics.x1.f"]
    assert [item.line for item in error.mistakes] == [5]
    assert sorted(item.name for item in tmp_path.iterdir()) == ["plant.yaml"]


def test_the_plant_that_the_hostile_ones_are_made_from_is_good(tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(GOOD, encoding="utf-8")
    assert load_spec(path).order == 1


def test_reading_a_plant_file_imports_nothing_heavy(tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(GOOD.replace("f: 0", "f: x1 + pi*sqrt(2)*y") + "x: 1\n", encoding="utf-8")
    program = (
        "import sys\n"
        "from bfppc_synth.errors import PlantFileError\n"
        "from bfppc_synth.spec.load import load_spec\n"
        "try:\n"
        "    load_spec(sys.argv[1])\n"
        "except PlantFileError as error:\n"
        "    print(len(error.mistakes))\n"
        "heavy = {'sympy', 'mpmath', 'numpy', 'scipy', 'casadi', 'matplotlib', 'jinja2'}\n"
        "print(sorted(heavy & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.split("\n") == ["2", "[]", ""]
