"""The clock of a live partner: a thread that times its steps, and a watchdog."""

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from miburi.live.watchdog import Lateness, Watchdog

if TYPE_CHECKING:
    from miburi.live.runner import Runner


#: The loop's period, in s; the encoders are read twice in each period.
STEP = 0.02
#: If the loop is further behind than this, in s, it does not hurry to catch up: the robot's time
#: falls behind instead.
_PATIENCE = 0.2
#: The loop gives up after this many failed steps in a row, which take one second.
_FAILURES = 50


class Pace:
    """Runs a partner's steps by the clock; ``lateness`` has the delays its watchdog allows."""

    def __init__(self, runner: "Runner", lateness: Lateness) -> None:
        self._runner = runner
        self._watchdog = Watchdog(STEP, runner.halt, lambda: self._give_up("hangs"), lateness)
        self._thread: threading.Thread | None = None
        self._ending, self._over = threading.Event(), threading.Event()
        self._failures, self._patience = 0, 0.0
        self._on_failure: Callable[[], None] = lambda: None
        #: Why the loop was abandoned; None while it runs.
        self.failure: str | None = None

    def start(self, on_failure: Callable[[], None]) -> None:
        """Start both threads; either calls ``on_failure`` if the loop is abandoned."""
        self._on_failure = on_failure
        self._watchdog.beat()
        self._thread = threading.Thread(target=self._run, name="partner", daemon=True)
        self._thread.start()
        threading.Thread(target=self._watchdog.watch, args=(self._over,), daemon=True).start()

    def end(self, patience: float) -> None:
        """Return to neutral within ``patience`` s, and end both threads."""
        if self._thread is None:
            return
        self._patience = patience
        self._ending.set()
        self._thread.join(None if self.failure is None else 1.0)
        self._over.set()
        if self.failure is None:
            self._thread = None

    def _run(self) -> None:
        due = time.monotonic()
        give_up = None
        while True:
            if self._ending.is_set() and give_up is None:
                give_up = time.monotonic() + self._patience
                self._runner.rest()
            self._watchdog.beat()
            try:
                self._runner.tick()
                self._failures = 0
            except Exception as error:
                self._fail(error)
            if self.failure is not None:
                return
            if give_up is not None and (self._runner.settled or time.monotonic() > give_up):
                return
            due += STEP
            ahead = due - time.monotonic()
            if ahead > 0:
                time.sleep(ahead)
            elif ahead < -_PATIENCE:
                due = time.monotonic()

    def _fail(self, error: Exception) -> None:
        """Stop the body, and go on with the next step; give up after too many failures."""
        self._runner.halt()
        self._runner.excuse(error, "loop_failed")
        self._failures += 1
        if self._failures >= _FAILURES:
            self._give_up(f"fails at every step ({type(error).__name__}: {error})")

    def _give_up(self, why: str) -> None:
        self.failure = f"the partner's loop {why}; the body has been stopped where it was."
        self._on_failure()
