"""The generated C of center nominal against adversaries in a loop that shares nothing with ours.

The plant, its center and its errors are written in C here, by sympy's own printer and from
docs/theory.md sections 2 and 4: the center from Lie derivatives at the measured start and from
jets of y_d + b, where the package unrolls Taylor arithmetic. Every hold is integrated by the
Runge-Kutta method, in two parts where the command comes late.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path

import pytest
import sympy as sp

from bfppc_synth.cli import main
from bfppc_synth.synthesis.synthesize import restore

PLANTS = Path(__file__).parents[1] / "plants"
EVERY = os.environ.get("BFPPC_TESTS") == "all"
RUNS = 60
# Bounds of the noise per state, period and delay [s], and how long a run is [s].
CASES = {
    "motor_arm": ((1e-4, 1e-3, 1e-3), 1e-4, 1e-4, 3.0),
    "jerk": ((1e-4, 1e-4, 1e-4), 1e-3, 1e-3, 5.0),
    "chain_of_four": ((1e-4, 1e-4, 1e-4, 1e-4), 1e-3, 1e-3, 8.0),
    "flexible_joint": ((1e-5, 1e-5, 1e-5, 1e-5), 1e-4, 1e-4, 3.0),
    "joint_shared": ((1e-5, 1e-5, 1e-5, 1e-5), 1e-4, 1e-4, 3.0),
    "levitation": ((1e-7, 1e-6, 1e-5), 1e-5, 0.0, 0.5),
}
# The motor arm once more, from a box of starts: the one that is always tried.
BOX = "motor_arm_box"
CASES[BOX] = CASES["motor_arm"]
SAMPLE = BOX

LOOP = r"""
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "@NAME@.h"

enum { n = @ORDER@, m = @COUNT@, corners = 1 << @COUNT@ };
static const double T = @TRANSITION@, h = @PERIOD@, tau = @DELAY@, horizon = @HORIZON@;
static const double p[] = {@WIDTHS@}, noise[] = {@NOISE@}, low[] = {@LOW@}, high[] = {@HIGH@};
static const double k_[] = {@KS@}, M_[] = {@MS@}, epsilon_[] = {@EPSILONS@};
static const double c_[] = {@CS@}, N_[] = {@NS@};
static const double least[] = {@LEAST@, 0}, most[] = {@MOST@, 0};
static unsigned long long bits;

static double uniform(void)
{
    bits ^= bits << 13, bits ^= bits >> 7, bits ^= bits << 17;
    return (double)(bits >> 11) / 9007199254740992.0;
}
static double coin(void) { return uniform() < 0.5 ? -1.0 : 1.0; }

static void known(const double *x, const double *a, double *f, double *g, double *d) { @KNOWN@ }
static void lie(const double *x, double *y) { @LIE@ }
static void jets(double t, double *y) { @JETS@ }
static void follow(const double *z, double *r) { @FOLLOW@ }

static double q[n + 1];

static double choose(int of, int out)
{
    double value = 1.0;
    for (int j = 1; j <= out; j++) value = value * (of - out + j) / j;
    return value;
}

/* b = (1 - s)^(n+2) q(s), s = t / T: q matches b^(j)(0), j < n. */
static void latch(const double *x)
{
    double from[n + 1], reference[n + 2], weight[n + 1], power = 1.0;
    lie(x, from), jets(0.0, reference);
    for (int j = 0; j < n; j++) {
        weight[j] = (from[j] - reference[j]) * power;
        power *= T / (j + 1);
    }
    for (int i = 0; i < n; i++) {
        q[i] = 0.0;
        for (int j = 0; j <= i; j++) q[i] += weight[j] * choose(n + 1 + i - j, i - j);
    }
}

static void center(double t, double *r)
{
    double z[n + 2], b[2 * n + 2] = {0.0}, s = t / T, scale = 1.0;
    jets(t, z);
    if (t < T) {
        for (int i = 0; i < n; i++)
            for (int j = 0; j <= n + 2; j++)
                b[i + j] += q[i] * choose(n + 2, j) * (j % 2 ? -1.0 : 1.0);
        for (int d = 0; d <= n; d++, scale /= T) {
            double sum = 0.0;
            for (int j = 2 * n + 1; j >= d; j--) {
                double factor = b[j];
                for (int l = 0; l < d; l++) factor *= j - l;
                sum = sum * s + factor;
            }
            z[d] += sum * scale;
        }
    }
    follow(z, r);
}

static double phi(int i, double e, double *slope)
{
    double at = tanh(M_[i] * e / epsilon_[i]);
    *slope = k_[i] + M_[i] * M_[i] / epsilon_[i] * (1.0 - at * at)
        + (c_[i] == 0.0 ? 0.0 : c_[i] * N_[i] * pow(fabs(e), N_[i] - 1.0));
    return k_[i] * e + M_[i] * at + (c_[i] == 0.0 ? 0.0 : c_[i] * pow(e, N_[i]));
}

static void errors(double t, const double *x, double *e, double *slope)
{
    double r[n], carried = 0.0;
    center(t, r);
    for (int i = 0; i < n; i++) {
        e[i] = x[i] - r[i] + carried;
        carried = phi(i, e[i], slope + i);
    }
}

static void rates(const double *x, const double *a, const double *w, double u, double *dx)
{
    double f[n], g[n], d[n];
    known(x, a, f, g, d);
    for (int i = 0; i < n; i++) dx[i] = f[i] + w[i] * d[i] + g[i] * (i + 1 < n ? x[i + 1] : u);
}

static void advance(double length, double *x, const double *a, const double *w, double u)
{
    double k1[n], k2[n], k3[n], k4[n], y[n];
    rates(x, a, w, u, k1);
    for (int i = 0; i < n; i++) y[i] = x[i] + 0.5 * length * k1[i];
    rates(y, a, w, u, k2);
    for (int i = 0; i < n; i++) y[i] = x[i] + 0.5 * length * k2[i];
    rates(y, a, w, u, k3);
    for (int i = 0; i < n; i++) y[i] = x[i] + length * k3[i];
    rates(y, a, w, u, k4);
    for (int i = 0; i < n; i++) x[i] += length / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
}

static double widen;

static void corner(int index, double *a)
{
    for (int j = 0; j < m; j++) {
        double half = 0.5 * (most[j] - least[j]) * widen, middle = 0.5 * (most[j] + least[j]);
        a[j] = middle + (index >> j & 1 ? half : -half);
    }
}

/* Drive error number `target` outward as fast as any parameters and disturbances can. */
static void push(int target, double sign, const double *x, const double *slope, double u,
                 double *a, double *w)
{
    double weight[n], found = -HUGE_VAL, trial[m + 1], dx[n];
    weight[target] = sign;
    for (int i = target; i > 0; i--) weight[i - 1] = weight[i] * slope[i - 1];
    for (int i = 0; i < n; i++) w[i] = sign * widen;
    for (int index = 0; index < corners; index++) {
        double total = 0.0;
        corner(index, trial), rates(x, trial, w, u, dx);
        for (int i = 0; i <= target; i++) total += weight[i] * dx[i];
        if (total > found) found = total, memcpy(a, trial, sizeof trial);
    }
}

static void meet(double t, const double *x, double *e, double *slope, double *peak)
{
    errors(t, x, e, slope);
    for (int i = 0; i < n; i++) peak[i] = fmax(peak[i], fabs(e[i]) / p[i]);
}

int main(int argc, char **argv)
{
    int runs = argc > 3 ? atoi(argv[1]) : 0;
    double loud = argc > 3 ? atof(argv[3]) : 0.0;
    widen = argc > 3 ? atof(argv[2]) : 0.0;
    for (int run = 0; run < runs; run++) {
        @NAME@_state s = {0};
        @NAME@_real measured[n], u = 0.0;
        double x[n], e[n], slope[n], a[m + 1] = {0.0}, w[n] = {0.0}, v[n], peak[n] = {0.0};
        double t = 0.0, largest = 0.0, pace, held = 0.0;
        int strategy = run % 6, turn = run / 6, bad = 0, target = turn % n;
        bits = 88172645463325252ULL + 7919ULL * (unsigned)run;
        for (int i = 0; i < 20; i++) uniform();
        pace = pow(10.0, -3.0 + 3.0 * uniform());
        for (int i = 0; i < n; i++) {
            double share = turn % 2 ? uniform() : 0.5 + 0.5 * coin();
            x[i] = low[i] + share * (high[i] - low[i]);
            w[i] = widen * coin(), v[i] = coin();
        }
        corner((int)(uniform() * corners), a);
        for (int k = 0; t <= horizon; k++) {
            double length = turn % 3 == 2 ? h * (0.2 + 0.8 * uniform()) : h, begin, sign, parts[3];
            double late = turn % 4 == 3 ? tau * uniform() : tau;
            late = fmin(late, length);
            if (k > 0) meet(t, x, e, slope, peak);
            for (int i = 0; i < n; i++) {
                int against = strategy < 3 && k > 0 && run % 2;
                sign = against ? (e[i] > 0.0 ? -1.0 : 1.0) : strategy == 4 ? v[i] : coin();
                measured[i] = x[i] + loud * noise[i] * sign;
            }
            if (k == 0) latch(measured), meet(t, x, e, slope, peak);
            bad += @NAME@_step(&s, t, measured, @NAME@_reference(t), &u) != @NAME@_OK;
            largest = fmax(largest, fabs(u));
            if (strategy == 0)
                for (int i = target = 0; i < n; i++)
                    if (fabs(e[i]) / p[i] > fabs(e[target]) / p[target]) target = i;
            if (strategy == 1) target = n - 1;
            if (strategy < 3) {
                push(target, e[target] < 0.0 ? -1.0 : 1.0, x, slope, u, a, w);
            } else if (strategy == 3 ? uniform() < length / pace
                                     : strategy == 5 && fmod(t, pace) < fmod(t - length, pace)) {
                corner((int)(uniform() * corners), a);
                for (int i = 0; i < n; i++) w[i] = widen * coin();
            }
            begin = t;
            parts[0] = late, parts[1] = 0.5 * (length - late), parts[2] = parts[1];
            for (int part = 0; part < 3; part++)
                if (parts[part] > 0.0) {
                    advance(parts[part], x, a, w, part ? u : held);
                    meet(begin += parts[part], x, e, slope, peak);
                }
            held = u;
            t += length;
            if (!(fabs(x[0]) < 1e9)) break;
        }
        printf("%d %d %.17g", strategy, bad, largest);
        for (int i = 0; i < n; i++) printf(" %.17g", peak[i]);
        printf("\n");
    }
    return 0;
}
"""


def statements(outputs, names) -> str:
    """C statements ``name = expression;`` with common subexpressions taken out."""
    shared, reduced = sp.cse(list(outputs), symbols=sp.numbered_symbols("shared_"), order="none")
    lines = [f"double {symbol} = {sp.ccode(value)};" for symbol, value in shared]
    lines += [f"{name} = {sp.ccode(value)};" for name, value in zip(names, reduced, strict=True)]
    return "\n    ".join(lines)


def array(name, count):
    return [sp.Symbol(f"{name}[{i}]", real=True) for i in range(count)]


def follow(model, z):
    """r_1 = z_0, r_{i+1} = (dr_i - f^_i) / g^_i, where z_k is the k-th derivative of y_d + b."""
    r = [z[0]]
    for f, g in zip(model.f[:-1], model.g[:-1], strict=True):
        at = dict(zip(model.states, r, strict=False))
        rate = sum(sp.diff(r[-1], z[k]) * z[k + 1] for k in range(len(z) - 1))
        r.append((rate - f.xreplace(at)) / g.xreplace(at))
    return r


def lie(model, x):
    """x_1 and its first n - 1 derivatives along the nominal plant."""
    at = dict(zip(model.states, x, strict=True))
    above = [*x[1:], sp.S.Zero]
    field = [
        f.xreplace(at) + g.xreplace(at) * y for f, g, y in zip(model.f, model.g, above, strict=True)
    ]
    found = [x[0]]
    while len(found) < len(x):
        found.append(sum(sp.diff(found[-1], y) * rate for y, rate in zip(x, field, strict=True)))
    return found


def loop_text(design, case) -> str:
    plant, model, order = design.plant, design.nominal, design.plant.order
    noise, period, delay, horizon = CASES[case]
    x, a = array("x", order), array("a", len(plant.parameters))
    at = dict(zip(plant.states, x, strict=True)) | dict(zip(plant.parameters, a, strict=True))
    parts = {"f": "f", "g": "g", "disturbance": "d"}
    known = [
        (f"{name}[{i}]", sp.sympify(getattr(channel, part)).xreplace(at))
        for part, name in parts.items()
        for i, channel in enumerate(plant.channels)
    ]
    t, z = sp.Symbol("t", real=True), array("z", order + 1)
    y = plant.reference.xreplace({plant.time: t})
    box = [(float(s.lower.approximate), float(s.upper.approximate)) for s in design.spec.initial]

    def listed(values) -> str:
        return ", ".join(repr(float(value)) for value in values)

    words = {
        "KNOWN": statements([value for _, value in known], [name for name, _ in known]),
        "LIE": statements(lie(model, x), [f"y[{i}]" for i in range(order)]),
        "JETS": statements(
            [sp.diff(y, t, k) for k in range(order + 1)], [f"y[{i}]" for i in range(order + 1)]
        ),
        "FOLLOW": statements(follow(model, z), [f"r[{i}]" for i in range(order)]),
        "TRANSITION": repr(model.transition),
        "PERIOD": repr(period),
        "DELAY": repr(delay),
        "HORIZON": repr(horizon),
        "WIDTHS": listed(design.omega),
        "NOISE": listed(noise),
        "LOW": listed(low for low, _ in box),
        "HIGH": listed(high for _, high in box),
        "KS": listed(shape.k for shape in design.gains),
        "MS": listed(shape.M for shape in design.gains),
        "EPSILONS": listed(shape.epsilon for shape in design.gains),
        "CS": listed(shape.c for shape in design.gains),
        "NS": listed(shape.N for shape in design.gains),
        "LEAST": listed([low for low, _ in plant.ranges] or [0]),
        "MOST": listed([high for _, high in plant.ranges] or [0]),
        "ORDER": str(order),
        "COUNT": str(len(plant.parameters)),
        "NAME": design.spec.name,
    }
    return re.sub("@([A-Z]+)@", lambda found: words[found[1]], LOOP)


def plant_text(case: str) -> str:
    noise, period, delay, _ = CASES[case]
    text = (PLANTS / f"nominal_{case.removesuffix('_box')}.yaml").read_text(encoding="utf-8")
    if case == BOX:
        point = "initial: {x1: 0.2, x2: 0, x3: 0}"
        assert point in text
        text = text.replace(point, "initial: {x1: [0.1, 0.3], x2: [-0.2, 0.2], x3: [-0.1, 0.1]}")
    states = text.partition("states: [")[2].partition("]")[0].split(", ")
    bounds = ", ".join(f"{name}: {bound!r}" for name, bound in zip(states, noise, strict=True))
    return text.replace(
        "synthesis:",
        f"measurement: {{noise: {{{bounds}}}}}\n"
        f"sampling: {{period: {period!r}, delay: {delay!r}}}\n"
        f"simulation: {{horizon: {20 * period!r}, period: {period!r}}}\n"
        "synthesis:",
    )


@pytest.fixture(scope="module", params=[*CASES] if EVERY else [SAMPLE])
def loop(request, tmp_path_factory):
    """The design and its compiled loop: (runs, widening of the errors, loudness) -> rows."""
    base = tmp_path_factory.mktemp(request.param)
    plant, folder = base / "plant.yaml", base / "out"
    plant.write_text(plant_text(request.param), encoding="utf-8")
    assert main([str(plant), "--out", str(folder), "--json"]) == 0
    assert json.loads((folder / "manifest.json").read_text("utf-8"))["status"] == "certified"
    design = restore(folder)
    source, program = base / "loop.c", base / "loop"
    source.write_text(loop_text(design, request.param), encoding="utf-8")
    code = folder / "c"
    name = design.spec.name
    command = [
        "gcc",
        "-std=c99",
        "-O2",
        "-Wall",
        "-Werror",
        "-ffp-contract=off",
        f"-I{code}/include",
    ]
    command += ["-o", str(program), str(source), str(code / "src" / f"{name}.c"), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr

    def run(runs: int, widening: float, loudness: float):
        words = [str(program), str(runs), repr(widening), repr(loudness)]
        output = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        return [[float(word) for word in line.split()] for line in output.splitlines()]

    return request.param, design, run


def test_no_adversary_leaves_the_tube_or_exceeds_the_peak_input(loop):
    _, design, run = loop
    rows = run(RUNS, 1.0, 1.0)
    assert len(rows) == RUNS
    assert {row[0] for row in rows} == set(range(6))
    assert [row for row in rows if row[1] != 0.0] == []
    assert max(row[2] for row in rows) <= design.bounds.U
    assert all(ratio < 1.0 for row in rows for ratio in row[3:])
    # They do try: an adversary that moved nothing would prove nothing.
    assert max(max(row[3:]) for row in rows) > 0.05


def test_what_nothing_disturbs_stays_on_the_center(loop):
    _, design, run = loop
    quiet = run(6, 0.0, 0.0)
    tried = run(6, 1.0, 1.0)
    worst = [max(row[3 + i] for row in quiet) for i in range(design.plant.order)]
    disturbed = [max(row[3 + i] for row in tried) for i in range(design.plant.order)]
    # Only the hold moves the errors then: the two ways to compute the center agree.
    assert all(a < b for a, b in zip(worst, disturbed, strict=True))
    assert worst[0] < 0.05


def test_a_far_larger_error_of_the_model_is_seen_to_leave_the_tube(loop):
    case, _, run = loop
    # The levitation's model is known: there the noise is what the certificate does not cover.
    widening, loudness = (1.0, 1e3) if case == "levitation" else (30.0, 1.0)
    rows = run(6, widening, loudness)
    assert max(max(row[3:]) for row in rows) > 1.0
    assert any(row[1] > 0.0 for row in rows)
