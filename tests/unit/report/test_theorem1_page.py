"""Theorem 1 in the report: its gains and its inequalities in letters."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.model.spec import Form
from bfppc_synth.report.gains import gain_table
from bfppc_synth.report.theorem1 import theorem1_formula

LEMMA = (
    r"c_0 \ge 3 \, c_{1} \, \eta_{1} "
    r"\left(p_{1}^{2} + \left(p_{1} + \eta_{1}\right)^{2}\right)"
)
AT_THE_START = (
    r"\gamma_{1} \, H_{1}(1) \, \varepsilon_{1} + c_{1} \, p_{1}^{3}"
    r" > H_{1}(1) + c_0 + \delta_M + \varepsilon_{2}"
)
PRINTED_LAST = (
    r"\gamma_{2} > "
    r"\frac{H_{2}^{*} + c_0 - c_{2} \, p_{2}^{3}}{\varepsilon_{2} \, H_{2}^{*}}"
)


def design_of(form, *heights):
    gains = tuple(Theorem1Gain(gamma=1.0, H=H, H_star=1.0, c=0.1, N=3) for H in heights)
    spec = SimpleNamespace(order=len(gains), synthesis=SimpleNamespace(form=form))
    return SimpleNamespace(spec=spec, gains=gains)


def test_the_table_has_a_column_for_every_coefficient_and_a_gap_where_there_is_none():
    gains = [
        {"gamma": 4.0, "H": [5.0], "c": 0.1, "N": 3},
        {"gamma": 0.4, "H": [10.0, 2.0], "c": 1.5, "N": 3},
    ]
    table = gain_table({"gains": gains})
    assert table.names == ("gamma", "H_0", "H_1", "c", "N")
    assert table.rows[0][2] == ()
    assert table.rows[1][2] == ("gains", 1, "H", 1)
    assert r"H_i(\rho)" in table.shape
    assert r"\rho" not in gain_table({"gains": gains[:1]}).shape


def test_the_table_of_the_other_methods_has_the_tanh():
    shape = {"k": 1.0, "M": 0.0, "epsilon": 1.0, "c": 0.0, "N": 3}
    table = gain_table({"gains": [shape]})
    assert table.names == tuple(shape)
    assert r"\tanh" in table.shape


@pytest.mark.parametrize(
    ("form", "family", "index", "expected"),
    [
        (Form.SOUND, "T1.p", 0, r"p_{1} > \eta_{1}"),
        (Form.SOUND, "T1.H", 1, r"H_{2}(\rho) \ge H_{2}^{0}(\rho)"),
        (
            Form.SOUND,
            "T1.c",
            0,
            r"c_0 \ge c_{1} \left(\left(p_{1} + \eta_{1}\right)^{3} - p_{1}^{3}\right)",
        ),
        (
            Form.PRINTED,
            "T1.c",
            0,
            LEMMA,
        ),
        (
            Form.SOUND,
            "T1.gamma",
            1,
            r"\gamma_{2} \, H_{2}(0) \, \varepsilon_{2} + c_{2} \, p_{2}(0)^{3} > H_{2}(0) + c_0",
        ),
        (
            Form.SOUND,
            "T1'.gamma",
            0,
            AT_THE_START,
        ),
        (
            Form.PRINTED,
            "T1.gamma",
            1,
            PRINTED_LAST,
        ),
        (Form.SOUND, "T1.other", 0, ""),
    ],
)  # fmt: skip
def test_an_inequality_reads_as_in_the_theory(form, family, index, expected):
    assert theorem1_formula(design_of(form, (5.0,), (10.0, 2.0)), family, index) == expected
