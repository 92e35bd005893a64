"""The chain of a certificate as claims: each constant from those before it, then the theorem's."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from bfppc_synth.certificate import checker
from bfppc_synth.interop.claims import (
    Claim,
    Relation,
    Term,
    Variable,
    apply,
    difference,
    number,
    power,
    product,
    quotient,
    symbol,
    total,
)

if TYPE_CHECKING:
    from bfppc_synth.certificate.checker import Gain, Obligation, Obligations
    from bfppc_synth.interop.claims import Tree


def variables_of(
    ranges: tuple[tuple[str, checker.Interval], ...], tree: Any
) -> tuple[Variable, ...]:
    """Return the variables that an expression has, with their ranges."""
    used = checker.symbols(tree)
    return tuple(
        Variable(name=name, lower=_exact(low), upper=_exact(high))
        for name, (low, high) in ranges
        if name in used
    )


def _exact(end: int) -> Fraction:
    return Fraction(end, checker.ONE)


def _phi(gain: Gain, e: Tree) -> Term:
    """Shape phi: k e + M tanh(M e / epsilon) + c e^N, without the terms that are 0."""
    parts: list[Tree] = []
    if gain.k:
        parts.append(product(number(gain.k), e))
    if gain.M:
        bent = apply("tanh", product(number(gain.M / gain.epsilon), e))
        parts.append(product(number(gain.M), bent))
    if gain.c:
        parts.append(product(number(gain.c), power(e, gain.N)))
    return total(*parts)


def _slope(gain: Gain, e: Tree) -> Term:
    parts: list[Tree] = [number(gain.k)] if gain.k else []
    if gain.M:
        bent = apply("tanh", product(number(gain.M / gain.epsilon), e))
        flat = difference(number(1), power(bent, 2))
        parts.append(product(number(gain.M * gain.M / gain.epsilon), flat))
    if gain.c:
        parts.append(product(number(gain.c * gain.N), power(e, gain.N - 1)))
    return total(*parts)


def _spread(gain: Gain, p: Tree, eta: Tree) -> Term:
    """Lambda of docs/theory.md section 3."""
    parts: list[Tree] = []
    if gain.k:
        parts.append(product(number(gain.k), eta))
    if gain.M:
        bent = apply("tanh", product(number(gain.M / (2 * gain.epsilon)), eta))
        parts.append(product(number(2 * gain.M), bent))
    if gain.c:
        grown = difference(power(total(p, eta), gain.N), power(p, gain.N))
        parts.append(product(number(gain.c), grown))
    return total(*parts)


class Chain:
    """The constants of docs/theory.md sections 2 and 3, each from those before it.

    A constant stands in later claims as the end of its enclosure that the theorem uses.
    """

    def __init__(self, obligations: Obligations) -> None:
        self.all = obligations
        self.states = obligations.problem.states
        self.last = len(self.states) - 1
        self.unified = obligations.problem.method == "unified"

    def up(self, key: str, i: int | None = None) -> Term:
        """Upper end of a constant."""
        return number(self._upper(key if i is None else f"{key}[{self.states[i]}]"))

    def _upper(self, key: str) -> Fraction:
        return _exact(self.all.enclosures[key][1])

    def p(self, i: int) -> Term:
        """Tube half-width, exact."""
        return number(self.all.half_widths[i])

    def least(self, i: int) -> Term:
        """Lower end of g_min."""
        return number(_exact(self.all.enclosures[f"g_min[{self.states[i]}]"][0]))

    def constants(self, i: int) -> list[Claim]:
        """Box, majorants, D, A, B, eta and Lambda of one state."""
        state, gain, j = self.states[i], self.all.gains[i], i + 1
        low, high = (number(_exact(end)) for end in self.all.box[state])
        width = total(self.p(i), self.up("A", i - 1)) if i else self.p(i)
        start = number(_exact(self.all.enclosures[f"r_lower[{state}]"][0]))
        reach = f"the reachable box of {state} holds r_{j} and p_{j} + A_{i} around it"
        claims = [
            self._at_most(f"box_upper[{state}]", reach, total(self.up("r_upper", i), width), high),
            self._at_most(f"box_lower[{state}]", reach, low, difference(start, width)),
            *self._majorants(i),
        ]
        load = [self.up("W", i)] + ([self.up("B", i - 1)] if i else [])
        claims.append(
            self._at_most(f"D[{state}]", f"D_{j} = W_{j} + B_{i}", total(*load), self.up("D", i))
        )
        force = _phi(gain, self.p(i))
        claims.append(
            self._at_most(f"A[{state}]", f"A_{j} = phi_{j}(p_{j})", force, self.up("A", i))
        )
        if i < self.last:
            claims.append(self._coupled(i))
        if self.unified:
            claims += self._measured(i)
        return claims

    def _majorants(self, i: int) -> list[Claim]:
        channel, state, j = self.all.problem.channels[i], self.states[i], i + 1
        force = channel.f_bound if channel.f_bound is not None else channel.f
        largest = channel.g_bound if channel.g_bound is not None else channel.g
        least = channel.g_min if channel.g_min is not None else channel.g
        f_star, rate, whole = (self._upper(f"{key}[{state}]") for key in ("f_star", "rate", "W"))
        claims = []
        zero, one = checker.NOTHING, checker.UNIT
        sizes = (
            ("f_star", force or zero, f_star, f"sup of f_{j}* over the box"),
            ("disturbance", channel.disturbance, whole - f_star - rate, f"sup of |d_{j}|"),
            ("G", largest or one, self._upper(f"G[{state}]"), f"sup of g_{j}* over the box"),
        )
        for key, node, bound, words in sizes:
            size = apply("abs", node)
            claims.append(self._over_box(f"{key}[{state}]", words, size, number(bound), node))
        smallest = least or one
        words = f"g_{j} is at least its g_min over the box"
        claims.append(self._over_box(f"g_least[{state}]", words, self.least(i), smallest, smallest))
        parts = (number(f_star), number(whole - f_star - rate), number(rate))
        words = f"W_{j} = f_{j}* + disturbance + sup|dr_{j}|"
        claims.append(self._at_most(f"W[{state}]", words, total(*parts), self.up("W", i)))
        return claims

    def _over_box(self, name: str, words: str, lhs: Tree, rhs: Tree, node: Any) -> Claim:
        ranges = tuple(sorted(self.all.box.items()))
        return replace(self._at_most(name, words, lhs, rhs), variables=variables_of(ranges, node))

    def _coupled(self, i: int) -> Claim:
        """B: sup of phi'(s) (D + G (p_next + s_next + phi(s))) over 0 <= s <= p."""
        gain, j, s = self.all.gains[i], i + 1, symbol("s")
        ahead = total(self.p(j), self.up("s", i), _phi(gain, s))
        pull = total(self.up("D", i), product(self.up("G", i), ahead))
        claim = self._at_most(
            f"B[{self.states[i]}]",
            f"B_{j} bounds phi_{j}'(s) (D_{j} + G_{j} (p_{j + 1} + s_{j + 1} + phi_{j}(s)))",
            product(_slope(gain, s), pull),
            self.up("B", i),
        )
        side = Variable(name="s", lower=Fraction(0), upper=self.all.half_widths[i])
        return replace(claim, variables=(side,))

    def _measured(self, i: int) -> list[Claim]:
        problem, state, j = self.all.problem, self.states[i], i + 1
        factor = 2 if problem.anchor == "exact" else 1
        parts = [
            product(number(factor), number(_exact(problem.delta[i][1]))),
            number(_exact(self.all.rounding[i])),
        ] + ([self.up("Lambda", i - 1)] if i else [])
        eta = self.up("eta", i)
        words = f"eta_{j}: resolution, rounding and what the step before hands on"
        spread = _spread(self.all.gains[i], self.p(i), eta)
        claims = [self._at_most(f"eta[{state}]", words, total(*parts), eta)]
        if i < self.last:
            words = f"Lambda_{j} bounds |phi_{j}(e + d) - phi_{j}(e)| for |d| at most eta_{j}"
            claims.append(self._at_most(f"Lambda[{state}]", words, spread, self.up("Lambda", i)))
        return claims

    def peak(self) -> list[Claim]:
        """U, V and zeta."""
        i = self.last
        e = total(self.p(i), self.up("eta", i)) if self.unified else self.p(i)
        force = total(_phi(self.all.gains[i], e), self.up("delta_u"))
        claims = [self._at_most("U", "the peak input", force, self.up("U"))]
        if self.unified:
            speed = total(self.up("D", i), product(self.up("G", i), self.up("U")))
            late = total(self.up("eta", i), product(self.up("hold"), self.up("V")))
            claims.append(self._at_most("V", "the largest rate of e_n", speed, self.up("V")))
            words = "zeta: total error of the applied e_n"
            claims.append(self._at_most("zeta", words, late, self.up("zeta")))
        return claims

    def inequality(self, obligation: Obligation) -> list[Claim]:
        """State what an obligation compares, its constants substituted."""
        family, _, rest = obligation.id.partition("[")
        if family in ("U0", "U1", "U2", "U2'", "T2"):
            i = self.states.index(rest[:-1])
            pairs = getattr(self, f"_{family.replace(chr(39), '_prime').lower()}")(i)
        else:
            pairs = [
                (number(_exact(entry.rhs[1])), number(_exact(entry.lhs[0])))
                for entry in obligation.comparisons
            ]
        claims = []
        for index, (smaller, larger) in enumerate(pairs, 1):
            strict = obligation.comparisons[min(index, len(obligation.comparisons)) - 1].relation
            place = f"[{rest}" if rest else ""
            mark = "" if index == 1 and family != "g_min" else f".{index}"
            claims.append(
                Claim(
                    id=f"{'g_positive' if family == 'g_min' else family + mark}{place}",
                    statement=obligation.statement,
                    lhs=smaller,
                    relation=Relation.LESS if strict == ">" else Relation.AT_MOST,
                    rhs=larger,
                )
            )
        return claims

    def _demand(self, i: int) -> Term:
        """F*_i = D_i / g_min,i + p_{i+1} + s_{i+1}."""
        share = quotient(self.up("D", i), self.least(i))
        return total(share, self.p(i + 1), self.up("s", i)) if i < self.last else share

    def _u0(self, i: int) -> list[tuple[Tree, Tree]]:
        return [(self.up("eta", i), self.p(i))]

    def _u1(self, i: int) -> list[tuple[Tree, Tree]]:
        return [(self._demand(i), _phi(self.all.gains[i], self.p(i)))]

    def _u2(self, i: int) -> list[tuple[Tree, Tree]]:
        zeta = self.up("zeta")
        force = _phi(self.all.gains[i], difference(self.p(i), zeta))
        return [(total(self._demand(i), self.up("delta_u")), force), (zeta, self.p(i))]

    def _u2_prime(self, i: int) -> list[tuple[Tree, Tree]]:
        hold, error = self.up("hold"), self.up("delta_u")
        drift = total(self.up("D", i), product(self.up("G", i), error))
        rest = difference(difference(self.p(i), self.up("eta", i)), product(hold, drift))
        late = total(self.up("eta", i), product(number(2), hold, self.up("V")))
        force = _phi(self.all.gains[i], rest)
        return [(total(self._demand(i), error), force), (late, self.p(i))]

    def _t2(self, i: int) -> list[tuple[Tree, Tree]]:
        gain, p = self.all.gains[i], self.p(i)
        parts: list[Tree] = [
            product(number(gain.k), p),
            number(gain.M),
            product(number(gain.c), power(p, gain.N)),
        ]
        extra = quotient(number(Fraction(2785, 10000) * gain.epsilon), p)
        demand = total(self._demand(i), extra) if gain.M else self._demand(i)
        return [(demand, total(*parts))]

    def _at_most(self, name: str, words: str, lhs: Tree, rhs: Tree) -> Claim:
        return Claim(id=name, statement=words, lhs=lhs, relation=Relation.AT_MOST, rhs=rhs)
