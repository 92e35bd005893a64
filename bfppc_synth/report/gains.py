"""The feedback shape, the law and the table of gains, as method and center have them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping


# What r_i is, and what stands beside the feedback.
_PERFORMANCE = (
    r"$r_1$ is the curve of the promise, $r_i = \rho_i \, x_i(0)$ for the later states",
    (
        r"$s_{i+1}$ bounds $\left|r_{i+1}\right|$, and $\delta_v$ is what a feedforward would "
        "change while it is held"
    ),
)
_NOMINAL = (
    r"$r_1$ to $r_n$ are the center",
    (
        r"$v$ is the feedforward, $\delta_v$ bounds what it changes while it is held, and $v_0$ "
        "bounds it until the first command acts"
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GainTable:
    """phi_i in LaTeX and in plain letters, column heads, and where each number stands.

    A head is a sentence for ``prose``; a cell is a path in report.json, empty where a row has no
    such number.
    """

    shape: str
    plain: str
    heads: tuple[str, ...]
    names: tuple[str, ...]
    rows: tuple[tuple[tuple[str | int, ...], ...], ...]


def errors_sentence(document: Mapping[str, Any]) -> str:
    """Say what e_i, p_i and the feedback are, a sentence for ``prose``."""
    center = (_PERFORMANCE if document["center"] != "nominal" else _NOMINAL)[0]
    return (
        r"Here $e_1 = x_1 - r_1$ and $e_i = x_i - r_i + \varphi_{i-1}(e_{i-1})$ are the "
        rf"true errors ({center}), $\hat{{e}}_i$ the same made of measured states, and $p_i$ is "
        r"the half-width of the tube $\left|e_i\right| \le p_i$. The feedback of step $i$ is "
        f"${gain_table(document).shape}$ with the gains of the table below."
    )


def pushes_sentence(document: Mapping[str, Any]) -> str:
    """Say what stands beside the feedback in the chain, a sentence for ``prose``."""
    fed = (_PERFORMANCE if document["center"] != "nominal" else _NOMINAL)[1]
    return f"In it {fed}."


def command_sentence(document: Mapping[str, Any]) -> str:
    """Say what the law does at a sample, a sentence for ``prose``."""
    forward = "v" if document["center"] == "nominal" else ""
    return (
        r"At every sample the law forms $\hat{e}_1 = q(x_1) - r_1$ and $\hat{e}_i = q(x_i) - r_i + "
        r"\varphi_{i-1}(\hat{e}_{i-1})$ from the measured states $q(x_i)$ and applies $u = "
        rf"{forward}-\varphi_n(\hat{{e}}_n)$ with"
    )


def gain_table(document: Mapping[str, Any]) -> GainTable:
    """Lay out the gains of report.json.

    Parameters
    ----------
    document : Mapping[str, Any]
        report.json; its gains all have the same keys.

    Returns
    -------
    GainTable
        Columns p, then the gains that the generated code contains.

    References
    ----------
    docs/theory.md section 0: (54)-(55), and (9) for theorem1.
    """
    gains = document["gains"]
    if "gamma" in gains[0]:
        return _of_theorem1(gains)
    keys = ("k", "M", "epsilon", "c", "N")
    tanh = r"M_i \tanh\left(\frac{M_i \, e}{\varepsilon_i}\right)"
    return GainTable(
        shape=rf"\varphi_i(e) = k_i \, e + {tanh} + c_i \, e^{{N_i}}",
        plain="phi_i(e) = k e + M tanh(M e / epsilon) + c e^N",
        heads=(
            "linear $k_i$",
            "height $M_i$",
            r"width $\varepsilon_i$",
            "power $c_i$",
            "exponent $N_i$",
        ),
        names=keys,
        rows=tuple(tuple(("gains", i, key) for key in keys) for i in range(len(gains))),
    )


def _of_theorem1(gains: list[dict[str, Any]]) -> GainTable:
    most = max(len(gain["H"]) for gain in gains)
    height = "H_i" if most == 1 else r"H_i(\rho)"
    rows = []
    for i, gain in enumerate(gains):
        heights = tuple(("gains", i, "H", j) if j < len(gain["H"]) else () for j in range(most))
        rows.append((("gains", i, "gamma"), *heights, ("gains", i, "c"), ("gains", i, "N")))
    return GainTable(
        shape=rf"\varphi_i(e) = \gamma_i \, {height} \, e + c_i \, e^{{N_i}}",
        plain="phi_i(e) = gamma H(rho) e + c e^N, H(rho) = H_0 + H_1 rho + ..",
        heads=(
            r"linear $\gamma_i$",
            *(rf"height $H_{{i,{j}}}$" for j in range(most)),
            "power $c_i$",
            "exponent $N_i$",
        ),
        names=("gamma", *(f"H_{j}" for j in range(most)), "c", "N"),
        rows=tuple(rows),
    )
