"""What the rule expects of a free servo is what it does, in integers that a card can hold."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from miburi.bodies.simulated import READING, Simulated
from miburi.calibration.free_motion import Trace
from miburi.robot import Robot, iphonoid
from miburi.robot.guards import Guards
from miburi.robot.loads import loads
from miburi.safety.contact import LAG_DOUBT, Loading, Rule, Window
from miburi.safety.free import FreeRule
from miburi.safety.profile import FINE, SECOND, Profile
from miburi.safety.stop import Phase
from miburi.servos import load_servo
from miburi.servos.free import STEP, FreeServo, advance
from miburi.studies.trials.conditions import draw
from miburi.studies.trials.plant import TrialPlant, Variation
from miburi.studies.trials.replay import DeafRule
from miburi.studies.trials.trial import TrialKind, trace_of, trial

EIGHT = np.ones(8, dtype=np.int64)
#: Steps that hold for P 3200; the waist's inertia varies by pose.
WIDER = np.array([1] + [0] * 7)
GUARDS = Guards(
    lag=5500 * EIGHT,
    slack=10 * EIGHT + 6 * WIDER,
    least=8 * EIGHT,
    behind=14 * EIGHT + 4 * WIDER,
    ahead=14 * EIGHT + 4 * WIDER,
    arrival=14 * EIGHT + 4 * WIDER,
)


@pytest.fixture(scope="module")
def plant(robot: Robot) -> TrialPlant:
    return TrialPlant(robot)


@pytest.fixture(scope="module")
def rule(robot: Robot) -> FreeRule:
    return replace(FreeRule.of(robot), guards=GUARDS)


@pytest.fixture(scope="module")
def traces(plant: TrialPlant) -> list[Trace]:
    """Free moves of gestures by a robot that is as described."""
    robot, found = plant.robot, []
    for index in range(12):
        rng = np.random.default_rng([77, index])
        conditions = draw(robot, rng, 1)
        plant.begin(conditions.start, Variation(), rng)
        body = Simulated(robot, DeafRule.of(robot), plant=plant)
        move, readings = conditions.moves[0][0], [body.encoders]
        body.move(move)
        while body.phase is Phase.MOVING:
            body.step(READING)
            readings.append(body.encoders)
        found.append(trace_of(robot, conditions.start, move, readings))
    return found


def missed(rule: Rule, traces: list[Trace], lag: int) -> float:
    """Return the root mean square, in steps, of what the rule's expectation misses."""
    squares = []
    for one in traces:
        late = replace(rule, guards=replace(rule.guards, lag=lag * EIGHT))
        watch = late.watch(one.profile, one.start, one.direction, one.loading)
        for time, positions in zip(one.times, one.positions, strict=True):
            watch.look(positions, int(time))
            expected = watch.window.expected - watch.window.measured
            squares.append((expected / FINE) ** 2)
    return float(np.sqrt(np.mean(squares)))


def test_it_knows_free_motion_better_than_the_delayed_profile(rule, traces) -> None:
    # Half of a step of the model is its own delay: these servos have none.
    free = missed(rule, traces, 2750)
    profile = min(missed(Rule(GUARDS), traces, lag) for lag in range(8000, 18_000, 2000))
    assert free < 1.0
    assert free < 0.6 * profile


def test_free_moves_of_varied_robots_pass_and_people_are_noticed(plant, rule) -> None:
    free = [trial(plant, rule, 41, TrialKind.FREE, index) for index in range(10)]
    assert [one for one in free if one.stopped] == []
    blocked = [trial(plant, rule, 41, TrialKind.BLOCKED, index) for index in range(8)]
    assert [one for one in blocked if one.false_stop] == []
    firm = [one for one in blocked if one.sustained_force >= 2.0]
    assert all(one.stopped for one in firm)
    assert np.median([one.latency for one in blocked if one.stopped]) < 0.08


def test_a_factory_servo_is_no_such_servo(robot, rule) -> None:
    """The mutation that shows that the test above can fail: P 400 instead of 3200."""
    servo = load_servo("xl330-m288-t")
    drive = servo.drive.model_copy(update={"gain": 400.0})
    soft = TrialPlant(robot.with_servo(servo.model_copy(update={"drive": drive})))
    stops = [trial(soft, rule, 41, TrialKind.FREE, index).stopped for index in range(5)]
    assert any(stops)


def test_a_loaded_motor_at_rest_is_expected_to_rest(rule: FreeRule) -> None:
    """Held by friction anywhere in its band, with the goal aimed above the sag."""
    sag = 600 * EIGHT
    for offset in (500, 600, 700):
        loading = Loading(offset * EIGHT, sag, sag, 18_000 * EIGHT)
        still = Profile.plan(0 * EIGHT, FINE * EIGHT, 13_000 * EIGHT)
        watch = rule.watch(still, 0 * EIGHT, EIGHT, loading)
        for time in range(20_000, 400_000, 20_000):
            assert watch.look(0 * EIGHT, time) is None
        assert (np.abs(watch.window.expected) < FINE).all()


@pytest.mark.parametrize(("speed", "share"), [(0, 0.5), (128, 0.625), (512, 1.0), (1500, 1.0)])
def test_a_slow_motor_is_granted_less(rule: FreeRule, speed: int, share: float) -> None:
    """A person whom the robot meets slowly must not wait until a fast move's errors are reached."""
    profile = Profile.plan((speed // 2) * EIGHT, FINE * max(speed, 1) * EIGHT, 13_000 * EIGHT)

    def look(positions: np.ndarray, **guards: np.ndarray) -> tuple[bool, Window]:
        one = replace(rule, guards=replace(GUARDS, **guards))
        watch = one.watch(profile, 0 * EIGHT, EIGHT)
        return watch.look(positions, 250_000) is not None, watch.window

    window = look(0 * EIGHT, slack=300 * EIGHT, behind=300 * EIGHT)[1]
    assert window.granted - window.measured == pytest.approx(300 * FINE * share * EIGHT, rel=0.01)
    here = np.rint(window.expected / FINE).astype(np.int64)
    for guard, way in ((GUARDS.behind, -1), (GUARDS.ahead, 1)):
        most = (guard * share + speed * LAG_DOUBT / SECOND).astype(np.int64)
        assert not look(here + way * (most - 1), slack=300 * EIGHT)[0]
        for motor in range(8):
            one = np.where(np.arange(8) == motor, most + 2, 0)
            assert look(here + way * one, slack=300 * EIGHT)[0]


def test_a_waist_at_rest_may_not_be_pushed_aside_by_eight_steps(robot: Robot) -> None:
    """A person pressed on one with 8.3 N over 0.1 s, and it gave way by nine steps, unnoticed."""
    shipped = FreeRule.of(robot)
    still = Profile.plan(0 * EIGHT, FINE * EIGHT, 13_000 * EIGHT)
    for steps, noticed in ((5, False), (8, True), (-5, False), (-8, True)):
        watch = shipped.watch(still, 0 * EIGHT, EIGHT)
        assert (watch.look(steps * WIDER, 20_000) is not None) is noticed


def test_expectations_do_not_depend_on_when_they_are_asked_much(rule, traces) -> None:
    """Every 20 ms as the card, or every 10 ms: the same within a step."""
    one = traces[0]
    often, seldom = (
        rule.watch(one.profile, one.start, one.direction, one.loading) for _ in range(2)
    )
    for row, time in enumerate(one.times.tolist()):
        often.look(one.positions[row], time)
        if time % 20_000 == 0:
            seldom.look(one.positions[row], time)
            gap = often.window.granted - often.window.expected
            other = seldom.window.granted - seldom.window.expected
            assert np.abs(gap - other).max() <= 2 * FINE


@settings(max_examples=30)
@given(seed=st.integers(0, 1 << 30))
def test_every_number_fits_into_32_bits(seed: int) -> None:
    """The same steps in Python's own integers, with every intermediate looked at."""
    rng = np.random.default_rng(seed)
    servo = FreeServo.of(load_servo("xl330-m288-t"), loads(iphonoid(), iphonoid().neutral).inertia)
    x, v = np.zeros(8, dtype=np.int64), np.zeros(8, dtype=np.int64)
    distance = rng.integers(0, 4096, 8)
    speed = FINE * rng.integers(np.maximum(distance // 4, 1), 3912)  # some 4 s are long enough
    profile = Profile.plan(distance, speed, 13_038 * EIGHT)
    sag, most = rng.integers(-2600, 2600, 8), rng.integers(1000, 18_200, 8)
    before, time = rng.integers(-3000, 3000, 8), 0
    offset = before.copy()
    while time < int(profile.total.max()) + 100_000:
        steps = int(rng.integers(1, 9))
        time += steps * STEP
        now = offset + profile.position(time)
        big, after = 0, []
        for j in range(8):
            place, speed = int(x[j]), int(v[j])
            for k in range(1, steps + 1):
                part = (int(now[j]) - int(before[j])) * k
                error = int(before[j]) + part // steps - (place >> 8)
                error = min(max(error, -int(most[j])), int(most[j]))
                pulled, braked = int(servo.pull[j]) * error, int(servo.brake[j]) * (speed >> 8)
                motor = (pulled >> 8) - (braked >> 8)
                weighed = int(servo.pull[j]) * int(sag[j])
                wanted = speed + motor - (weighed >> 8)
                lost = int(servo.lost[j]) * abs(motor)
                taken = int(servo.friction[j]) + (lost >> 8)
                speed = max(wanted - taken, 0) if wanted > 0 else min(wanted + taken, 0)
                place += speed
                big = max(big, *map(abs, (part, pulled, braked, weighed, lost, wanted, place)))
            after.append((place, speed))
        assert big < 1 << 31
        advance(x, v, before, now, steps, sag, most, servo)
        assert list(zip(x.tolist(), v.tolist(), strict=True)) == after
        before = now
