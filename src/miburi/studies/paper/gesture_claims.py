"""Section 4 of the paper: emotions, gestures and contacts."""

from functools import partial
from itertools import pairwise

import numpy as np

from miburi.feelings import FEELINGS, EmotionalModel, Stimulus
from miburi.robot import Array, forward
from miburi.studies.paper.claim import Claims, ClaimVerdict, Finding, claim, holds
from miburi.studies.paper.runs import Runs

_DRAWN = 1000

GESTURES: Claims = {}
_claim = partial(claim, GESTURES, "4")


@_claim(
    "“When speaking to a happy user, the robot will automatically get a happy emotion, but it "
    "will take a longer time … to get a happy mood.”",
    ours="all constants, and the mood's resting value",
)
def _emotion_before_mood(_: Runs) -> Finding:
    happy = FEELINGS.index("happiness")
    model = EmotionalModel()
    rest = model.mood[happy]
    model.stimulate(Stimulus("happiness", 0.8, "speech"))
    emotion, mood = model.emotion[happy], model.mood[happy]
    for _minute in range(60):
        model.step(15)
        model.stimulate(Stimulus("happiness", 0.8, "speech"))
    return holds(emotion > 0.5 and mood - rest < 0.01 < model.mood[happy] - rest), (
        f"one remark: emotion {emotion:.2f}, mood {rest:.2f} → {mood:.2f}; a quarter of an hour: "
        f"mood {model.mood[happy]:.2f}"
    )


@_claim(
    "“It is created by a repetition of the same emotions on a longer scale of time” (the mood).",
    ours="all constants",
)
def _repetition(_: Runs) -> Finding:
    happy = FEELINGS.index("happiness")
    often, once = EmotionalModel(), EmotionalModel()
    rest = once.mood[happy]
    once.stimulate(Stimulus("happiness", 0.8, "speech"))
    once.step(3600)
    for _remark in range(240):
        often.stimulate(Stimulus("happiness", 0.8, "speech"))
        often.step(15)
    return holds(often.mood[happy] > rest + 0.2 and once.mood[happy] < rest + 0.1), (
        f"from {rest:.2f}: a remark every 15 s for an hour gives a mood of "
        f"{often.mood[happy]:.2f}, one remark {once.mood[happy]:.2f}"
    )


def _named(levels: Array) -> dict[str, float]:
    return dict(zip(FEELINGS, levels, strict=True))


@_claim("The strongest emotion chooses the movement function; its mood μ is the input (Fig. 6).")
def _strongest_emotion(_: Runs) -> Finding:
    """Draw emotions and moods at random, and look at the gestures shown."""
    right = 0
    for emotions, moods in np.random.default_rng(0).uniform(0.1, 1.0, (_DRAWN, 2, len(FEELINGS))):
        model = EmotionalModel()
        model.set_state(emotion=_named(emotions), mood=_named(moods))
        shown, strongest = model.express(), int(emotions.argmax())
        right += shown is not None and shown.feeling == FEELINGS[strongest] and bool(
            np.isclose(shown.mood, moods[strongest])
        )  # fmt: skip
    return holds(right == _DRAWN), (
        f"{right} of {_DRAWN} randomly chosen states of the eight feelings"
    )


@_claim("The mood has no “influence on the robot's current type of gesture”.")
def _mood_changes_no_gesture(_: Runs) -> Finding:
    """Draw emotions at random, and compare the gestures shown at two random moods each."""
    rng, same = np.random.default_rng(1), 0
    for _draw in range(_DRAWN):
        emotions = _named(rng.uniform(0.1, 1.0, len(FEELINGS)))
        shown = set()
        for _mood in range(2):
            model = EmotionalModel()
            model.set_state(emotion=emotions, mood=_named(rng.uniform(0.0, 1.0, len(FEELINGS))))
            expressed = model.express()
            shown.add(expressed and expressed.feeling)
        same += len(shown) == 1 and None not in shown
    return holds(same == _DRAWN), (
        f"{same} of {_DRAWN} randomly chosen emotions show the same gesture with two random moods"
    )


@_claim(
    "“The greater the mood value is, the more space the movement will use, and the faster it "
    "will be executed.”",
    ours="the movement functions: the paper draws them and prints no number",
)
def _space_and_time(runs: Runs) -> Finding:
    rises = [
        all(a.measures.volume < b.measures.volume for a, b in pairwise(row))
        and all(a.measures.mean_speed < b.measures.mean_speed for a, b in pairwise(row))
        for row in runs.gestures.values()
    ]
    met = sum(one.self_collisions > 0 for row in runs.gestures.values() for one in row)
    stopped = sum(one.contact_stops for row in runs.gestures.values() for one in row)
    return holds(all(rises) and met == stopped == 0), (
        f"{sum(rises)} of {len(rises)} gestures rise strictly in volume and mean speed from μ = 0 "
        f"to 1; in {met} performances the body meets itself, {stopped} are stopped"
    )


@_claim("“Decrease the mood value by 20 % after every encounter.”")
def _twenty_percent(runs: Runs) -> Finding:
    ratios = [s.mood_after / s.mood_before for run in runs.experiments for s in run.stops]
    return holds(bool(ratios) and np.allclose(ratios, 0.8, atol=1e-6)), (
        f"{len(ratios)} encounters, each × {min(ratios, default=1):.3f} to "
        f"{max(ratios, default=1):.3f}"
    )


@_claim("After a contact “it will come back into the neutral position”.")
def _back_to_neutral(runs: Runs) -> Finding:
    """Look where the hands are when the gesture after a stop begins."""
    rest = forward(runs.robot, runs.robot.neutral)[:6].reshape(2, 3)
    off = []
    for run in runs.experiments:
        times = np.array(run.times)
        for stop in run.stops:
            after = [gesture.start for gesture in run.gestures if gesture.start > stop.time]
            if after:
                index = int(np.searchsorted(times, after[0] - 0.03))
                hands = run.hands[index].reshape(2, 3)
                off.append(float(np.linalg.norm(hands - rest, axis=1).max()))
    return holds(bool(off) and max(off) < 0.01), (
        f"{len(off)} returns (a run may end before the body has returned): "
        "when the next gesture begins both hands "
        f"are within {1e3 * max(off, default=np.inf):.1f} mm of neutral"
    )


@_claim(
    "“The decrease will then be able to be erased within some time, at the same rhythm as the "
    "mood value.”",
    ours="the time constant",
)
def _healing(runs: Runs) -> Finding:
    """Let the mood recover, and compare it with a control that was not touched."""
    watched = runs.experiments[0].healing
    if watched is None or watched.untouched[0] == watched.moods[0]:
        return ClaimVerdict.DIFFERS, "nothing was lost: 0 stops"
    index = watched.times.index(watched.time_constant)
    lost = [watched.untouched[k] - watched.moods[k] for k in (0, index)]
    return holds(abs(lost[1] / lost[0] - np.exp(-1)) < 1e-3), (
        f"of a loss of {lost[0]:.2f}, {lost[1]:.2f} is left after the mood's time constant "
        f"({watched.time_constant:.0f} s), compared with a twin that was not touched"
    )
