"""report.json and trajectory.csv."""

from __future__ import annotations

import dataclasses
import json
import math

import pytest

from bfppc_synth.model.spec import RhoKind
from bfppc_synth.report.requirements import LONGEST_RUN, longest_run
from bfppc_synth.report.tables import report_document, trajectory_csv

CONTRACT = {
    "format": None,
    "name": None,
    "order": None,
    "status": None,
    "method": None,
    "form": None,
    "center": None,
    "states": None,
    "gains": {"k", "M", "epsilon", "c", "N"},
    "omega": {"p"},
    "majorants": {"state", "f", "g", "g_min"},
    "bounds": {"X", "xi", "A", "L", "W", "s", "B", "D", "F_star", "eta", "zeta", "V", "U", "slope"},
    "reference": {"Y0", "Y1"},
    "performance": {"accuracy", "rho"},
    "initial": {"x1", "x2"},
    "measurement": {"delta"},
    "sampling": {"period", "delay", "largest_certified_period"},
    "actuator": {"limit", "error"},
    "inequalities": {"id", "equation", "lhs", "rhs", "margin", "holds", "binding_terms"},
    "simulation": {"max_abs_e", "max_abs_u", "within_bounds"},
    "tool": {"version", "plant_sha256"},
}


@pytest.mark.parametrize("key", sorted(CONTRACT))
def test_report_json_has_every_field_of_the_contract(design, run, adversaries, key):
    document = report_document(design, run, adversaries)
    value = document[key]
    inner = CONTRACT[key]
    if inner is not None:
        entries = value if isinstance(value, list) else [value]
        assert entries
        assert all(inner <= set(entry) for entry in entries)


def test_report_json_carries_the_numbers_of_the_design(design, run, adversaries):
    document = report_document(design, run, adversaries)
    assert document["format"] == "bfppc-synth/report/1"
    assert document["status"] == "certified"
    assert document["gains"][0] == {"k": 2.0, "M": 13.31441, "epsilon": 0.5, "c": 0.1, "N": 3}
    assert document["omega"]["p"] == list(design.omega)
    assert document["bounds"]["F_star"] == list(design.bounds.F_star)
    assert document["bounds"]["r"] == [1.28, 1.28]
    assert document["initial"] == {"x1": [0.0, 1.0], "x2": [0.0, 1.0]}
    assert document["actuator"]["limit"] == 500.0
    assert document["simulation"]["max_abs_e"] == list(run.max_abs_e)
    assert document["simulation"]["adversaries"]["runs"] == 3
    assert document["simulation"]["adversaries"]["max_abs_u"] == 9.0


def test_report_json_is_the_same_text_every_time(design, run, adversaries):
    texts = {json.dumps(report_document(design, run, adversaries), indent=1) for _ in range(2)}
    assert len(texts) == 1


def test_a_number_that_is_not_finite_becomes_null(refuted, run):
    document = report_document(refuted, run, ())
    text = json.dumps(document, allow_nan=False)
    assert json.loads(text)["bounds"]["U"] is None
    assert json.loads(text)["bounds"]["V"] is None
    assert json.loads(text)["bounds"]["zeta"] == 0.0456


def test_a_run_that_blew_up_is_written_as_null(design, run, adversaries):
    broken = dataclasses.replace(adversaries[0], max_abs_e=(math.nan, 1.0), within_bounds=False)
    document = report_document(design, run, (broken, *adversaries[1:]))
    summary = document["simulation"]["adversaries"]
    assert summary["max_abs_e"] == [None, 1.0]
    assert summary["within_bounds"] is False
    json.dumps(document, allow_nan=False)


def test_what_fails_is_named_only_where_something_fails(design, refuted, run):
    assert report_document(design, run, ())["failures"] == []
    assert report_document(design, run, ())["notice"] == ""
    document = report_document(refuted, run, ())
    assert document["notice"] == "NOT CERTIFIED"
    assert document["failures"] == ["U1[x1] (65): 4 is not above 5.1"]


@pytest.mark.parametrize(
    ("identifier", "path", "line"),
    [
        ("U1[x1]", "dynamics.x1.f_bound", 5),
        ("U2[x2]", "dynamics.x2.f", 6),
        ("U2'[x2]", "dynamics.x2.f", 6),
        ("U2.room[x2]", "dynamics.x2.f", 6),
        ("U0[x1]", "performance.accuracy", 9),
        ("something else", "performance.accuracy", 9),
    ],
)
def test_every_inequality_has_its_place_in_the_plant_file(design, run, identifier, path, line):
    entry = dataclasses.replace(design.certificate.inequalities[0], id=identifier)
    certificate = dataclasses.replace(design.certificate, inequalities=(entry,))
    document = report_document(dataclasses.replace(design, certificate=certificate), run, ())
    place = document["inequalities"][0]["place"]
    assert (place["path"], place["line"]) == (path, line)


def test_the_margin_is_the_distance_of_the_enclosures(design, run):
    entry = report_document(design, run, ())["inequalities"][0]
    assert entry["margin"] == 5.2 - 5.1
    assert entry["relative_margin"] == (5.2 - 5.1) / 5.2
    assert entry["binding_terms"][0] == {"term": "B_0 / g_min", "share": 0.72}


def test_a_floor_of_the_performance_function_stays_in_the_final_error(design, run):
    assert report_document(design, run, ())["performance"]["final_error"] == 0.15
    spec = design.spec
    rho = dataclasses.replace(
        spec.performance.rho[0],
        kind=RhoKind.EXPONENTIAL,
        t_s=None,
        rate=spec.performance.rho[0].t_s,
        floor=spec.performance.accuracy,
    )
    performance = dataclasses.replace(spec.performance, rho=(rho, *spec.performance.rho[1:]))
    signals = dataclasses.replace(design.signals, rho_floor=(0.1, 0.0))
    floored = dataclasses.replace(
        design, spec=dataclasses.replace(spec, performance=performance), signals=signals
    )
    entry = report_document(floored, run, ())["performance"]
    assert entry["final_error"] == pytest.approx(0.15 + 0.1 * 1.001, rel=1e-12)
    assert entry["final_error"] > 0.15 + 0.1 * 1.001
    assert entry["rho"][0] == {
        "kind": "exponential",
        "rate": 1.0,
        "floor": 0.1,
        "rate_bound": 0.5,
    }


@pytest.mark.parametrize("period", [1e-13, 3e-13, 16.0 * 2.0**-40, 1e-12])
def test_the_longest_run_ends_where_the_clock_becomes_too_coarse(period):
    limit = longest_run(period)
    assert limit < LONGEST_RUN
    assert math.ulp(math.nextafter(limit, 0.0)) <= period / 16.0 < math.ulp(limit)


@pytest.mark.parametrize("period", [0.0, 1e-4, 1.0])
def test_the_longest_run_is_a_million_seconds_otherwise(period):
    assert longest_run(period) == LONGEST_RUN


@pytest.mark.parametrize(
    ("rows", "written"), [(11, 11), (2001, 2001), (2002, 1002), (5001, 1668), (4001, 2001)]
)
def test_the_trajectory_is_thinned_evenly_and_keeps_both_ends(design, run_of, rows, written):
    run = run_of(design, rows)
    lines = trajectory_csv(design, run).splitlines()
    assert lines[0] == "t,x1,x2,q1,q2,e1,e2,u,y_d"
    assert len(lines) == written + 1
    first, last = lines[1].split(","), lines[-1].split(",")
    assert [float(v) for v in first] == [
        *(float(run.t[0]), *run.x[0], *run.q[0], *run.e[0]),
        *(float(run.u[0]), float(run.y_d[0])),
    ]
    assert float(last[0]) == float(run.t[-1])
    assert float(last[-2]) == float(run.u[-1])
    assert "np." not in lines[1]


def test_a_trajectory_without_certificate_says_so(design, refuted, run):
    assert trajectory_csv(design, run).startswith("t,")
    lines = trajectory_csv(refuted, run).splitlines()
    assert lines[0] == "# NOT CERTIFIED: U1[x1] (65): 4 is not above 5.1"
    assert lines[1].startswith("t,")


def test_no_file_names_the_path_of_the_plant_file(design, run, adversaries):
    text = json.dumps(report_document(design, run, adversaries))
    assert "somewhere" not in text
