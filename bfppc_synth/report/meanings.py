"""The words of the glossary: what each letter of a formula stands for.

Sentences are for ``sentences.prose``; keys are those of ``letters.Letter``.
"""

from __future__ import annotations

# The constants of the chain, by their names in report.json.
CHAIN = {
    "xi": r"bound on $\left|x_{i} - r_{i}\right|$",
    "X": r"bound on $\left|x_{i}\right|$",
    "A": r"bound on the feedback $\left|\varphi_{i}(e_{i})\right|$ in the tube",
    "L": r"largest slope of $\varphi_{i}$ in the tube",
    "W": r"what pushes $e_{i}$ from outside: drift, disturbance, motion of $r_{i}$",
    "G": r"majorant $\overline{g}_{i}$ of the input gain at the bounds $X_{j}$",
    "g_min": r"least input gain $\underline{g}_{i}$ where the states can go",
    "D": r"all that pushes $e_{i}$, with the motion of $\varphi_{i-1}$",
    "B": r"bound on $\left|\varphi_{i}'(e_{i}) \, \dot{e}_{i}\right|$",
    "eta": r"bound on the measurement error $\left|\hat{e}_{i} - e_{i}\right|$",
    "Lambda": r"how far that error moves $\varphi_{i}$",
    "F_star": "the feedback that this tube needs at its wall",
    "delta_v": r"how much the feedforward $v$ moves while a command is held",
    "V": r"bound on $\left|\dot{e}_{i}\right|$",
    "zeta": r"total error of the applied $\hat{e}_{i}$: measurement, hold, delay",
    "U": r"bound on $\left|u\right|$: the peak input",
}

# Numbers that everyone knows.
NUMBERS = frozenset({"\N{GREEK SMALL LETTER PI}"})

MEANINGS = {
    "t": ("t", "time since the first sample, in seconds"),
    "n": ("n", "order of the plant: the number of its states"),
    "i": ("i", "number of a state and of its step, 1 to $n$"),
    "j": ("j", "number of a state, 1 to $n$"),
    "y": ("y", "output: the first state, $x_1$"),
    "y_d": ("y_d", "reference of the output"),
    "dot y_d": (r"\dot{y}_d", "derivative of $y_d$ by time"),
    "u": ("u", "input of the plant: the command of the law"),
    "u_limit": (r"u_{\text{limit}}", "limit of the actuator in the plant file"),
    "U": ("U", r"peak input: $\left|u\right| \le U$ at every time"),
    "x_i": ("x_i", r"state $i$ of the plant, in strict-feedback order"),
    "x": ("x", "all states together"),
    "dot x_i": (r"\dot{x}_i", "derivative of $x_i$ by time"),
    "q": ("q", "what the sensor makes of a state: quantizer and noise"),
    "r_i": (
        "r_i",
        (
            r"center of the tube of state $i$: for the output the known curve "
            r"$r_1 = y_d + \rho_1 a$, for a later state its fading start $\rho_i \, x_i(0)$"
        ),
    ),
    "dot r_i": (r"\dot{r}_i", "derivative of $r_i$ by time"),
    "a": ("a", "first measured output minus $y_d(0)$"),
    "ρ_i": (r"\rho_i", "performance function of state $i$: it lets the start fade"),
    "dot ρ_i": (r"\dot{\rho}_i", r"derivative of $\rho_i$ by time"),
    "ρ_∞": (r"\rho_{\infty}", "floor that the performance function approaches"),
    "λ": (r"\lambda", "rate at which the performance function falls"),
    "t_s": ("t_s", "time scale of the performance function, in seconds"),
    "F": ("F", "funnel of the plant file"),
    "p_i": ("p_i", r"half-width of the tube of step $i$: $\left|e_i\right| \le p_i$"),
    "e_i": (
        "e_i",
        (
            r"true error of step $i$: $e_1 = x_1 - r_1$, then "
            r"$e_i = x_i - r_i + \varphi_{i-1}(e_{i-1})$"
        ),
    ),
    "e": ("e", "argument of a feedback: an error"),
    "hat e_i": (r"\hat{e}_i", "the same error made of measured states, as the law sees it"),
    "dot e_i": (r"\dot{e}_i", "derivative of $e_i$ by time"),
    "φ_i": (r"\varphi_i", "feedback of step $i$, an odd and rising function of its error"),
    "φ_i\N{PRIME}": (r"\varphi_i'", r"derivative of $\varphi_i$ by its error"),
    "k_i": ("k_i", r"gain of the linear term of $\varphi_i$"),
    "M_i": ("M_i", r"height of the saturating term of $\varphi_i$"),
    "ε_i": (r"\varepsilon_i", r"width of the saturating term of $\varphi_i$"),
    "c_i": ("c_i", r"gain of the power term of $\varphi_i$"),
    "N_i": ("N_i", r"exponent of the power term of $\varphi_i$, odd"),
    "h": ("h", "longest time between two samples, in seconds"),
    "τ": (r"\tau", "longest delay from a sample to its command, in seconds"),
    "δ_u": (r"\delta_u", "largest difference between commanded and applied input"),
    "δ_v": (r"\delta_v", CHAIN["delta_v"]),
    "δ_0,i": (r"\delta_{0,i}", "largest error of the measured $x_i$: quantizer and noise"),
    "v": ("v", "feedforward: what the center asks of the input; zero without a nominal center"),
    "f_i": ("f_i", r"drift of state $i$: what moves $x_i$ beside its input"),
    "g_i": ("g_i", "input gain of state $i$"),
    "d_i": ("d_i", "disturbance of state $i$, of which a bound is known"),
    "f_i*": ("f_i^*", r"declared bound on $\left|f_i\right|$"),
    "g_i*": ("g_i^*", "declared upper bound on $g_i$"),
    "z_i": ("z_i", r"any bound on $\left|x_i\right|$: the argument of a majorant"),
    "bar f_i": (r"\overline{f}_i", r"majorant of $\left|f_i\right|$ at the bounds $X_j$"),
    "bar g_i": (r"\overline{g}_i", "majorant of $g_i$ at the bounds $X_j$"),
    "under g_i": (r"\underline{g}_i", "bound below $g_i$ at the bounds $X_j$"),
    "bar d_i": (r"\overline{d}_i", "bound on the disturbance of state $i$"),
    "g_m,i": ("g_{m,i}", CHAIN["g_min"]),
    "ξ_i": (r"\xi_i", CHAIN["xi"]),
    "X_i": ("X_i", CHAIN["X"]),
    "A_i": ("A_i", CHAIN["A"]),
    "L_i": ("L_i", CHAIN["L"]),
    "W_i": ("W_i", CHAIN["W"]),
    "G_i": ("G_i", CHAIN["G"]),
    "D_i": ("D_i", CHAIN["D"]),
    "B_i": ("B_i", CHAIN["B"]),
    "s_i": ("s_i", r"bound on $\left|r_i\right|$ where it counts as a push on the step before"),
    "η_i": (r"\eta_i", CHAIN["eta"]),
    "Λ_i": (r"\Lambda_i", "how far the measurement error moves $\\varphi_i$"),
    "F_i*": ("F_i^*", "the feedback that the tube of step $i$ needs at its wall"),
    "V": ("V", r"bound on $\left|\dot{e}_n\right|$"),
    "V_i": ("V_i", r"bound on $\left|\dot{e}_i\right|$"),
    "ζ": (r"\zeta", r"total error of the applied $\hat{e}_n$: measurement, hold, delay"),
    "σ": (r"\sigma", "share of the half-width of the tube, between 0 and 1"),
    "ϑ_i": (r"\vartheta_1, \dots", "abbreviation, written out beside the formula that uses it"),
    "ℓ_i": (r"\ell_i", r"supremum of $\pm R_i / g_i$ on the walls of the tube of step $i$"),
    "R_i": ("R_i", "residual of step $i$: all that moves $e_i$ but the feedback"),
    "w_i": ("w_i", "residual along the center: where the plant differs from its model"),
    "t_l": ("t_l", "time of the switch that ends stage $l$"),
    "l": ("l", "number of a stage that was left"),
    "r_i(l)": ("r_1^{(l)}", "measured error of the output at switch $l$"),
}

# What the same letters mean around a nominal center, and what it adds.
NOMINAL = {
    "r_i": (
        "r_i",
        "center of the tube of state $i$: the known curve that the nominal plant follows",
    ),
    "v": ("v", "feedforward: the input with which the nominal plant follows the center"),
    "dot v": (r"\dot{v}", "derivative of $v$ by time"),
    "v_0": ("v_0", "bound on $v$ until the first command acts"),
    "b": ("b", "transition from the measured start to the reference, zero after $T_s$"),
    "b(μ)": (r"b^{(\mu)}", r"derivative of $b$ of order $\mu$ by time"),
    "T_s": ("T_s", "duration of the transition, in seconds"),
    "s": ("s", "time as a share of $T_s$"),
    "ν": (r"\nu", "number of a term of the transition"),
    "μ": (r"\mu", "order of a derivative"),
    "Q_ν": (r"Q_\nu", "coefficient of the transition, latched at the first sample"),
    "hat f_i": (r"\hat{f}_i", "drift of the nominal plant"),
    "hat g_i": (r"\hat{g}_i", "input gain of the nominal plant"),
    "g_m,i": ("g_{m,i}", CHAIN["g_min"]),
    "bar g_i": (r"\overline{g}_i", "largest input gain where the states can go"),
    "under g_i": (r"\underline{g}_i", "least input gain where the states can go"),
    "G_i": ("G_i", "largest input gain where the states can go"),
    "W_i": ("W_i", r"bound on the residual $w_i$, disturbance included"),
}

# Theorem 1 has gains and constants of its own.
THEOREM1 = {
    "ρ": (r"\rho", r"value of the performance function, between 0 and 1"),
    "ρ_M": (r"\rho_M", r"bound on the speed of the performance function"),
    "γ_i": (r"\gamma_i", r"gain of the linear term of $\varphi_i$, multiplied by $H_i$"),
    "H_i": ("H_i", r"height of the linear term of $\varphi_i$, a polynomial in $\rho$"),
    "H_i,j": ("H_{i,j}", r"coefficient of $\rho^j$ in $H_i$"),
    "H_i0": ("H_i^0", "least height that dominates everything that pushes $e_i$ outward"),
    "H_i*": ("H_i^*", "the constant height of the paper"),
    "c_0": ("c_0", "bound on what measurement changes in a power term"),
    "δ_M": (r"\delta_M", r"largest of the $\delta_{M,i}$"),
    "δ_M,i": (r"\delta_{M,i}", "largest error of the measured $x_i$: quantizer and noise"),
    "δ_i": (r"\delta_i", r"how far measurement moves $\varphi_i$"),
    "ε_i": (r"\varepsilon_i", r"room that the tube leaves beside the measurement error"),
    "dot α_i": (r"\dot{\alpha}_i", r"motion of the feedback $\varphi_i$"),
}
