"""A plant file read again with other values."""

import pytest

from bfppc_synth.errors import PlantFileError
from bfppc_synth.spec.canonical import plant_document
from bfppc_synth.spec.edits import Edit, changed
from bfppc_synth.spec.load import load_spec

TEXT = """name: plant
states: [x1, x2]
dynamics: {x1: {f: x1}, x2: {f: 0}}
initial: {x1: 0.5, x2: 0}
performance: {accuracy: 0.1}
synthesis: {center: performance, gains: {x1: {k: 5}}, p: {x2: 1}}
"""


@pytest.fixture
def spec(tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(TEXT, encoding="utf-8")
    return load_spec(path)


def test_a_value_is_replaced_in_the_records_and_in_the_document(spec):
    other = changed(spec, (Edit(path="performance.accuracy", text="0.2"),))
    assert other.performance.accuracy.text == "0.2"
    assert plant_document(other)["plant"]["performance"]["accuracy"] == "0.2"
    assert spec.performance.accuracy.text == "0.1"


def test_a_section_that_the_file_lacks_is_added(spec):
    other = changed(spec, (Edit(path="sampling.period", text="0.001"),))
    assert other.sampling.period.text == "0.001"


def test_a_key_is_removed_with_the_section_that_held_nothing_else(spec):
    other = changed(spec, (Edit(path="synthesis.gains.x1.k", text=None),))
    assert other.synthesis.gains[0].k is None
    assert not other.gives("synthesis.gains")
    assert other.gives("synthesis.p.x2")


def test_the_edited_file_reads_like_one_that_says_so(spec, tmp_path):
    path = tmp_path / "other.yaml"
    path.write_text(TEXT.replace("x1: 0.5,", "x1: [0.25, 0.5],"), encoding="utf-8")
    edited = changed(spec, (Edit(path="initial.x1", text="[0.25, 0.5]"),))
    assert edited.document == load_spec(path).document


def test_a_mistake_in_an_edit_is_a_mistake_of_the_file(spec):
    with pytest.raises(PlantFileError, match=r"performance\.accuracy"):
        changed(spec, (Edit(path="performance.accuracy", text="-1"),))
