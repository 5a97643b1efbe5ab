"""Each claim that holds stops holding when the thing that it is about is broken."""

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from miburi.emulation.firmware import EmulatedCard
from miburi.feelings import EmotionalModel
from miburi.robot import JOINTS, Robot, iphonoid
from miburi.safety.controller import Controller
from miburi.safety.stop import Phase
from miburi.studies.paper import runs as paper_runs
from miburi.studies.paper.claim import ClaimVerdict
from miburi.studies.paper.claims import CLAIMS
from miburi.studies.paper.runs import Runs
from miburi.studies.trials.trial import Outcome

Break = Callable[[pytest.MonkeyPatch], Runs]
HOLDS = (ClaimVerdict.HOLDS, ClaimVerdict.HOLDS_IF)


def small(robot: Robot | None = None) -> Runs:
    return Runs(robot or iphonoid(), targets=5, seeds=1, trials=25)


@cache
def sound() -> Runs:
    """Runs of an unbroken robot: its trials are looked at by several tests."""
    return small()


def patched(owner: object, name: str, value: object) -> Break:
    def broken(patch: pytest.MonkeyPatch) -> Runs:
        patch.setattr(owner, name, value)
        return small()

    return broken


def without_rule_while(phase: Phase) -> Break:
    update = Controller.update

    def deaf(self: Controller, positions: np.ndarray, time: int) -> None:
        if self.phase is not phase or self.watch.arrived(positions, time - self.began):
            update(self, positions, time)

    return patched(Controller, "update", deaf)


def only_one_stops(patch: pytest.MonkeyPatch) -> Runs:
    """Stop the motor that is behind; the others go on."""
    update, setpoint = Controller.update, Controller.setpoint
    going: dict[int, Controller] = {}

    def updated(self: Controller, positions: np.ndarray, time: int) -> None:
        before = copy(self)
        update(self, positions, time)
        if before.phase is not Phase.STOPPED and self.phase is Phase.STOPPED:
            going[id(self)] = before

    def split(self: Controller, time: int) -> np.ndarray:
        stop, before = self.latched, going.get(id(self))
        if stop is None or stop.motor is None or before is None:
            return setpoint(self, time)
        named = np.arange(8) == JOINTS.index(stop.motor)
        return np.where(named, setpoint(self, time), setpoint(before, time))

    patch.setattr(Controller, "update", updated)
    patch.setattr(Controller, "setpoint", split)
    return small()


def stays(self: Controller, positions: np.ndarray, time: int) -> None:
    """Release a body where it is."""
    self.latched = None
    self.start(Phase.RETURNING, self.origin, np.ones_like(positions), positions, time)


def outcomes(change: Callable[[Outcome], Outcome]) -> Break:
    """Change the outcomes of trials that touch somebody."""

    def broken(patch: pytest.MonkeyPatch) -> Runs:
        found = [change(one) if one.touched else one for one in sound().outcomes]
        patch.setattr(Runs, "outcomes", found)
        return small()

    return broken


def unnoticed(patch: pytest.MonkeyPatch) -> Runs:
    patch.setattr(Runs, "outcomes", sound().outcomes)
    return without_rule_while(Phase.MOVING)(patch)


SLOW = paper_runs.OnCard(None, 0.0, np.array([0.02, 0.12]))

#: For each claim about contacts that holds, one fault or more of the body that it must notice.
BREAKS: dict[str, list[Break]] = {
    "always-active": [
        without_rule_while(phase) for phase in (Phase.MOVING, Phase.RETURNING, Phase.IDLE)
    ],
    "on-the-card": [patched(EmulatedCard, "wait", lambda _self, _until: None)],  # no host, no card
    "one-motor-stops-all": [only_one_stops],
    "stops-at-once": [outcomes(lambda one: replace(one, latency=one.latency + 1.0))],
    "period-and-card": [patched(Runs, "on_card", SLOW)],
    "effort": [outcomes(lambda one: replace(one, sustained_force=3 * one.sustained_force))],
    "twenty-percent": [patched(EmotionalModel, "contact", lambda _self: None)],
    "back-to-neutral": [patched(Controller, "release", stays)],
    "whenever-and-only-when": [
        outcomes(lambda one: replace(one, stopped=False, sustained_force=2.5)), unnoticed
    ],
    "slower-and-smaller": [patched(EmotionalModel, "contact", lambda _self: None)],
}  # fmt: skip


@pytest.mark.proof("test_the_page_in_the_documents_has_the_numbers_of_today")
@pytest.mark.parametrize(
    ("name", "broken"),
    [pytest.param(name, broken, id=f"{name}-{k}") for name, breaks in BREAKS.items()
     for k, broken in enumerate(breaks)],
)  # fmt: skip
def test_a_claim_notices_the_fault_that_it_is_about(
    name: str, broken: Break, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = broken(monkeypatch)
    if name == "on-the-card" and runs.on_card is None:
        pytest.skip("needs the emulated card: make firmware")
    assert CLAIMS[name](runs).verdict not in HOLDS
