"""What step answers, on both sides of every boundary of SPEC section 3."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from bfppc_synth.model.spec import Anchor

NAN, INF = math.nan, math.inf
OK, OUTSIDE, BAD_INPUT, BAD_TIME = range(4)


def above(value):
    return math.nextafter(value, INF)


@pytest.fixture
def module(handmade, module_of):
    return module_of(handmade.everyday())


@pytest.fixture
def started(module):
    controller = module.Controller()
    controller.step(10.0, [0.5, 0.0])
    assert controller.status == OK
    return controller


def test_the_class_says_what_it_is(module):
    controller = module.Controller
    assert controller.ORDER == 2
    assert controller.ACCURACY == 1.0
    assert controller.PERIOD == 1e-4
    assert controller.U_MAX == module.U_MAX
    assert {s.name: int(s) for s in module.Status} == {
        "OK": 0,
        "OUTSIDE": 1,
        "BAD_INPUT": 2,
        "BAD_TIME": 3,
    }


def test_the_command_is_zero_before_the_first_accepted_sample(module):
    controller = module.Controller()
    assert controller.step(0.0, [NAN, 0.0]) == 0.0
    assert controller.status == BAD_INPUT
    assert controller.step(3.0, [0.5, 0.0]) == pytest.approx(0.0, abs=1e-12)
    assert controller.status == OK


def test_a_refused_sample_latches_nothing(module):
    spoiled, fresh = module.Controller(), module.Controller()
    spoiled.step(-5.0, [INF, 0.0])
    spoiled.step(-5.0, [0.5, 0.0], NAN)
    spoiled.step(INF, [0.5, 0.0])
    for t in (0.0, 0.1):
        assert spoiled.step(t, [0.5, 0.1]) == fresh.step(t, [0.5, 0.1])


@pytest.mark.parametrize("bad", [NAN, INF, -INF])
@pytest.mark.parametrize("place", ["t", "x_1", "x_2", "y_d"])
def test_nan_and_infinity_hold_the_last_command(started, place, bad):
    held = started.step(10.2, [0.6, 0.1])
    values = {"t": 10.4, "x_1": 0.5, "x_2": 0.0, "y_d": 0.0, place: bad}
    u = started.step(values["t"], [values["x_1"], values["x_2"]], values["y_d"])
    assert (u, started.status) == (held, BAD_INPUT)
    assert u != 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_state_beyond_four_times_its_reach_is_refused(module, started, sign):
    for index, limit in enumerate((4.0 * (1.5 + 0.001), 4.0 * (3.0 + 0.01))):
        x = [0.0, 0.0]
        x[index] = sign * limit
        started.step(11.0, x)
        assert started.status in (OK, OUTSIDE)
        x[index] = sign * above(getattr(module, f"x_limit_{index + 1}"))
        assert abs(x[index]) == pytest.approx(limit)
        started.step(11.0, x)
        assert started.status == BAD_INPUT


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_reference_beyond_its_bound_is_refused(started, sign):
    started.step(11.0, [0.0, 0.0], sign * 1.01)
    assert started.status in (OK, OUTSIDE)
    started.step(11.0, [0.0, 0.0], sign * 1.0100001)
    assert started.status == BAD_INPUT


def test_time_may_stand_still_but_not_go_back(started):
    started.step(11.0, [0.5, 0.0])
    for t, status in ((11.0, OK), (math.nextafter(11.0, 0.0), BAD_TIME), (9.0, BAD_TIME)):
        started.step(t, [0.5, 0.0], 0.2)
        assert (started.status == BAD_TIME) == (status == BAD_TIME)


def test_a_refused_time_does_not_move_the_clock(started):
    started.step(11.0, [0.5, 0.0])
    started.step(2e6, [0.5, 0.0])
    assert started.status == BAD_TIME
    started.step(11.0, [0.5, 0.0])
    assert started.status == OK


def test_the_elapsed_time_ends_after_a_million_seconds(module):
    controller = module.Controller()
    controller.step(-3.0, [0.5, 0.0])
    controller.step(1e6 - 3.0, [0.5, 0.0])
    assert controller.status in (OK, OUTSIDE)
    controller.step(1e6 - 2.999, [0.5, 0.0])
    assert controller.status == BAD_TIME


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_time_too_coarse_for_the_period_is_refused(module, sign):
    limit = module.time_limit
    assert math.ulp(limit) > 1e-4 / 16 >= math.ulp(math.nextafter(limit, 0.0))
    for t, status in ((sign * math.nextafter(limit, 0.0), OK), (sign * limit, BAD_TIME)):
        controller = module.Controller()
        assert controller.step(t, [0.5, 0.0]) == pytest.approx(0.0, abs=1e-12)
        assert controller.status == status


def test_without_a_period_any_time_may_be_the_first(handmade, module_of):
    controller = module_of(handmade.kinked()).Controller()
    controller.step(1e300, [0.5])
    assert controller.status == OK
    controller.step(1e300, [0.5])
    assert controller.status == OK


def test_a_first_sample_outside_the_initial_set_marks_the_whole_run(module):
    controller = module.Controller()
    for x_1, status in ((1.501, OK), (1.5011, OUTSIDE), (-1.501, OK), (-1.5011, OUTSIDE)):
        controller.reset()
        for t in (0.0, 1e-4):
            controller.step(t, [x_1, 0.0])
            assert controller.status == status
    controller.reset()
    controller.step(0.0, [0.5, 1.011])
    assert controller.status == OUTSIDE


def test_an_exact_start_needs_no_room_for_rounding(handmade, module_of):
    module = module_of(handmade.make_design(initial=(("1/10", "1/10"), ("0", "0"))))
    for x_1, status in ((0.1, OK), (above(0.1), OUTSIDE), (math.nextafter(0.1, 0.0), OK)):
        controller = module.Controller()
        controller.step(0.0, [x_1, 0.0])
        # 1/10 lies between two binary64 numbers: both are accepted, the next ones are not.
        assert controller.status == status


def test_a_quantized_start_at_the_very_edge_is_inside(handmade, module_of):
    design = handmade.make_design(
        initial=(("1/5", "1/5"), ("0", "0")), delta=(0.1, 0.1), eta=(0.1, 0.1)
    )
    controller = module_of(design).Controller()
    edge = 0.2 + 0.1
    assert edge > 0.3  # what rounding makes of the sum
    controller.step(0.0, [edge, 0.0])
    assert controller.status == OK


def test_the_exact_anchor_does_not_widen_the_initial_set(handmade, module_of):
    # delta in the chain is (1 + rho_M) delta_0 = 0.02.
    design = handmade.make_design(
        initial=(("0", "0"), ("0", "0")), delta=(0.02, 0.02), anchor=Anchor.EXACT
    )
    controller = module_of(design).Controller()
    for x_1, status in ((0.01, OK), (0.011, OUTSIDE)):
        controller.reset()
        controller.step(0.0, [x_1, 0.0])
        assert controller.status == status


def test_an_error_outside_its_tube_is_reported_and_the_law_still_applied(handmade, module_of):
    module = module_of(
        handmade.make_design(
            gains=(handmade.shape(k=2.0),),
            p=(0.05,),
            initial=(("0", "0"),),
            reference=sp.Integer(0),
            delta=(0.01,),
            eta=(0.01,),
        )
    )
    controller = module.Controller()
    controller.step(0.0, [0.0])
    for e, status in ((0.06, OK), (0.0601, OUTSIDE), (-0.06, OK), (-0.0601, OUTSIDE)):
        u = controller.step(4.0, [e])
        assert controller.status == status
        assert u == pytest.approx(-2.0 * e, rel=0.01)
        assert abs(u) <= module.U_MAX
    assert controller.step(4.0, [0.0]) == 0.0
    assert controller.status == OK


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_command_is_clamped_to_the_certified_peak(module, started, sign):
    u = started.step(11.0, [sign * 6.0, sign * 12.0])
    assert (u, started.status) == (-sign * module.U_MAX, OUTSIDE)


def test_a_gain_so_large_that_products_overflow_still_gives_a_finite_command(handmade, module_of):
    huge = handmade.shape(k=1e200, M=1e200, c=1e200)
    module = module_of(handmade.make_design(gains=(huge, huge), p=(1.0, 1.0), X=(1e60, 1e60)))
    controller = module.Controller()
    controller.step(0.0, [0.0, 0.0])
    for x in ([1e60, 1e60], [-1e60, 1e60], [1e60, -1e60]):
        assert abs(controller.step(4.0, x)) <= module.U_MAX


def test_reset_forgets_everything(module):
    controller, fresh = module.Controller(), module.Controller()
    controller.step(50.0, [1.4, 0.9])
    controller.step(50.5, [1.2, 0.8])
    controller.reset()
    assert controller.status == OK
    for t in (0.0, 0.3, 0.3, 4.0):
        assert controller.step(t, [0.5, 0.1]) == fresh.step(t, [0.5, 0.1])


def test_instances_share_nothing(module):
    one, two, alone = module.Controller(), module.Controller(), module.Controller()
    for t in (0.0, 0.2, 0.4):
        one.step(t, [1.0, 0.5])
        assert two.step(t, [0.5, 0.1]) == alone.step(t, [0.5, 0.1])
    with pytest.raises(AttributeError):
        one.gain = 3.0


def test_a_passed_reference_is_used(module):
    given, compiled = module.Controller(), module.Controller()
    for t in (7.0, 7.25, 9.0):
        u = given.step(t, [0.5, 0.1], module.Controller.reference(t - 7.0))
        assert u == compiled.step(t, [0.5, 0.1])
    assert given.step(9.5, [0.5, 0.1], 0.3) != compiled.step(9.5, [0.5, 0.1])


def test_a_run_time_reference_is_required(handmade, module_of):
    module = module_of(handmade.run_time())
    controller = module.Controller()
    assert not hasattr(module.Controller, "reference")
    assert controller.step(0.0, [0.0, 0.0, 0.0]) == 0.0
    assert controller.status == BAD_INPUT
    controller.step(0.0, [0.0, 0.0, 0.0], 0.1)
    assert controller.status == OK
    held = controller.step(0.1, [0.3, 0.0, 0.0], 0.1)
    assert controller.step(0.2, [0.3, 0.0, 0.0]) == held != 0.0
    assert controller.status == BAD_INPUT


def test_a_first_offset_beyond_its_bound_is_outside(handmade, module_of):
    # offset 1/2, delta_0 of x_1 0.01
    controller = module_of(handmade.run_time()).Controller()
    for y_d, status in ((0.51, OK), (0.52, OUTSIDE), (-0.51, OK), (-0.52, OUTSIDE)):
        controller.reset()
        controller.step(0.0, [0.0, 0.0, 0.0], y_d)
        assert controller.status == status


def test_integers_are_numbers(module):
    whole, real = module.Controller(), module.Controller()
    for t in (0, 1, 2, 90_000):
        assert whole.step(t, [1, 0], 0) == real.step(float(t), [1.0, 0.0], 0.0)
        assert whole.step(t, (1, 0)) == real.step(float(t), (1.0, 0.0))


def test_a_wrong_number_of_states_is_an_error(started):
    with pytest.raises(ValueError, match="unpack"):
        started.step(11.0, [0.5])
    with pytest.raises(ValueError, match="unpack"):
        started.step(11.0, [0.5, 0.0, 0.0])


def test_the_law_is_the_one_of_the_theory(handmade, module_of):
    design = handmade.everyday()
    controller = module_of(design).Controller()
    x_0, (first, second) = (1.2, 0.7), design.gains
    controller.step(2.0, x_0)
    for s, x in ((0.25, (1.1, 0.6)), (1.5, (0.9, -0.2)), (3.0, (0.2, 0.1)), (3.5, (-0.3, 0.2))):
        rho = 0.5 * (1.0 + math.cos(s)) if s < math.pi else 0.0
        e_1 = x[0] - math.sin(s) - rho * x_0[0]
        e_2 = x[1] - rho * x_0[1] + handmade.phi(first, e_1)
        u = max(-controller.U_MAX, min(controller.U_MAX, -handmade.phi(second, e_2)))
        assert controller.step(2.0 + s, x) == pytest.approx(u, rel=1e-12)
