"""The contact rule: exactly 0.9372, one slow motor stops all, and free motion never stops."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miburi.errors import InputError
from miburi.robot import JOINTS, iphonoid
from miburi.robot.guards import Guards
from miburi.safety.contact import LAG_DOUBT, PAPER_PERIOD, PAPER_RATIO, Contact, Rule, Sign, Watch
from miburi.safety.printed import PrintedRule, is_slow_as_printed
from miburi.safety.profile import FINE, SECOND, Profile

EIGHT = np.ones(8, dtype=np.int64)
#: Guards of a usual size; the trials test those of the robot itself.
RULE = Rule(
    Guards(
        lag=30_000 * EIGHT,
        slack=6 * EIGHT,
        least=16 * EIGHT,
        behind=50 * EIGHT,
        ahead=40 * EIGHT,
        arrival=20 * EIGHT,
    )
)
#: Guards that grant nothing: the bare ratio decides.
STRICT = Rule(
    Guards(
        lag=0 * EIGHT,
        slack=0 * EIGHT,
        least=EIGHT,
        behind=9999 * EIGHT,
        ahead=9999 * EIGHT,
        arrival=9999 * EIGHT,
    )
)


def watch(
    rule: Rule, distance: int = 1000, speed: int = 1000, acceleration: int = 1_000_000
) -> Watch:
    profile = Profile.plan(distance * EIGHT, FINE * speed * EIGHT, acceleration * EIGHT)
    return Watch(rule, profile, 0 * EIGHT, EIGHT)


def follow(w: Watch, time: int, lag: int = 0) -> np.ndarray:
    """Return the positions of motors that follow their profile with a lag, in whole steps."""
    return w.start + w.direction * (w.profile.position(time - lag) // FINE)


def test_the_papers_numbers() -> None:
    assert (PAPER_PERIOD, PAPER_RATIO) == (100_000, 9372)
    rule = Rule.of(iphonoid())
    assert (rule.period, rule.ratio) == (100_000, 9372)


@pytest.mark.parametrize(
    ("number", "value"),
    [("ratio", 20_000), ("ratio", -5), ("ratio", 0.9372), ("period", 0), ("period", 0.1)],
)
def test_no_rule_has_a_number_that_cannot_be(number: str, value: float) -> None:
    with pytest.raises(InputError, match=f"the rule's {number} must be .*; got {value}"):
        replace(RULE, **{number: value})


@pytest.mark.parametrize("motor", range(8))
def test_the_ratio_decides_to_the_step(motor: int) -> None:
    """Of 10,000 expected steps 9372 are enough and 9371 are not, for each motor alone."""
    for travelled, stops in [(9371, True), (9372, False), (9373, False), (10_000, False)]:
        w = watch(STRICT, distance=100_000, speed=100_000, acceleration=10**9)
        due = w.profile.position(PAPER_PERIOD) // FINE
        assert abs(int(due[0]) - 10_000) <= 5  # the ramp takes a few steps
        scale = int(w.profile.position(PAPER_PERIOD)[0])
        positions, share = due.copy(), scale * travelled
        # In whole steps: just too few, or just enough.
        positions[motor] = share // (10_000 * FINE) if stops else -(-share // (10_000 * FINE))
        contact = w.look(positions, PAPER_PERIOD)
        assert (contact is not None) == stops
        if contact is not None:
            assert contact.motor == motor
            assert contact.name == JOINTS[motor]
            assert contact.sign is Sign.SPEED
            assert contact.ratio < 0.9372


def test_with_a_ratio_of_zero_no_motor_is_ever_slow() -> None:
    """This mutation shows that the tests above can fail."""
    w = watch(replace(STRICT, ratio=0))
    assert w.look(0 * EIGHT, 10 * PAPER_PERIOD) is None
    w = watch(STRICT)
    assert w.look(0 * EIGHT, 10 * PAPER_PERIOD) is not None


@given(
    st.integers(1, 3000),
    st.integers(20, 3900),
    st.integers(2000, 20_000),
    st.integers(-10_000, 10_000),
    st.integers(0, 99_999),
)
def test_a_free_motor_is_never_stopped(
    distance: int, speed: int, acceleration: int, jitter: int, phase: int
) -> None:
    """Its lag differs from the calibrated one by up to 3 ms; readings start at any phase."""
    w = watch(RULE, distance, speed, acceleration)
    lag = int(RULE.guards.lag[0]) + jitter * 3 // 10
    # With 3 ms more lag a fast motor is up to 12 steps short at first.
    generous = replace(RULE.guards, slack=20 * EIGHT)
    w = Watch(replace(RULE, guards=generous), w.profile, w.start, w.direction)
    end = int(w.profile.total.max()) + 3 * PAPER_PERIOD
    for time in range(phase, end, PAPER_PERIOD):
        assert w.look(follow(w, time, lag), time) is None
    assert w.arrived(follow(w, end, lag), end)


@given(st.integers(0, 7), st.integers(300, 3900), st.floats(0.0, 0.9), st.booleans())
def test_a_blocked_motor_stops_all_soon(motor: int, speed: int, when: float, back: bool) -> None:
    direction = -EIGHT if back else EIGHT
    profile = Profile.plan(1500 * EIGHT, FINE * speed * EIGHT, 13_000 * EIGHT)
    w = Watch(RULE, profile, 2000 * EIGHT, direction)
    blocked = int(when * profile.total[0])
    lag = int(RULE.guards.lag[0])
    contact = None
    for time in range(PAPER_PERIOD, int(profile.total[0]) + 4 * PAPER_PERIOD, PAPER_PERIOD):
        positions = follow(w, time, lag)
        positions[motor] = follow(w, min(time, blocked), lag)[motor]
        contact = w.look(positions, time)
        if contact is not None:
            assert contact.motor == motor
            assert time > blocked
            # One reading to see it, one more where a ramp makes the motion slow.
            assert time - blocked <= 3 * PAPER_PERIOD
            break
    missing = 1500 - int(profile.position(blocked - lag)[motor]) // FINE
    assert contact is not None or missing <= RULE.guards.arrival[motor]


def test_a_slow_motor_is_judged_over_a_longer_window() -> None:
    """At 50 steps/s a period brings 5 steps: it takes four periods to expect the least, 16."""
    w = watch(RULE, distance=400, speed=50)
    stops = [w.look(0 * EIGHT, k * PAPER_PERIOD) is not None for k in range(1, 8)]
    assert stops.index(True) >= 3
    w = watch(RULE, distance=400, speed=50)
    lag = int(RULE.guards.lag[0])
    for k in range(1, 80):
        assert w.look(follow(w, k * PAPER_PERIOD, lag), k * PAPER_PERIOD) is None


def test_backstop_tracking_sees_a_resting_motor_that_is_pushed() -> None:
    profile = Profile.plan(
        np.array([1000, 0, 0, 0, 0, 0, 0, 0]), FINE * 500 * EIGHT, 13_000 * EIGHT
    )
    behind, ahead = int(RULE.guards.behind[4]), int(RULE.guards.ahead[4])
    for pushed, stops in [(ahead, False), (ahead + 1, True), (-behind, False), (-behind - 1, True)]:
        w = Watch(RULE, profile, 0 * EIGHT, EIGHT)
        positions = follow(w, PAPER_PERIOD, int(RULE.guards.lag[0]))
        positions[4] = pushed
        contact = w.look(positions, PAPER_PERIOD)
        assert (contact is not None) == stops
        if contact is not None:
            assert (contact.motor, contact.sign) == (4, Sign.TRACKING)
            assert w.window is not None
            np.testing.assert_array_equal(w.window.judged, np.arange(8) == 4)
            assert (w.window.measured[4], w.window.expected[4]) == (pushed * FINE, 0)
            assert contact.length == w.window.length[4] == PAPER_PERIOD


@pytest.mark.parametrize("back", [False, True])
def test_the_tracking_guards_widen_with_the_speed(back: bool) -> None:
    """By what the motor travels in 2 ms at its top speed: 6 steps at 3000 steps/s."""
    generous = replace(RULE.guards, slack=200 * EIGHT)
    direction = -EIGHT if back else EIGHT
    for distance, top in [(2000, 3000), (75, 1000)]:
        profile = Profile.plan(distance * EIGHT, FINE * 3000 * EIGHT, 13_334 * EIGHT)
        assert (abs(profile.fastest - top * FINE) <= 2 * FINE).all()
        doubt = top * LAG_DOUBT // SECOND
        middle = int(profile.total[0]) // 2 + int(generous.lag[0])
        for sign, most in [(-1, RULE.guards.behind[0] + doubt), (1, RULE.guards.ahead[0] + doubt)]:
            for off, stops in [(most - 1, False), (most + 2, True)]:
                w = Watch(replace(RULE, guards=generous), profile, 0 * EIGHT, direction)
                positions = follow(w, middle, int(generous.lag[0]))
                positions[5] += sign * off * direction[5]
                contact = w.look(positions, middle)
                assert (contact is not None) == stops
                assert contact is None or (contact.motor, contact.sign) == (5, Sign.TRACKING)


def test_a_window_starts_at_the_end_of_a_period_and_grows_with_each_reading() -> None:
    """Each period brings 200 steps. Travel from before the window no longer counts."""
    w = watch(STRICT, distance=20_000, speed=2000, acceleration=10**9)
    assert w.look(follow(w, PAPER_PERIOD), PAPER_PERIOD) is None
    ahead = follow(w, 2 * PAPER_PERIOD) + 100
    assert w.look(ahead, 2 * PAPER_PERIOD) is None
    # The motor is still ahead, but in the new window it made none of 20 expected steps.
    contact = w.look(ahead, 2 * PAPER_PERIOD + 10_000)
    assert contact is not None
    assert contact.sign is Sign.SPEED
    assert contact.measured == 0
    assert abs(contact.expected - 20 * FINE) <= FINE
    assert contact.length == 10_000
    # All travel since the window began counts: 120 of 140 steps are too few, 132 are enough.
    for travelled, stops in [(120, True), (132, False)]:
        w = watch(STRICT, distance=20_000, speed=2000, acceleration=10**9)
        assert w.look(follow(w, PAPER_PERIOD), PAPER_PERIOD) is None
        positions = follow(w, PAPER_PERIOD) + travelled
        assert (w.look(positions, PAPER_PERIOD + 70_000) is not None) == stops


def test_backstop_arrival_sees_a_motor_that_never_arrives() -> None:
    limit = int(RULE.guards.arrival[2])
    # No window expects so much travel: only the backstop is left.
    late_alone = Rule(replace(RULE.guards, least=1000 * EIGHT))
    for missing, stops in [(limit, False), (limit + 1, True)]:
        w = watch(late_alone, distance=limit + 1, speed=2000)
        end = int(w.profile.total[0]) + int(RULE.guards.lag.max())
        late = int(w.profile.total[2]) + int(RULE.guards.lag[2]) + PAPER_PERIOD
        positions = (limit + 1) * EIGHT
        positions[2] = limit + 1 - missing
        assert w.arrived(positions, end) != stops
        contact = w.look(positions, late)
        assert (contact is not None) == stops
        if contact is not None:
            assert (contact.motor, contact.sign) == (2, Sign.ARRIVAL)
        w = watch(late_alone, distance=limit + 1, speed=2000)
        assert w.look(positions, late - 1) is None


def test_a_contact_names_the_motor_that_is_furthest_behind() -> None:
    w = watch(STRICT, speed=2000)
    positions = follow(w, PAPER_PERIOD)
    positions[3], positions[6] = 50, 20
    contact = w.look(positions, PAPER_PERIOD)
    assert contact is not None
    assert contact.motor == 6
    w = watch(STRICT, speed=2000)
    positions[3] = positions[6]
    contact = w.look(positions, PAPER_PERIOD)
    assert contact is not None
    assert contact.motor == 3


def test_the_ratio_is_zero_where_no_travel_was_expected() -> None:
    assert Contact(0, Sign.TRACKING, 50, 0, 1).ratio == 0.0


@pytest.mark.parametrize(("lag", "passes"), [(0, True), (5_000, True), (7_000, False)])
def test_the_printed_rule_passes_a_free_move_up_to_a_lag_of_about_6_ms(
    lag: int, passes: bool
) -> None:
    """Without a ramp worth naming; and it judges no motor that has arrived within a window."""
    profile = Profile.plan(930 * EIGHT, FINE * 1000 * EIGHT, 2_000_000 * EIGHT)
    w = PrintedRule(RULE.guards).watch(profile, 0 * EIGHT, EIGHT)
    contacts = [w.look(follow(w, t, lag), t) for t in range(10_000, 1_500_000, 10_000)]
    assert all(contact is None for contact in contacts) == passes
    assert contacts[8] is None  # before the end of the first period
    assert (contacts[9] is None) == passes


def test_the_printed_rule_stops_a_ramped_free_move() -> None:
    """The first window is a ramp; that is why our rule compares with the profile."""
    profile = Profile.plan(1000 * EIGHT, FINE * 1000 * EIGHT, 13_000 * EIGHT)
    first = profile.position(PAPER_PERIOD) // FINE
    middle = profile.position(3 * PAPER_PERIOD) // FINE - profile.position(2 * PAPER_PERIOD) // FINE
    assert is_slow_as_printed(first, 1000 * EIGHT, PAPER_PERIOD).all()
    assert not is_slow_as_printed(middle, 1000 * EIGHT, PAPER_PERIOD).any()
    assert not is_slow_as_printed(0 * EIGHT, 0 * EIGHT, PAPER_PERIOD).any()
    travel = np.array([937, 938, 937, 938, 1000, 0, 936, 940])
    slow = is_slow_as_printed(travel, 1000 * EIGHT, SECOND)
    np.testing.assert_array_equal(slow, [True, False, True, False, False, True, True, False])
