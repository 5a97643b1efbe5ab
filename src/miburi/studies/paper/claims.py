"""Test the paper's claims by running the code, and list those that no run can test.

Each function in :data:`CLAIMS` takes a :class:`~miburi.studies.paper.runs.Runs` and returns a
:class:`~miburi.studies.paper.claim.Claim`. Each claim has a name; ``miburi paper --claim NAME``
tests that claim alone.
"""

from collections.abc import Callable

from miburi.studies.paper import (
    experiment_claims,
    gesture_claims,
    kinematics_claims,
    safety_claims,
)
from miburi.studies.paper.claim import Claim, ClaimVerdict
from miburi.studies.paper.runs import Runs

__all__ = ["ABSENT", "CLAIMS"]

#: Each claim's name, and the function that carries it out, in the paper's order.
CLAIMS: dict[str, Callable[[Runs], Claim]] = {
    carry_out.__name__.replace("_", "-"): carry_out
    for carry_out in (
        safety_claims.always_active,
        safety_claims.on_the_card,
        safety_claims.one_motor_stops_all,
        safety_claims.stops_at_once,
        safety_claims.period_and_limit,
        safety_claims.period_and_card,
        safety_claims.upper_arms,
        safety_claims.effort,
        kinematics_claims.table_1,
        kinematics_claims.denavit_hartenberg,
        kinematics_claims.equations,
        kinematics_claims.eight_solutions,
        kinematics_claims.one_solution,
        kinematics_claims.levenberg_marquardt,
        kinematics_claims.promise,
        kinematics_claims.promise_of_reference_9,
        kinematics_claims.within_a_second,
        gesture_claims.emotion_before_mood,
        gesture_claims.repetition,
        gesture_claims.strongest_emotion,
        gesture_claims.mood_changes_no_gesture,
        gesture_claims.space_and_time,
        gesture_claims.twenty_percent,
        gesture_claims.back_to_neutral,
        gesture_claims.healing,
        experiment_claims.whenever_and_only_when,
        experiment_claims.slower_and_smaller,
        experiment_claims.period,
        experiment_claims.right_positions,
    )
}
#: Claims that no run can check.
ABSENT = tuple(
    Claim(section, sentence, ClaimVerdict.UNKNOWN, why)
    for section, sentence, why in (
        ("3, 4", "The movements “seem natural to the user”.", "nobody has been asked"),
        ("2", "A smartphone is the host and sends over Bluetooth.", "the host here is a computer; "
         "a phone can be the face"),
        ("2", "The robot is built, with cheap motors; the price is one of its main arguments.",
         "the body is simulated, the firmware runs on an emulated card, and nobody has bought the "
         "parts; `miburi hardware bill` has prices and where they were seen"),
        ("6", "It is “useful for elder people”.", "nobody has been asked"),
    )
)  # fmt: skip
