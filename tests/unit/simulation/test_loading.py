"""Loading the generated controller."""

from __future__ import annotations

import pytest

from bfppc_synth.errors import UsageError
from bfppc_synth.simulation.loop import load_controller

TEXT = "class Controller:\n    def step(self, t, x, y_d=None):\n        return 2.0 * x[0]\n"


def test_the_class_is_loaded_and_nothing_is_written_beside_it(tmp_path):
    path = tmp_path / "controller.py"
    path.write_text(TEXT)
    assert load_controller(path)().step(0.0, [3.0]) == 6.0
    assert [item.name for item in tmp_path.iterdir()] == ["controller.py"]


def test_a_changed_file_is_read_anew(tmp_path):
    path = tmp_path / "controller.py"
    path.write_text(TEXT)
    before = load_controller(path)
    path.write_text(TEXT.replace("2.0", "5.0"))
    assert (before().step(0.0, [3.0]), load_controller(path)().step(0.0, [3.0])) == (6.0, 15.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no class Controller"),
        ("Controller = 3\n", "no class Controller"),
        ("class Controller(:\n", "does not run as Python"),
        ("import a_module_that_nobody_has\n", "does not run as Python"),
        ("raise ValueError('spoiled')\n", "spoiled"),
    ],
)
def test_a_damaged_file_is_refused_with_its_name(tmp_path, text, words):
    path = tmp_path / "controller.py"
    path.write_text(text)
    with pytest.raises(UsageError, match=words) as caught:
        load_controller(path)
    assert "controller.py" in str(caught.value)


def test_a_missing_or_binary_file_is_refused(tmp_path):
    with pytest.raises(UsageError, match="cannot be read"):
        load_controller(tmp_path / "controller.py")
    (tmp_path / "controller.py").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UsageError, match="cannot be read"):
        load_controller(tmp_path / "controller.py")
