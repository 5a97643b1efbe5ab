"""Pass a running partner's steps to its recording, with the computer's times."""

from collections.abc import Iterable

from miburi.bodies import Touch
from miburi.feelings import FeelingModel
from miburi.live.events.log import History
from miburi.live.recording.archive import Archive
from miburi.live.recording.recorder import Felt, RecordedMessage, RecordingAbout, step_messages
from miburi.live.stamps import Stamps
from miburi.live.state import StopOut
from miburi.partner import Event, Partner
from miburi.robot import Robot


class Tape:
    """Collects each step of a partner for its recordings; ``seed`` is the seed of its gestures."""

    def __init__(self, feelings: FeelingModel, history: History, seed: int) -> None:
        self._feelings, self._history, self._seed = feelings, history, seed
        self._stamps, self._told = Stamps(), history.number

    def write(
        self,
        recordings: Archive,
        partner: Partner,
        events: Iterable[Event],
        felt: Iterable[Felt],
        stopped: StopOut | None,
        *,
        sampled: bool,
    ) -> None:
        """Record a step, with its stop if it has one; if ``sampled``, record the feelings, too."""
        body = partner.body

        def step() -> list[RecordedMessage]:
            touchable, met = body.touchable, None
            if stopped is not None and stopped.force is not None:
                met = Touch(stopped.force, part=stopped.part)
            return step_messages(
                body.state,
                self._feelings if sampled else None,
                events,
                felt,
                asked=partner.expression if partner.asked else None,
                touch=None if touchable is None else touchable.touch,
                met=met,
                told=self._history.after(self._told),
                wall=self._stamps.of(body.state.time),
            )

        recordings.describe = lambda: self._about(body.robot)
        recordings.write(step)
        self._told = self._history.number

    def _about(self, robot: Robot) -> RecordingAbout:
        more = {
            "temperament": self._feelings.temperament.name,
            "seed": str(self._seed),
            "servo": robot.servo.model.name,
            "boot": self._history.boot,
            "clock": "MCAP's times are the computer's; `time` is the robot's",
        }
        return RecordingAbout(robot, more)
