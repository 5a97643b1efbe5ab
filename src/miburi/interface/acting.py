"""Turn requests for gestures, key poses, sentences and performances into acts of a partner.

No sentence from outside may hurt somebody, whichever way it comes.

Custom key poses are checked before the robot moves: first their reach and the joint limits, then,
in a rehearsal on the simulated body, whether parts collide or the contact rule stops the body.
"""

import threading
from collections.abc import Sequence

from pydantic import ValidationError

from miburi.errors import InputError
from miburi.feelings import FEELINGS, Expression
from miburi.gestures import KeyPose, MovementFunction, blend, key_poses, look, misfits
from miburi.gestures.effort import Effort
from miburi.live.stage import Act
from miburi.live.view import LivePartner
from miburi.serving.press import By
from miburi.talk.care import could_hurt, may_be_said
from miburi.wire.messages import (
    ExpressIn,
    GestureAct,
    LookAct,
    PerformanceIn,
    PosesAct,
    PosesIn,
    SpeechAct,
)

#: The greatest duration of custom key poses, s (our number).
LONGEST = 30.0
#: The largest error of a pose, m; the same as in `miburi gesture check`.
_MOST_ERROR = 1e-3
#: Why a sentence is refused.
UNSAID = (
    "The partner refuses to say this: the words could hurt somebody, or sound like a call for help."
)
_REHEARSING = threading.Lock()  # one at a time: each takes a core for a moment


def shown_by(partner: LivePartner, wish: ExpressIn) -> list[KeyPose] | None:
    """Return the key poses of a request, or None if it asks only for a feeling's own gesture.

    Raises
    ------
    InputError
        The blend lists the leading feeling a second time.
    """
    if not wish.blend and wish.effort is None:
        return None
    if wish.feeling in wish.blend:
        raise InputError(
            f"{wish.feeling} is already the main feeling; name only others in the blend."
        )
    lead = partner.repertoire.of(wish.feeling)[0]
    if wish.effort is not None:
        lead = lead.model_copy(update={"effort": Effort(**wish.effort.model_dump())})
    others = [(partner.repertoire.of(name)[0], mood) for name, mood in wish.blend.items()]
    return blend(partner.robot, [(lead, wish.mood), *others])


def poses_of(partner: LivePartner, wish: PosesIn) -> list[KeyPose]:
    """Return a request's key poses after checking that the robot can perform them, which is slow.

    Raises
    ------
    InputError
        A pose is out of reach or beyond a limit, parts would collide, or the performance takes too
        long.
    """
    written = wish.model_dump(include=set(MovementFunction.model_fields) - {"feeling"})
    try:
        # The class needs the name of a feeling, but any feeling gives the same poses here.
        function = MovementFunction.model_validate(
            {**written, "name": "poses", "feeling": FEELINGS[0]}
        )
    except ValidationError as error:
        (first, *_) = error.errors(include_url=False, include_input=False)
        said = first["msg"].removeprefix("Value error, ")
        raise InputError(f"these key poses are not valid: {said}.") from error
    if problems := list(misfits(partner.robot, function)):
        raise InputError("; ".join(problems)[:900] + ".")
    poses = key_poses(partner.robot, function, wish.mood)
    _rehearse(partner, poses)
    return poses


def check_words(text: str, by: By) -> None:
    """Refuse a sentence that could hurt somebody; it may take a moment.

    A call for help is refused from an agent, whose language model may have invented it; a home may
    announce a fire.

    Raises
    ------
    InputError
        The partner does not say this.
    """
    if could_hurt(text) or (by == "agent" and not may_be_said(text)):
        raise InputError(UNSAID)


def acts_of(partner: LivePartner, wish: PerformanceIn, by: By) -> list[Act]:
    """Return the acts of a performance; it may take a moment.

    Raises
    ------
    InputError
        One of the acts cannot be done.
    """
    return [_act(partner, act, by) for act in wish.acts]


def _act(partner: LivePartner, act: GestureAct | LookAct | PosesAct | SpeechAct, by: By) -> Act:
    match act:
        case GestureAct():
            shown = Expression(act.feeling, act.mood)
            return Act(act.offset, expression=shown, poses=shown_by(partner, act))
        case LookAct():
            return Act(act.offset, poses=look(partner.robot, act.at, act.seconds))
        case PosesAct():
            shown_or_none = None if act.feeling is None else Expression(act.feeling, act.mood)
            return Act(act.offset, expression=shown_or_none, poses=poses_of(partner, act))
        case SpeechAct():
            check_words(act.text, by)
            return Act(act.offset, words=act.text)


def _rehearse(partner: LivePartner, poses: Sequence[KeyPose]) -> None:
    from miburi.bodies.rehearsal import rehearse  # it loads MuJoCo

    seconds = sum(pose.duration + pose.hold for pose in poses)
    if seconds > LONGEST:
        raise InputError(f"these poses take {seconds:.1f} s; at most {LONGEST:g} s are allowed.")
    with _REHEARSING:
        tried = rehearse(partner.robot, poses)
    if tried.met is not None:
        raise InputError(f"the robot's {' and '.join(tried.met)} would collide.")
    if tried.stop is not None:
        stop = tried.stop
        raise InputError(f"the contact rule would stop it at {stop.time:.2f} s ({stop.motor}).")
    if tried.ik_error > _MOST_ERROR:
        raise InputError(f"the robot would miss a pose by {1e3 * tried.ik_error:.1f} mm.")
