"""A live partner at rest whose hand somebody takes: it feels it, gives way, and goes back."""

import numpy as np
from tests.fixtures.live import run, until

from miburi.live.runner import Runner
from miburi.live.wishes import MoveHand
from miburi.robot import forward
from miburi.safety.stop import StopReason


def test_a_hand_that_is_taken_at_rest_is_felt_and_led(runner: Runner) -> None:
    run(runner, 1.0)
    state = until(runner, lambda state: state.phase == "idle")
    hand = forward(runner.robot, np.array(state.angles))[:3]
    # From the front, slowly.
    along = np.array([0.0, 1.0, 0.0])
    runner.ask(MoveHand(hand + np.array([0.06, 0.0, 0.0]), along))
    run(runner, 1.0)
    for way in np.linspace(0.06, 0.0, 30):
        runner.ask(MoveHand(hand + np.array([way, 0.0, 0.0]), along))
        run(runner, 0.04)
    stop = runner.snapshot.state.stop
    assert stop is not None
    assert stop.reason is StopReason.TOUCHED
    assert stop.part is not None
    assert stop.mood_after is stop.mood_before is None
    felt = [entry for entry in runner.history.after(0) if entry.kind == "stimulus"]
    assert [(one.feeling, one.source) for one in felt] == [("happiness", "touch")]
    # It gives way, and does not push.
    pressed = [state.force for state in run(runner, 1.5)]
    assert max(pressed[25:]) <= 0.5
    runner.ask(MoveHand(None, along))
    until(runner, lambda state: state.phase == "returning", 4.0)
    until(runner, lambda state: state.phase == "idle", 4.0)
