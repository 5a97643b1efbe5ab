"""The paper's claims: those that a run can test, and those that no run can."""

from miburi.studies.paper.claim import Claim, Claims, ClaimVerdict
from miburi.studies.paper.experiment_claims import EXPERIMENT
from miburi.studies.paper.gesture_claims import GESTURES
from miburi.studies.paper.kinematics_claims import KINEMATICS
from miburi.studies.paper.safety_claims import SAFETY

CLAIMS: Claims = SAFETY | KINEMATICS | GESTURES | EXPERIMENT
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
