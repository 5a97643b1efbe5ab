"""The arbiter: it chooses the body's next act, and decides which acts may interrupt others.

The order is: what somebody asked for, a sudden feeling, a gesture, beats to speech, attention to a
person, rest. Each of these is a :class:`~miburi.partner.performance.Performance`, which the loop
carries out. A feeling that lasts while the partner speaks is shown by one whole gesture and then
carried by the posture, so that the arms are free for beats.
"""

from collections import deque
from collections.abc import Sequence
from functools import partial

import numpy as np

from miburi import gestures
from miburi.errors import InputError
from miburi.feelings import Expression, FeelingModel
from miburi.partner.performance import Performance
from miburi.partner.rest import Company, Rest, may_go_on
from miburi.partner.shown import ShownEmotion
from miburi.robot import Robot

#: A beat may begin this much later than it should, in s (our choice).
_LATE = 0.05
#: The number of the random stream from which gestures are chosen.
_CHOICES = 1


class Arbiter:
    """Chooses the next performance; it only reads the emotional model.

    ``life`` is the seed of idle motion and variation; None switches both off, as in the paper's
    experiment. ``choices`` is the seed that chooses among gestures, by default ``life``, or 0.

    Attributes
    ----------
    company
        The people around the partner; set this object's attributes at any time.
    facing
        The direction to which gestures are turned, in rad to the robot's left.
    asked
        The performance that somebody asked for, until it begins.
    asked_at
        When the request was made, in s on the body's clock.
    """

    def __init__(
        self,
        robot: Robot,
        feelings: FeelingModel,
        repertoire: gestures.Repertoire,
        life: int | None,
        choices: int | None = None,
    ) -> None:
        self.company = Company()
        self.facing = 0.0
        self.asked: Performance | None = None
        self.asked_at = 0.0
        self._interrupts = False  # whether the request breaks off the present gesture
        self._robot, self._feelings, self._repertoire = robot, feelings, repertoire
        chosen_by = (life or 0) if choices is None else choices
        self._choices = np.random.default_rng([chosen_by, _CHOICES])
        self._variations = None if life is None else np.random.default_rng(life)
        self._rest = None if life is None else Rest(robot, feelings, life)
        self._emotion = None if life is None else ShownEmotion(feelings)
        # Times for beats in the present sentence, in s on the body's clock.
        self._strokes: deque[float] = deque()
        self._beats_until = -np.inf  # when the last beat will have ended, s

    def prepare(
        self,
        expression: Expression | None,
        poses: Sequence[gestures.KeyPose] | None,
        wish: str | None,
    ) -> Performance:
        """Return the performance that somebody asks for; see ``Partner.perform``.

        Raises
        ------
        InputError
            There is neither a feeling nor a pose.
        """
        name = None
        if poses is None:
            if expression is None:
                raise InputError("there is nothing to perform: give a feeling, or key poses.")
            function = self._repertoire.choose(expression.feeling, self._choices)
            name = function.name
            poses = gestures.key_poses(self._robot, function, expression.mood)
        given = list(poses)
        return Performance(lambda _mood: given, expression, name, asked=True, wish=wish)

    def ask(self, asked: Performance, time: float, *, interrupts: bool) -> None:
        """Take the request ``asked``, made at ``time`` s, in place of the present one, if any."""
        self.asked, self.asked_at, self._interrupts = asked, time, interrupts

    def speak(self, time: float, strokes: Sequence[float]) -> None:
        """Note the ascending times of a sentence's prominent syllables, in s after ``time``."""
        within = [at for at in strokes if at >= gestures.BEAT_LEAD]
        chosen = [] if self._rest is None else self._rest.choose(within)
        self._strokes = deque(time + at for at in chosen)
        self._beats_until = self._strokes[-1] + gestures.BEAT_LEAD if chosen else -np.inf

    def hurries(self, time: float) -> bool:
        """Whether something may begin now, before the next period, if the body is at rest."""
        self._drop_strokes(time)
        felt = self._felt(time)
        attends = self.company.attends is not None and felt is None
        return self.asked is not None or self._is_new(felt) or attends or self._beats(time)

    def breaks_in(self, performance: Performance | None, time: float) -> bool:
        """Whether something more urgent interrupts the present performance in mid-move."""
        self._drop_strokes(time)
        if performance is not None:
            return self.gives_way(performance, time)
        return self.asked is not None or self._is_new(self._felt(time))

    def choose(self, time: float, turned: float) -> Performance | None:
        """Return the performance that begins now, if any.

        ``turned`` is how far the waist is turned to the left, in rad.
        """
        chosen = self._chosen(time, turned)
        if chosen is not None:
            self.facing = chosen.turn
        return chosen

    def gives_way(self, performance: Performance, time: float) -> bool:
        """Whether to cut a performance short: for distress, a request, a feeling or a beat."""
        shows = performance.expression is not None
        if self.asked is not None and (not shows or self._interrupts):
            return True
        if shows and performance.asked:
            return False
        if shows:
            return self.company.calm or self._startles(performance.expression, time)
        felt = not performance.asked and self._felt(time) is not None
        if felt or not performance.rests:
            return felt
        return self._beats(time) or not may_go_on(performance.rests, self.company.attends)

    def _chosen(self, time: float, turned: float) -> Performance | None:
        if self.asked is not None:
            asked, self.asked = self.asked, None
            if asked.gesture is not None:  # otherwise a user has sent the poses
                asked.turn = self.facing
            return asked
        draws = self._variations
        variation = None if draws is None else int(draws.integers(2**32))
        if (felt := self._felt(time)) is not None:
            if self._emotion is not None:
                self._emotion.shown += 1
            function = self._repertoire.choose(felt.feeling, self._choices)
            poses = partial(gestures.key_poses, self._robot, function, variation=variation)
            return Performance(poses, felt, function.name, turn=self.facing)
        if self._rest is None:
            return None
        if self._beats(time):
            self._strokes.popleft()
            return self._rest.beat(self.facing)
        return None if self._strokes else self._rest.act(time, turned, self.company)

    def _felt(self, time: float) -> Expression | None:
        """Return the feeling that is still to be shown by a gesture at ``time`` s, if any."""
        felt = None if self.company.calm else self._feelings.express()
        if self._emotion is None:
            return felt
        left = self._emotion.left(felt)
        return None if time < self._beats_until and self._emotion.shown else left

    def _drop_strokes(self, time: float) -> None:
        """Drop strokes that a beat can no longer meet; drop all if somebody is in distress."""
        soonest = np.inf if self.company.calm else time + gestures.BEAT_LEAD - _LATE
        while self._strokes and self._strokes[0] < soonest:
            self._strokes.popleft()
        if self.company.calm:
            self._beats_until = -np.inf

    def _beats(self, time: float) -> bool:
        """Whether to begin a beat now so that it reaches its turning point on the next stroke."""
        return bool(self._strokes) and self._strokes[0] <= time + gestures.BEAT_LEAD

    def _is_new(self, felt: Expression | None) -> bool:
        return felt is not None and self._emotion is not None and self._emotion.shown == 0

    def _startles(self, shown: Expression | None, time: float) -> bool:
        """Whether a different feeling has risen above the one that is shown."""
        felt = self._felt(time)
        other = felt is not None and shown is not None and felt.feeling != shown.feeling
        return other and self._emotion is not None and self._emotion.rises
