"""What the partner does while it shows nothing: it rests like something living.

Breaths, glances, a sigh come as events with pauses between them, not at a period; most of the
time nothing moves. Mood shows in them: a sad partner holds its head low, and its acts are small
and slow. ``rest.toml`` has the acts and all numbers.
"""

from collections.abc import Sequence
from functools import cache
from importlib import resources
from typing import Annotated

import numpy as np
from pydantic import Field

from miburi import gestures
from miburi.feelings import FEELINGS, FeelingModel
from miburi.feelings.temperament import RestLevel, Temperament
from miburi.ground.tables import Table, load_table
from miburi.partner.performance import Performance
from miburi.robot import Array, Robot

__all__ = ["Rest"]

#: After an interruption of this many s, rest begins with a pause (ours).
_ANEW = 2.0
#: s of a turn to a face, and one that is not worth making, rad (ours).
_TURNING, _FACED = 1.4, 0.02
#: Moods together make acts deeper and quicker by e to the power of this at most (ours).
_LIVELIEST = 0.3
#: Shares by which size and tempo of an act vary (ours).
_SIZES, _TEMPOS = (0.8, 1.2), (0.85, 1.1)
#: The smallest and the largest beat, how much of it the other hand makes, and the share of strokes
#: that are tried: nobody beats to all (all ours).
_BEATS, _OTHERS, _TRIED = (0.5, 1.5), (0.0, 0.5, 0.9), 0.8
#: The one act while somebody is in distress.
_CALM = "breath"
#: The head's turn and rise, as in ``gestures.coordinates.COORDINATES``; and the arms, mirrored.
_TURN, _RISE, _MIRRORED = 6, 7, [3, 4, 5, 0, 1, 2, 6, 7]

_Seconds = Annotated[float, Field(gt=0, le=600)]
_Share = Annotated[float, Field(ge=-2, le=2)]


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


class _Acts(Table):
    level: dict[RestLevel, _Level]
    tone: dict[str, _Tone]
    act: Annotated[list[_Act], Field(min_length=2)]


@cache
def _shipped() -> _Acts:
    with resources.as_file(resources.files(__package__) / "rest.toml") as path:
        return load_table(_Acts, path)


class Rest:
    """Chooses what a body at rest does next, and when.

    Parameters
    ----------
    robot
        Gives lengths, limits and neutral.
    seed
        Draws the acts, their pauses and their sizes.
    """

    def __init__(self, robot: Robot, seed: int) -> None:
        self._robot = robot
        self._rng = np.random.default_rng([seed, 2])
        self._hands = np.random.default_rng([seed, 3])  # of beats
        self._due = self._called = float("-inf")
        self._last = ""

    def act(
        self,
        time: float,
        feelings: FeelingModel,
        turned: float,
        gaze: float,
        *,
        calm: bool = False,
    ) -> Performance | None:
        """Return the act that begins at ``time`` s, if one is due: first of all a turn to a face.

        Parameters
        ----------
        time
            Now, s; to be called again and again while the body rests.
        feelings
            The emotional model: its mood shows in the act; its temperament says how often one
            comes.
        turned, gaze
            rad to its left: how far the body is turned, and where somebody is.
        calm
            Whether somebody is in distress: then it only breathes.
        """
        allowed = feelings.temperament.gaze
        turn = float(np.clip(gaze, -allowed.turn, allowed.turn))
        if abs(turn - turned) > _FACED:
            step = allowed.speed * _TURNING
            turn = turned + float(np.clip(turn - turned, -step, step))
            lift = self._tone(feelings)[0]
            pose = self._pose(turn, lift, np.zeros(8), _TURNING, 0.0)
            return Performance(lambda _mood: [pose], rests="turn")
        if time > self._called + _ANEW:
            self._due = time + self._pause(feelings.temperament)
        self._called = time
        if time < self._due:
            return None
        acts = [act for act in _shipped().act if act.name != self._last]
        if calm:
            acts = [act for act in _shipped().act if act.name == _CALM]
        weights = np.array([act.weight for act in acts])
        act = acts[int(self._rng.choice(len(acts), p=weights / weights.sum()))]
        self._last = act.name
        lift, depth, tempo = self._tone(feelings)
        size = (
            _shipped().level[feelings.temperament.at_rest].size
            * np.exp(depth)
            * self._rng.uniform(*_SIZES)
        )
        slower = np.exp(-tempo) / self._rng.uniform(*_TEMPOS)
        offset = size * np.array(act.offset)
        # Nor does a glance turn the waist where the temperament lets nothing turn it.
        offset[_TURN] = min(offset[_TURN], allowed.turn - abs(turn))
        if self._rng.random() < 0.5:
            offset = offset[_MIRRORED] * np.where(np.arange(8) == _TURN, -1, 1)
        times = slower * np.array([act.there, act.hold, act.back])
        self._due = self._called = time + float(times.sum())
        self._due += self._pause(feelings.temperament)
        poses = [
            self._pose(turn, lift, offset, times[0], times[1]),
            self._pose(turn, lift, np.zeros(8), times[2], 0.0),
        ]
        return Performance(lambda _mood: poses, rests=act.name)

    def choose(self, strokes: Sequence[float]) -> list[float]:
        """Return the strokes, in their order, that the arms are to make; the first is one."""
        return [at for k, at in enumerate(strokes) if self._hands.random() < _TRIED or k == 0]

    def beat(self, feelings: FeelingModel, turned: float) -> Performance:
        """Return one beat of the arms to speech, turned as the body is; mood shows in its size."""
        size = np.exp(self._tone(feelings)[1]) * self._hands.uniform(*_SIZES)
        hands = self._hands.permutation([1.0, self._hands.choice(_OTHERS)])
        poses = gestures.beat(self._robot, float(np.clip(size, *_BEATS)) * hands, turned)
        return Performance(lambda _mood: poses)

    def _pause(self, temperament: Temperament) -> float:
        level = _shipped().level[temperament.at_rest]
        return float(level.pause * np.exp(level.spread * self._rng.standard_normal()))

    def _pose(
        self, turn: float, lift: float, offset: Array, duration: float, hold: float
    ) -> gestures.KeyPose:
        """Return a key pose that is ``offset`` away from where the body rests."""
        posture = np.array(offset)
        posture[_TURN] += turn
        posture[_RISE] += lift
        return gestures.key_pose(self._robot, posture, float(duration), float(hold))

    def _tone(self, feelings: FeelingModel) -> tuple[float, float, float]:
        """Return by how much the head is lifted, acts are deeper, and quicker."""
        resting = np.array([feelings.temperament.resting[name] for name in FEELINGS])
        above = np.clip((feelings.mood - resting) / (1 - resting), 0.0, 1.0)
        tones = _shipped().tone
        parts = [
            share * np.array([tone.lift, tone.depth, tone.tempo])
            for name, share in zip(FEELINGS, above, strict=True)
            if (tone := tones.get(name)) is not None
        ]
        lift, depth, tempo = np.sum(parts, axis=0) if parts else np.zeros(3)
        return float(lift), min(float(depth), _LIVELIEST), min(float(tempo), _LIVELIEST)
