"""Record runs once, and judge them by any contact rule without physics.

Until a rule stops a body, its motion does not depend on the rule. So :func:`record` runs trials
under a rule that never stops (:class:`DeafRule`), and :func:`judge` applies another rule, to
thousands of runs in a second.
"""

from dataclasses import dataclass

import numpy as np

from miburi.gestures import Repertoire
from miburi.robot import Robot
from miburi.robot.mjcf import TIMESTEP
from miburi.safety.contact import UNLOADED, Contact, Loading, Rule, Watch
from miburi.safety.profile import SECOND, Profile, Steps
from miburi.studies.trials.plant import TrialPlant
from miburi.studies.trials.trial import Run, TrialKind, enact

#: How long, in µs, a deaf rule waits for a blocked motor after the end of its profile.
_WAIT = SECOND // 5


class _DeafWatch(Watch):
    def look(self, positions: Steps, time: int) -> Contact | None:  # noqa: ARG002  (as Watch has it)
        return None

    def arrived(self, positions: Steps, time: int) -> bool:
        late = time >= int(self.profile.total.max()) + _WAIT
        return late or super().arrived(positions, time)


class DeafRule(Rule):
    """A rule that never stops the body: a blocked move ends 0.2 s after its profile.

    Trials use it to record runs, and to test the limit on the motors' torque alone.
    """

    @property
    def at_rest(self) -> Steps:
        """A distance so large that no motor counts as away from its place."""
        return np.full_like(self.guards.slack, 2**30)

    def watch(
        self, profile: Profile, start: Steps, direction: Steps, loading: Loading = UNLOADED
    ) -> Watch:
        """Return a watch that notices nothing."""
        return _DeafWatch(self, profile, start, direction, loading)


@dataclass(frozen=True)
class Judgement:
    """The effect of a rule on a recorded run."""

    stopped_at: float | None  #: s
    latency: float | None  #: s from the first touch; None if there is no stop after a touch
    peak_force: float  #: N, before the stop


def judge(rule: Rule, run: Run) -> Judgement:
    """Return what ``rule`` would have done on the robot's Arduino card in a recorded run."""
    stopped_at = _first_stop(rule, run)
    end = len(run.forces) if stopped_at is None else round(stopped_at / TIMESTEP)
    peak = float(run.forces[: max(end, 1)].max())
    latency = None
    if stopped_at is not None and run.touched_at is not None and stopped_at >= run.touched_at:
        latency = stopped_at - run.touched_at
    return Judgement(stopped_at, latency, peak)


def _first_stop(rule: Rule, run: Run) -> float | None:
    for trace, began in zip(run.traces, run.began, strict=True):
        watch = rule.watch(trace.profile, trace.start, trace.direction, trace.loading)
        for time, positions in zip(trace.times, trace.positions, strict=True):
            elapsed = int(time)
            if watch.look(positions, elapsed) is not None:
                return began + elapsed / SECOND
            if watch.arrived(positions, elapsed):
                break
    return None


def record(
    robot: Robot, seed: int, free: int, blocked: int = 0, repertoire: Repertoire | None = None
) -> list[Run]:
    """Record runs of a robot under a deaf rule, free ones first; see :func:`enact`."""
    plant, rule = TrialPlant(robot), DeafRule.of(robot)
    kinds = [(TrialKind.FREE, index) for index in range(free)]
    kinds += [(TrialKind.BLOCKED, index) for index in range(blocked)]
    return [enact(plant, rule, seed, kind, index, repertoire) for kind, index in kinds]
