"""The partner at rest: while it shows no feeling, it moves like a living thing.

Breaths, glances and sighs come one by one with pauses between them, not periodically; most of the
time nothing moves. The acts show the mood: a sad partner holds its head low, and its acts are small
and slow. While it attends to somebody, it faces them, breathes, and now and then looks aside, as
people do. ``rest.toml`` has the acts and all the numbers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Annotated, Literal, get_args

import numpy as np
from pydantic import Field

from miburi import gestures
from miburi.feelings import FEELINGS, FeelingModel
from miburi.feelings.temperament import RestLevel
from miburi.ground.tables import Table, load_table
from miburi.partner.performance import Performance
from miburi.robot import Array, Robot

#: The partner's part in a conversation.
Attention = Literal["listening", "thinking", "speaking"]

#: After an interruption of at least this length, in s, rest begins with a pause (our choice).
_ANEW = 2.0
#: The duration of a turn to a face, in s, and the largest angle, in rad, for which the partner does
#: not turn (our choice).
_TURNING, _FACED = 1.4, 0.02
#: All moods together make acts deeper and quicker by at most a factor of exp(this) (our choice).
_LIVELIEST = 0.3
#: Ranges of the factors by which the size and tempo of an act vary (our choice).
_SIZES, _TEMPOS = (0.8, 1.2), (0.85, 1.1)
#: The sizes of the smallest and the largest beat. The sizes that the other hand's beat may have, as
#: shares of the first hand's. The share of strokes that get a beat, since nobody beats to all of
#: them. (All are our choice.)
_BEATS, _OTHERS, _TRIED = (0.5, 1.5), (0.0, 0.5, 0.9), 0.8
#: The only act while somebody is in distress or talks with the partner.
_CALM = "breath"
#: The name of a turn to a face.
_TURNS = "turn"
#: The shortest look aside, and the shortest wait for one, in s (our choice).
_BRIEFEST = 0.1
#: The indices of the head's turn and rise in ``COORDINATES``, and the permutation that swaps the
#: arms.
_TURN, _RISE, _MIRRORED = 6, 7, [3, 4, 5, 0, 1, 2, 6, 7]

_Seconds = Annotated[float, Field(gt=0, le=600)]
_Share = Annotated[float, Field(ge=-2, le=2)]


@dataclass
class Company:
    """The people around the partner, as far as its body takes them into account.

    Attributes
    ----------
    gaze
        The direction in which the person is, in rad to the partner's left. At rest the partner
        turns in this direction, as far and as fast as its temperament allows.
    calm
        Whether somebody is in distress: then the partner shows no feeling, and only breathes.
    attends
        The partner's role in a conversation, in which it faces the person; None if there is no
        conversation.
    """

    gaze: float = 0.0
    calm: bool = False
    attends: Attention | None = None


class _Level(Table):
    pause: _Seconds
    spread: Annotated[float, Field(ge=0, le=2)]
    size: Annotated[float, Field(gt=0, le=2)]


class _Tone(Table):
    lift: _Share
    depth: _Share
    tempo: _Share


class _Act(Table):
    name: str
    weight: Annotated[float, Field(gt=0)]
    offset: Annotated[list[_Share], Field(min_length=8, max_length=8)]
    there: _Seconds
    hold: _Seconds
    back: _Seconds


_Normal = Annotated[list[Annotated[float, Field(ge=0, le=60)]], Field(min_length=2, max_length=2)]


class _Aversion(Table):
    first: _Normal
    after: _Normal
    hold: _Normal
    offset: Annotated[list[_Share], Field(min_length=8, max_length=8)]
    there: _Seconds
    back: _Seconds


class _Acts(Table):
    level: dict[RestLevel, _Level]
    aversion: dict[Attention, _Aversion]
    tone: dict[str, _Tone]
    act: Annotated[list[_Act], Field(min_length=2)]


@cache
def _shipped() -> _Acts:
    with resources.as_file(resources.files(__package__) / "rest.toml") as path:
        return load_table(_Acts, path)


class Rest:
    """Chooses what a body at rest does next, and when.

    The acts show the mood; the temperament says how often an act begins. The seed determines the
    choice of acts, the pauses and the sizes.
    """

    def __init__(self, robot: Robot, feelings: FeelingModel, seed: int) -> None:
        self._robot, self._feelings = robot, feelings
        self._rng = np.random.default_rng([seed, 2])
        self._hands = np.random.default_rng([seed, 3])  # draws beats
        self._eyes = np.random.default_rng([seed, 4])  # draws looks aside
        self._attends: Attention | None = None
        self._averts = float("inf")  # when it looks aside, s
        self._back: float | None = None  # how long looking back takes, s
        self._faced = 0.0  # the direction before it looked aside, rad to its left
        self._due = self._called = float("-inf")
        self._last = ""

    def act(self, time: float, turned: float, company: Company) -> Performance | None:
        """Return the act that begins at ``time`` s, if one is due; a turn to a face comes first.

        Call this repeatedly while the body rests; ``turned`` is how far it is turned to its left,
        in rad. In a conversation the partner only breathes and looks aside.
        """
        allowed, calm = self._feelings.temperament.gaze, company.calm
        turn = float(np.clip(company.gaze, -allowed.turn, allowed.turn))
        if abs(turn - turned) > _FACED:
            # The partner turns back from a look aside in the time given for that look, or slowly if
            # the person has moved.
            back, self._back = self._back, None
            back = None if abs(turn - self._faced) > _FACED else back
            step = allowed.speed * _TURNING if back is None else np.inf
            turn = turned + float(np.clip(turn - turned, -step, step))
            pose = self._pose(self._tone()[0], np.zeros(8), back or _TURNING, 0.0)
            return Performance(lambda _mood: [pose], rests=_TURNS, turn=turn)
        if not calm and (aside := self._avert(time, company.attends)) is not None:
            aside.turn = self._faced = turn
            return aside
        self._back = None
        if time > self._called + _ANEW:
            self._due = time + self._pause()
        self._called = time
        if time < self._due:
            return None
        acts = [act for act in _shipped().act if act.name != self._last]
        if calm or company.attends is not None:
            acts = [act for act in _shipped().act if act.name == _CALM]
            breath = acts[0].there + acts[0].hold + acts[0].back
            if not calm and breath > self._averts - time:
                return None
        weights = np.array([act.weight for act in acts])
        act = acts[int(self._rng.choice(len(acts), p=weights / weights.sum()))]
        self._last = act.name
        lift, depth, tempo = self._tone()
        size = self._level.size * np.exp(depth) * self._rng.uniform(*_SIZES)
        slower = np.exp(-tempo) / self._rng.uniform(*_TEMPOS)
        offset = size * np.array(act.offset)
        # A glance, too, turns the waist no further than the temperament lets it turn.
        offset[_TURN] = min(offset[_TURN], allowed.turn - abs(turn))
        if self._rng.random() < 0.5:
            offset = offset[_MIRRORED] * np.where(np.arange(8) == _TURN, -1, 1)
        times = slower * np.array([act.there, act.hold, act.back])
        self._due = self._called = time + float(times.sum())
        self._due += self._pause()
        poses = [
            self._pose(lift, offset, times[0], times[1]),
            self._pose(lift, np.zeros(8), times[2], 0.0),
        ]
        return Performance(lambda _mood: poses, rests=act.name, turn=turn)

    def _avert(self, time: float, attends: Attention | None) -> Performance | None:
        """Return a look aside from the person whom the partner faces, if due at ``time`` s."""
        aversion = None if attends is None else _shipped().aversion.get(attends)
        if attends != self._attends:
            self._attends, self._averts = attends, float("inf")
            if aversion is not None:
                self._averts = time + self._drawn(aversion.first)
        if aversion is None or time < self._averts:
            return None
        hold, lift = self._drawn(aversion.hold), self._tone()[0]
        self._averts = time + aversion.there + hold + aversion.back + self._drawn(aversion.after)
        offset, self._back = np.array(aversion.offset), aversion.back
        offset[_TURN] = min(offset[_TURN], self._feelings.temperament.gaze.turn)
        if self._eyes.random() < 0.5:
            offset[_TURN] *= -1
        poses = [
            self._pose(lift, offset, aversion.there, hold),
            self._pose(lift, np.zeros(8), aversion.back, 0.0),
        ]
        return Performance(lambda _mood: poses, rests=attends or "")

    def _drawn(self, normal: list[float]) -> float:
        mean, deviation = normal
        return max(mean + deviation * float(self._eyes.standard_normal()), _BRIEFEST)

    def choose(self, strokes: Sequence[float]) -> list[float]:
        """Return a random selection of the strokes, in order; the first is always among them."""
        return [at for k, at in enumerate(strokes) if self._hands.random() < _TRIED or k == 0]

    def beat(self, turn: float) -> Performance:
        """Return one beat of the arms for a body that is turned by ``turn``.

        The mood shows in the beat's size and in how the head is held.
        """
        lift, depth, _ = self._tone()
        size = np.exp(depth) * self._hands.uniform(*_SIZES)
        hands = self._hands.permutation([1.0, self._hands.choice(_OTHERS)])
        poses = gestures.beat(self._robot, float(np.clip(size, *_BEATS)) * hands, lift)
        return Performance(lambda _mood: poses, turn=turn)

    @property
    def _level(self) -> _Level:
        return _shipped().level[self._feelings.temperament.at_rest]

    def _pause(self) -> float:
        spread = self._level.spread * self._rng.standard_normal()
        return float(self._level.pause * np.exp(spread))

    def _pose(self, lift: float, offset: Array, duration: float, hold: float) -> gestures.KeyPose:
        """Return a key pose, facing ahead, that is ``offset`` away from where the body rests."""
        posture = np.array(offset)
        posture[_RISE] += lift
        return gestures.key_pose(self._robot, posture, float(duration), float(hold))

    def _tone(self) -> tuple[float, float, float]:
        """Return how far the head is lifted, and how much deeper and quicker acts are."""
        resting = self._feelings.temperament.rest
        above = np.clip((self._feelings.mood - resting) / (1 - resting), 0.0, 1.0)
        tones = _shipped().tone
        parts = [
            share * np.array([tone.lift, tone.depth, tone.tempo])
            for name, share in zip(FEELINGS, above, strict=True)
            if (tone := tones.get(name)) is not None
        ]
        lift, depth, tempo = np.sum(parts, axis=0) if parts else np.zeros(3)
        return float(lift), min(float(depth), _LIVELIEST), min(float(tempo), _LIVELIEST)


def may_go_on(act: str, attends: Attention | None) -> bool:
    """Whether an act at rest fits the partner's part in a conversation; if not, it is broken off.

    A sigh or a stretch is allowed to finish: if it were interrupted, nothing would bring the body
    back at once. After an act that turns the body away, another turn brings it back.
    """
    if act in get_args(Attention):
        return act == attends
    turns = any(one.name == act and one.offset[_TURN] for one in _shipped().act)
    return attends is None or not turns
