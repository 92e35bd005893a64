"""docs/paper.md: every number in its tables is computed again, and what it names is there."""

from __future__ import annotations

import importlib
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from bfppc_synth.arguments import COMMANDS
from bfppc_synth.audit.audit import audit_plant
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.report.requirements import measurement_entry
from bfppc_synth.simulation.loop import load_controller, simulate_adversaries, simulate_nominal
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
FIGURES = ("fig1", "fig2", "fig3", "fig4", "fig5", "fig6", "fig7", "fig8", "switch")
EXAMPLE_1, EXAMPLE_2 = "paper_example_1_printed", "paper_example_2_printed"
STARTS = {"(0.5, 2)": (0.5, 2.0), "(0.5, -2)": (0.5, -2.0), "(0.9, 0)": (0.9, 0.0)}


def table(heading: str) -> list[list[str]]:
    """Rows of the table whose header line begins with ``| heading |``."""
    (block,) = re.findall(rf"^\| {re.escape(heading)} \|.*\n((?:\|.*\n)+)", PAGE, re.MULTILINE)
    lines = block.splitlines()[1:]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


def says(cell: str, value: float) -> bool:
    """Whether a cell is the value rounded to the cell's last digit."""
    digits = cell.partition(".")[2]
    return abs(float(cell) - value) <= 0.5 * 10.0 ** -len(digits) * (1.0 + 1e-6)


def example(name: str) -> str:
    return (ROOT / "examples" / f"{name}.yaml").read_text(encoding="utf-8")


def quiet(message):
    del message


def audited(text, folder, *starts, horizon=None):
    path = folder / "plant.yaml"
    path.write_text(text, encoding="utf-8")
    spec = load_spec(path)
    if horizon is not None:
        spec = replace(spec, simulation=replace(spec.simulation, horizon=horizon))
    return audit_plant(spec, starts, quiet)[0]


def made(text, folder):
    path = folder / "plant.yaml"
    path.write_text(text, encoding="utf-8")
    return synthesize(load_spec(path))


def without_synthesis(name: str) -> str:
    """The file up to its section ``synthesis``; what follows is the simulation only."""
    before, _, after = example(name).partition("synthesis:")
    assert "\nsimulation:" in after
    return before


def required(name: str, synthesis: str, period: str) -> str:
    sampling = "" if period == "0" else f"sampling: {{period: {period}}}\n"
    return f"{without_synthesis(name)}{sampling}synthesis: {synthesis.strip('`')}\n"


def moved(text: str, start: tuple[float, float]) -> str:
    line = f"initial: {{x1: {start[0]:g}, x2: {start[1]:g}}}"
    changed, count = re.subn(r"^initial: .*$", line, text, flags=re.MULTILINE)
    assert count == 1
    return changed


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    folder = tmp_path_factory.mktemp("first")
    return audited(example(EXAMPLE_1), folder, {"x1": 1.5}, {"x1": 2.0})


@pytest.fixture(scope="module")
def second(tmp_path_factory):
    return audited(example(EXAMPLE_2), tmp_path_factory.mktemp("second"))


@pytest.fixture(scope="module")
def switched(tmp_path_factory):
    starts = [{"x1": x1, "x2": x2} for x1, x2 in STARTS.values()]
    return audited(example(EXAMPLE_2), tmp_path_factory.mktemp("switched"), *starts, horizon=0.1)


@pytest.fixture(scope="module")
def counterexample(tmp_path_factory):
    text = (ROOT / "tests" / "plants" / "lemma_39_counterexample.yaml").read_text("utf-8")
    return audited(text, tmp_path_factory.mktemp("counterexample"))


def row(audit, name):
    return next(row for row in audit.rows if name in row.id.split(" / "))


def have(side):
    return side.remedies[0].have


def test_the_audit_of_example_1(first):
    found = {
        "H_1, (85)": row(first, "T1.H[x1]"),
        "c_0, for c_1": row(first, "T1.c[x1]"),
        "gamma_1, (39)": row(first, "T1.gamma[x1]"),
        "H_2, (86)": row(first, "T1.H[x2]"),
        "c_0, for c_2": row(first, "T1.c[x2]"),
    }
    rows = table("number | printed gains have")
    assert [cells[0] for cells in rows] == list(found)
    for name, has, printed, sound in rows:
        entry = found[name]
        assert says(has, have(entry.printed))
        for cell, side in ((printed, entry.printed), (sound, entry.sound)):
            # What would do lies just above what is needed, in steps of a relative 1e-5.
            assert float(cell) == pytest.approx(side.remedies[0].need, rel=5e-3)
    # The last inequality counted in the summary holds in both forms, as do p_1 and p_2.
    failed = [entry.id for entry in first.rows if entry.printed and not entry.printed.holds]
    assert len(failed) == 4
    assert len(first.rows) == 8
    assert "four of eight inequalities fail" in PAGE
    (note,) = row(first, "T1.H[x2]").notes
    assert says("228", float(note.rpartition(": ")[2]))


def test_the_runs_of_example_1(first):
    rows = table("start | largest e_1")
    assert len(rows) == len(first.runs) == 3
    for cells, run in zip(rows, first.runs, strict=True):
        start, reached, p, time, verdict = cells
        assert start == f"({run.start[0]:g}, {run.start[1]:g})"
        assert says(reached, run.max_abs_e[0])
        assert says(p, run.half_widths[0])
        assert verdict == str(run.answer(first.sound.certificate))
        if run.escape is None:
            assert time == "-"
        else:
            assert says(time, run.escape.time)


def test_the_counterexample(counterexample):
    (run,) = counterexample.runs
    printed = row(counterexample, "T1.gamma[x1]").printed
    sound = row(counterexample, "T1'.gamma[x1]").sound
    values = [
        printed.lhs,
        printed.rhs,
        run.half_widths[0],
        run.escape.time,
        run.escape.reached,
        sound.lhs,
        sound.rhs,
        sound.remedies[0].need,
    ]
    rows = table("quantity")
    assert len(rows) == len(values)
    for (_, cell), value in zip(rows, values, strict=True):
        assert says(cell, value)
    assert counterexample.printed.holds
    assert not counterexample.sound.holds


def test_the_loads_of_example_2(second):
    printed, sound = second.printed.bounds, second.sound.bounds
    stage = second.runs[0].stages
    values = [
        printed.F_star[0],
        row(second, "T2[x1]").printed.remedies[0].need,
        printed.F_star[1],
        sound.F_star[0],
        sound.F_star[1],
        *stage[0].max_abs_e,
        second.runs[0].max_abs_u,
    ]
    rows = table("number | value")
    assert len(rows) == len(values)
    for (_, cell), value in zip(rows, values, strict=True):
        assert float(cell) == pytest.approx(value, abs=0.51 * 10 ** -len(cell.partition(".")[2]))
    assert len(stage) == 1


def test_assumption_3_is_local(second):
    entry = next(one for one in second.assumptions if one.id == "g_min[x1]")
    assert entry.local
    for number in ("2.171", "1.772"):
        assert number in entry.detail
        assert number in PAGE


@pytest.mark.parametrize("index", range(3), ids=list(STARTS))
def test_the_jumps_and_the_reanchored_designs(switched, index, tmp_path):
    cells = table("start | e_2 jumps to")[index]
    name, fixed, own, peak, sampled, largest, p_2 = cells
    start = STARTS[name]
    run = switched.runs[index + 1]
    assert run.start == start
    assert (run.escape.error, run.escape.stage, run.escape.bound) == (2, 2, 2.0)
    assert says(fixed, run.escape.reached)

    open_text = moved(example(EXAMPLE_2), start).replace("M: 13.31441, ", "")
    solved = audited(open_text, tmp_path, horizon=0.1)
    assert solved.printed.holds
    assert "synthesis.gains.x1.M" in solved.completion.filled
    assert says(own, solved.runs[0].escape.reached)

    text = moved(example("switching_example_2"), start).replace("horizon: 10", "horizon: 2")
    design = made(text, tmp_path)
    assert design.certificate.verdict is Verdict.CERTIFIED
    assert says(peak, design.bounds.U)
    assert says(p_2, design.omega[1])
    path = tmp_path / "controller.py"
    path.write_text(render_controller(build_law(design), make_provenance(design)))
    controller = load_controller(path)
    runs = simulate_adversaries(design, controller, runs=20)
    assert simulate_nominal(design, controller).within_bounds
    assert all(one.within_bounds for one in runs)
    last = [stage for one in runs for stage in one.stages if stage.stage == 2]
    assert last
    assert says(largest, max(stage.max_abs_e[1] for stage in last))

    faster = made(text + "sampling: {period: 0.0001}\n", tmp_path)
    assert faster.certificate.verdict is Verdict.CERTIFIED
    assert says(sampled, faster.bounds.U)


def test_every_start_of_the_table_is_tried():
    assert [cells[0] for cells in table("start | e_2 jumps to")] == list(STARTS)


@cache
def prices() -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(cells) for cells in table("plant file | sampling.period"))


@pytest.mark.parametrize("cells", prices(), ids=lambda cells: " ".join(cells[:3]))
def test_the_price_of_a_requirement(cells, tmp_path):
    name, period, synthesis, least, balanced = cells
    assert ", objective: peak-input}" in synthesis
    without = synthesis.replace(", objective: peak-input}", "}")
    for text, cell in ((synthesis, least), (without, balanced)):
        design = made(required(name, text, period), tmp_path)
        printed = "form: printed" in text
        expected = Verdict.PRINTED if printed else Verdict.CERTIFIED
        assert design.certificate.verdict is expected
        assert says(cell, design.bounds.U)


def test_theorem_1_needs_two_orders_of_magnitude_more_than_theorem_u():
    found = {(cells[0], cells[1], cells[2]): float(cells[3]) for cells in prices()}
    theorem1 = found["theorem1_example_1", "0", "`{method: theorem1, objective: peak-input}`"]
    unified = found["theorem1_example_1", "0", "`{method: unified, objective: peak-input}`"]
    assert 115 < theorem1 / unified < 125
    assert "about 120 times" in PAGE


@pytest.mark.parametrize("cells", table("design"), ids=lambda cells: cells[0])
def test_the_converters(cells, tmp_path):
    synthesis, *numbers = cells
    design = made(required("theorem1_example_1", synthesis, "0"), tmp_path)
    entries = measurement_entry(design)["adc"]
    flat = [value for entry in entries for value in (entry["range"], entry["bits"])]
    assert all(says(cell, value) for cell, value in zip(numbers, flat, strict=True))


def test_what_a_handover_adds(tmp_path):
    design = made(example("switching_example_2"), tmp_path)
    assert says("0.04", sum(stage.anchor_limit for stage in design.stages))
    assert "(`handover.excess`, 0.04 here)" in PAGE


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_there_small_and_shown(name):
    path = ROOT / "docs" / "figures" / f"{name}.svg"
    text = path.read_text(encoding="utf-8")
    assert len(text.encode()) < 60_000
    assert text.startswith("<?xml")
    assert not re.search(r"<dc:date>|<script|href=\"http", text)
    assert f"](figures/{name}.svg)" in PAGE
    # Fig. 1 is the quantizer's map: all others have a time axis and a certified panel.
    if name != "fig1":
        assert "time t [s]" in text
        assert ": certified" in text
        assert "NOT CERTIFIED" in text


def test_no_other_figure_is_committed():
    found = sorted(path.name for path in (ROOT / "docs" / "figures").iterdir())
    assert found == [f"{name}.svg" for name in FIGURES]


def test_the_quantizer_is_drawn_as_committed(tmp_path, monkeypatch):
    import matplotlib as mpl

    monkeypatch.syspath_prepend(ROOT / "docs")
    module = importlib.import_module("draw_paper_figures")
    monkeypatch.setattr(module, "FIGURES", tmp_path)
    with mpl.rc_context():
        module.prepare()
        module.draw_quantizer()
    committed = ROOT / "docs" / "figures" / "fig1.svg"
    assert (tmp_path / "fig1.svg").read_bytes() == committed.read_bytes()


def test_its_commands_exist():
    blocks = re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL)
    lines = [line.split() for line in "\n".join(blocks).splitlines() if line]
    tools = [words[1] for words in lines if words[0] == ".venv/bin/bfppc-synth"]
    assert len(tools) >= 7
    assert all(word in COMMANDS or word.endswith(".yaml") for word in tools)
    files = {word for words in lines for word in words if word.startswith(("examples/", "tests/"))}
    assert len(files) >= 6
    assert [path for path in sorted(files) if not (ROOT / path).exists()] == []


def test_what_it_links_to_is_there():
    links = re.findall(r"\]\(([^)#]+)\)", PAGE)
    assert len(links) >= 10
    assert [link for link in links if not (ROOT / "docs" / link).exists()] == []
