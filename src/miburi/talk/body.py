"""What the partner's body does, as slots of its answers.

It takes the partner's state, and returns the slots ``moving``, ``paused`` and ``stopped``, each
only while the body is in this condition. ``stopped`` says why the body has stopped, in a language's
words. Some intents need one of these slots: "Pack it in" stops a body that moves, and is small talk
otherwise.
"""

from miburi.languages import Language
from miburi.live.state import State
from miburi.talk.script import script

#: The name of the line for reasons that a script does not name.
_OTHER = "other"


def slots_of(state: State, language: Language) -> dict[str, str]:
    """Return the slots for what the body does."""
    if state.stop is not None:
        whys = script(language).whys
        why = whys.get(state.stop.reason.value, whys.get(_OTHER))
        return {} if why is None else {"stopped": why}
    if state.paused:
        return {"paused": ""}
    return {"moving": ""} if state.phase in ("moving", "returning") else {}
