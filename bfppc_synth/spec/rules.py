"""What the values of a plant file must be to each other, where no bound has to be computed."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Final

from bfppc_synth.expressions.resolution import lower_bound, resolution, upper_bound
from bfppc_synth.model.spec import (
    Anchor,
    BoundsKind,
    CenterKind,
    Form,
    Method,
    Objective,
    QuantizerKind,
    ReferenceKind,
)
from bfppc_synth.spec import build
from bfppc_synth.spec.channels import check_channel, check_reference
from bfppc_synth.spec.objective import check_objective, objective_notes, sought
from bfppc_synth.spec.shapes import check_quantizer, check_rho
from bfppc_synth.spec.staging import check_stages, unused_stages
from bfppc_synth.spec.theorem1 import check_theorem1, unused_theorem1

if TYPE_CHECKING:
    from bfppc_synth.model.spec import QuantizerSpec, SynthesisSpec
    from bfppc_synth.spec.notebook import Notebook

MOST_STEPS: Final = 50_000_000
# What the controller's time axis holds, from its resolution to its end [s].
LEAST_TRANSITION: Final = Fraction(1, 10**6)
MOST_TRANSITION: Final = Fraction(10**6)


def check_rules(book: Notebook, states: tuple[str, ...]) -> None:
    """Note every contradiction among the readable values."""
    for state in states:
        check_channel(book, state)
    check_reference(book, states)
    for path in sorted({book.of_state("performance.rho", state) for state in states}):
        check_rho(book, path)
    for path in sorted({book.of_state("measurement.quantizer", state) for state in states}):
        check_quantizer(book, path)
    if not states:
        return
    synthesis = build.build_synthesis(book, states)
    _check_resolution(book, states, synthesis)
    check_objective(book, states, synthesis)
    _check_synthesis(book, states, synthesis)
    _check_nominal(book, states, synthesis)
    check_stages(book, states, synthesis)
    check_theorem1(book, states, synthesis)
    printed = synthesis.form is Form.PRINTED and synthesis.method is Method.THEOREM3
    if synthesis.method is Method.THEOREM2 or printed:
        _check_exact_and_continuous(book, states, synthesis.method)
    _check_actuator(book)
    _check_simulation(book, states)


def _number(value: Fraction | float) -> str:
    return f"{float(value):.6g}"


def _origin(quantizer: QuantizerSpec, noise: Fraction) -> str:
    parts = []
    if quantizer.kind is not QuantizerKind.NONE and quantizer.step is not None:
        parts.append(f"quantizer step {quantizer.step.text}")
    if noise:
        parts.append(f"noise {_number(noise)}")
    return f" ({', '.join(parts)})" if parts else ""


def _check_resolution(book: Notebook, states: tuple[str, ...], synthesis: SynthesisSpec) -> None:
    measurement = build.build_measurement(book, states)
    exact = synthesis.anchor is Anchor.EXACT
    for index, state in enumerate(states):
        path = f"synthesis.p.{state}" if index else "performance.accuracy"
        width = book.constant(path)
        if width is None:
            continue
        quantizer = measurement.quantizers[index]
        delta = resolution(quantizer, measurement.noise[index])
        if sought(synthesis) is Objective.RESOLUTION:
            # The steps of the file are proportions then: only the noise is given.
            delta = upper_bound(measurement.noise[index])
        # The paper's errors contain rho times the start's own error: twice the resolution.
        least = 2 * delta if exact else delta
        if upper_bound(width) > least:
            continue
        twice = "twice " if exact else ""
        side = "below" if upper_bound(width) < least else "equal to"
        origin = _origin(quantizer, upper_bound(measurement.noise[index]))
        cure = "or a finer measurement"
        if quantizer.kind is QuantizerKind.UNIFORM and quantizer.dead_zone is None and not exact:
            step = 2 * (upper_bound(width) - upper_bound(measurement.noise[index]))
            if step > 0:
                cure = f"or a quantizer step below {_number(step)}"
        what = "an accuracy" if not index else "a half-width"
        book.blame_path(
            path,
            f"{width.text} is {side} {twice}the resolution of {state}, {_number(least)}{origin}: "
            "no gain can hold a tube narrower than what is measured",
            f"choose {what} above {_number(least)}, {cure}",
        )


def _check_synthesis(book: Notebook, states: tuple[str, ...], synthesis: SynthesisSpec) -> None:
    path = "synthesis"
    if synthesis.form is Form.PRINTED and synthesis.method is Method.UNIFIED:
        book.blame_path(
            f"{path}.form",
            "unified has no printed form: the paper does not contain it",
            "use `method: theorem2`, or `form: sound`",
        )
    if synthesis.bounds is BoundsKind.TIGHT and synthesis.method is not Method.UNIFIED:
        book.blame_path(
            f"{path}.bounds",
            f"tight bounds are proved for method unified, not for {synthesis.method}",
            "use `method: unified`, or `bounds: termwise`",
        )
    first = f"{path}.p.{states[0]}"
    if book.has(first):
        book.blame_path(
            first,
            f"p of {states[0]}, the first state, is performance.accuracy",
            "give it there, and remove it here",
        )


def _check_nominal(book: Notebook, states: tuple[str, ...], synthesis: SynthesisSpec) -> None:
    """Note what center nominal has no theorem for, or cannot follow (docs/theory.md section 4)."""
    if synthesis.center is not CenterKind.NOMINAL:
        return
    other = "or use `center: performance`"
    if synthesis.method is not Method.UNIFIED:
        book.blame_path(
            "synthesis.center",
            f"{synthesis.method} is proved for center performance, not for nominal",
            f"use `method: unified`, {other}",
        )
    elif synthesis.anchor is Anchor.EXACT:
        book.blame_path(
            "synthesis.anchor",
            "center nominal starts from what is measured, and the exact anchor from what is true",
            f"use `anchor: latched`, {other}",
        )
    transition = book.constant("performance.transition")
    if transition is not None and not (
        lower_bound(transition) >= LEAST_TRANSITION and upper_bound(transition) <= MOST_TRANSITION
    ):
        book.blame_path(
            "performance.transition",
            f"{transition.text} s is outside 1e-6 to 1e6 s, which a certificate covers",
            "choose one from 1e-6 to 1e6 s, or leave it out, so that it is chosen",
        )
    reference, highest = build.build_reference(book), len(states) + 1
    needed = f"center nominal needs bounds on the reference and its first {highest} derivatives"
    if reference.kind is ReferenceKind.DECLARED:
        book.blame_path(
            "reference",
            f"{needed}, and the file declares two",
            f"give the reference as an expression without bounds, {other}",
        )
    elif reference.kind is ReferenceKind.RUNTIME and 0 < len(reference.bounds) < highest + 1:
        book.blame_path(
            "reference.bounds",
            f"{needed}, {highest + 1} in all, and there are {len(reference.bounds)}",
            f"give all {highest + 1}, {other}",
        )


def _check_exact_and_continuous(book: Notebook, states: tuple[str, ...], method: Method) -> None:
    fix = "use `method: unified`, which covers it"
    measurement = build.build_measurement(book, states)
    found: set[str] = set()
    for state, quantizer, noise in zip(
        states, measurement.quantizers, measurement.noise, strict=True
    ):
        if quantizer.kind is not QuantizerKind.NONE:
            found.add(book.of_state("measurement.quantizer", state))
        if upper_bound(noise) > 0:
            found.add(book.of_state("measurement.noise", state))
    for path in sorted(found):
        book.blame_path(path, f"{method} is proved for exact measurement", fix)
    for path, what in (
        ("sampling.period", "continuous measurement"),
        ("sampling.delay", "a loop without delay"),
        ("actuator.error", "an exact actuator"),
    ):
        number = book.constant(path)
        if number is not None and upper_bound(number) > 0:
            book.blame_path(path, f"{method} is proved for {what}, not for {number.text}", fix)


def _check_actuator(book: Notebook) -> None:
    limit, error = book.constant("actuator.limit"), book.constant("actuator.error")
    if limit is None or error is None:
        return
    if lower_bound(error) >= upper_bound(limit):
        book.blame_path(
            "actuator.error",
            f"the error {error.text} is not below the limit {limit.text}: the peak input "
            "contains it",
            "give both in the unit of u",
        )


def _check_simulation(book: Notebook, states: tuple[str, ...]) -> None:
    simulation = build.build_simulation(book, build.build_measurement(book, states))
    sampled = book.constant("sampling.period")
    step = simulation.period
    place = "simulation.period" if book.has("simulation.period") else "simulation.horizon"
    if sampled is not None and 0 < sampled.approximate < step:
        step, place = sampled.approximate, "sampling.period"
    steps = simulation.horizon / step
    if steps > MOST_STEPS:
        book.blame_path(
            place,
            f"a run of {_number(simulation.horizon)} s in steps of {_number(step)} s takes "
            f"{steps:.2g} steps, more than {MOST_STEPS:.2g}",
            f"choose a horizon below {_number(MOST_STEPS * step)}",
        )
    elif steps < 1:
        book.blame_path(
            place,
            f"the step {_number(step)} s is longer than the horizon "
            f"{_number(simulation.horizon)} s",
            "choose a longer horizon or a shorter step",
        )


def unused_keys(book: Notebook, states: tuple[str, ...]) -> tuple[str, ...]:
    """Name the keys that the chosen method and center read but do not use."""
    synthesis = build.build_synthesis(book, states)
    notes = []
    nominal = synthesis.center is CenterKind.NOMINAL
    unused = "performance.rho" if nominal else "performance.transition"
    if book.has(unused):
        notes.append(f"{unused} is not used with center {synthesis.center}")
    paths = sorted({book.of_state("performance.rho", state) for state in states})
    if synthesis.form is Form.SOUND and not nominal:
        notes.extend(
            f"{path}.rate_bound is not used with form sound: the true bound is"
            for path in paths
            if book.has(f"{path}.rate_bound")
        )
    notes.extend(objective_notes(book, synthesis))
    notes.extend(unused_stages(book, synthesis))
    notes.extend(unused_theorem1(book, states, synthesis))
    reference = build.build_reference(book)
    used = len(states) + 2 if nominal else 2
    if reference.kind is ReferenceKind.RUNTIME and len(reference.bounds) > used:
        words = str(used) if nominal else "two"
        notes.append(f"reference.bounds: center {synthesis.center} uses the first {words}")
    return tuple(notes)
