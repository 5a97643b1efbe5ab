"""Moves that arrive together, and profiles that a small card can compute to the last bit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from miburi.errors import InputError
from miburi.robot import iphonoid
from miburi.safety.drive import aim
from miburi.safety.move import Course, Move, plan_move, plan_on
from miburi.safety.profile import FINE, SECOND, Profile, plan_profile, plan_towards, to_steps

ROBOT = iphonoid()
STEP = ROBOT.servo.step
counts = st.integers(0, 4096)
speeds = st.integers(1, 8000)
accelerations = st.integers(1000, 32_000)


def one(distance: int, speed: int, acceleration: int) -> Profile:
    return Profile.plan(*(np.array([value]) for value in (distance, speed * FINE, acceleration)))


@given(counts, speeds, accelerations)
def test_a_profile_runs_from_zero_to_its_distance_and_never_turns_back(
    distance: int, speed: int, acceleration: int
) -> None:
    profile = one(distance, speed, acceleration)
    total = int(profile.total[0])
    travel = profile.position(np.linspace(-1000, total + 1000, 400).astype(np.int64)[:, None])
    assert travel[0] == 0
    assert travel[-1] == distance * FINE
    assert np.all(np.diff(travel[:, 0]) >= -1)  # one 1/256 step where the pieces meet
    assert np.all((travel >= 0) & (travel <= distance * FINE))


@given(counts, speeds, accelerations)
def test_a_profile_keeps_speed_and_ramp(distance: int, speed: int, acceleration: int) -> None:
    profile = one(distance, speed, acceleration)
    tick = 2000
    times = np.arange(-tick, int(profile.total[0]) + 3 * tick, tick, dtype=np.int64)
    travel = profile.position(times[:, None])[:, 0] / FINE
    velocity = np.diff(travel) * SECOND / tick
    assert velocity.max(initial=0.0) <= speed + 0.02 * SECOND / tick
    change = np.diff(velocity) * SECOND / tick
    assert np.abs(change).max(initial=0.0) <= acceleration + 0.04 * (SECOND / tick) ** 2


@given(
    st.integers(-2000, 2000),
    st.integers(100, 8000),
    st.integers(2000, 32_000),
    st.integers(-2000 * FINE, 2000 * FINE),
)
def test_a_profile_that_begins_with_a_speed_keeps_it_and_ends_at_its_goal(
    way: int, speed: int, acceleration: int, velocity: int
) -> None:
    fast = np.array([velocity])
    profile, direction = plan_towards(
        *(np.array([value]) for value in (0, way, speed * FINE, acceleration)), fast
    )
    tick = 2000
    total = int(profile.total[0])
    times = np.arange(-2 * tick, total + 3 * tick, tick, dtype=np.int64)
    places = (direction * profile.position(times[:, None]))[:, 0] / FINE
    assert places[-1] == way
    speeds_seen = np.diff(places) * SECOND / tick
    # It comes with its speed, and no speed changes faster than the ramp.
    assert abs(speeds_seen[0] - velocity / FINE) <= 0.02 * SECOND / tick
    change = np.diff(speeds_seen) * SECOND / tick
    assert np.abs(change).max() <= acceleration + 0.05 * (SECOND / tick) ** 2
    for index in np.linspace(2, len(times) - 4, 20).astype(int).tolist():
        told = int((direction * profile.velocity(int(times[index]) + tick // 2))[0]) / FINE
        assert abs(told - speeds_seen[index]) <= acceleration * tick / SECOND + 10


def test_a_motor_that_cannot_stop_in_time_comes_back() -> None:
    """At 1000 steps/s it takes 50 steps to stop; its goal is 20 steps ahead."""
    numbers = (np.array([value]) for value in (0, 20, 1000 * FINE, 10_000))
    profile, direction = plan_towards(*numbers, np.array([1000 * FINE]))
    assert direction[0] == -1
    assert -profile.position(100_000)[0] == 50 * FINE
    assert -profile.position(int(profile.total[0]))[0] == 20 * FINE


def test_a_profile_in_numbers() -> None:
    """1000 steps at 1000 steps/s with 10 000 steps/s²: 0.1 s ramps, 1.1 s in all."""
    profile = one(1000, 1000, 10_000)
    assert (int(profile.ramp[0]), int(profile.total[0])) == (100_000, 1_100_000)
    for time, steps in [(100_000, 50), (600_000, 550), (1_000_000, 950)]:
        assert profile.position(time)[0] == steps * FINE
    # Too short to reach the speed: a triangle of √(d/a) up and down.
    short = one(25, 1000, 10_000)
    assert (int(short.ramp[0]), int(short.total[0])) == (50_000, 100_000)
    assert short.position(50_000)[0] == 12.5 * FINE


def test_profiles_stay_inside_64_bits() -> None:
    """The extremes that a description allows, against Python's unbounded integers."""
    for acceleration in (64, 32_000, 500 * 4096):
        profile = one(1 << 16, 1 << 16, acceleration)
        for part in (1, 2, 3, 5, 9):
            time = int(profile.total[0]) * part // 10
            a, t = acceleration, min(time, int(profile.ramp[0]))
            rising = a * t * t * (FINE // 2) // SECOND**2
            if time < int(profile.ramp[0]):
                assert int(profile.position(time)[0]) == rising


@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.05, 3.0),
    st.floats(0.0, 1.0),
)
def test_all_motors_arrive_together(seed: int, duration: float, share: float) -> None:
    rng = np.random.default_rng(seed)
    start = rng.uniform(ROBOT.lower, ROBOT.upper)
    end = start + share * (rng.uniform(ROBOT.lower, ROBOT.upper) - start)
    move = plan_move(ROBOT, start, end, duration)
    assert np.all(move.speeds <= ROBOT.servo.max_speed)
    goals = [to_steps(ROBOT, aim(ROBOT, pose)) for pose in (start, end)]
    distance = np.abs(goals[1] - goals[0])
    ramp = np.full(8, round(ROBOT.servo.acceleration / STEP))
    profile = Profile.plan(distance, np.maximum(to_steps(ROBOT, move.speeds), 1) * FINE, ramp)
    if distance.max() > 0:
        most = int(distance.argmax())
        v, a = move.speeds[most], ROBOT.servo.acceleration
        together = distance[most] * STEP / v + v / a
        assert together >= duration - 1e-9
        # The card counts whole steps/s: slow motors arrive a little early or late.
        moving = distance >= 20
        whole = to_steps(ROBOT, move.speeds)[moving]
        late = np.abs(profile.total[moving] / SECOND - together)
        assert np.all(late <= 0.01 + together * 0.6 / whole)


@given(st.integers(0, 2**32 - 1), st.floats(0.05, 2.0), st.floats(0.0, 1.0))
def test_all_motors_arrive_together_also_from_within_a_move(
    seed: int, duration: float, share: float
) -> None:
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(ROBOT.lower, ROBOT.upper, (2, 8))
    velocities = share * rng.uniform(-1, 1, 8) * ROBOT.servo.max_speed
    move = plan_on(ROBOT, Course(start, velocities), end, duration)
    assert np.all(move.speeds <= ROBOT.servo.max_speed)
    assert move.ends_at >= duration
    assert 0 <= move.slows_at <= move.ends_at
    profile, _ = plan_profile(
        ROBOT,
        to_steps(ROBOT, start),
        to_steps(ROBOT, aim(ROBOT, end)),
        to_steps(ROBOT, move.speeds),
        np.rint(velocities / STEP * FINE).astype(np.int64),
    )
    # Slow motors count whole steps/s, and arrive a little early or late.
    whole = np.maximum(to_steps(ROBOT, move.speeds), 1)
    late = np.abs(profile.total / SECOND - move.ends_at)[whole >= 100]
    assert np.all(late <= 0.02 + move.ends_at * 1.5 / whole[whole >= 100])


def test_a_move_that_is_too_fast_takes_the_time_it_needs() -> None:
    end = ROBOT.neutral + np.array([1.5, 0, 0, 0, 0, 0, 0, 0])
    move = plan_move(ROBOT, ROBOT.neutral, end, 0.01)
    assert move.speeds[0] == pytest.approx(np.sqrt(1.5 * ROBOT.servo.acceleration), rel=1e-3)
    assert np.all(move.speeds[1:] == 0)


def test_nonsense_is_refused() -> None:
    zero = np.zeros(8)
    for angles, pace in [(np.zeros(7), zero), (zero * np.nan, zero), (zero, zero - 1)]:
        with pytest.raises(InputError, match=r"angles must|speeds must"):
            Move(angles, pace)
    for duration in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="duration must"):
            plan_move(ROBOT, zero, zero, duration)
