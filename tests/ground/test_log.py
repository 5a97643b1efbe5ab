"""What fails in a thread or a process of ours leaves its traceback on stderr."""

import re
import subprocess
import sys
import threading

import pytest

from miburi.errors import InputError
from miburi.ground.log import VARIABLE, log_to_stderr

FAILS = """
import threading
from miburi.ground.log import log_to_stderr, logged
def mistake():
    return {}["angles"]
log_to_stderr()
thread = threading.Thread(target=mistake, name="the-thread")
thread.start()
thread.join()
logged(mistake)
"""


def test_a_thread_and_a_process_that_fail_leave_their_tracebacks() -> None:
    done = subprocess.run(
        [sys.executable, "-c", FAILS], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    time = r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d[+-]\d{4} "
    for failed in ("the thread the-thread", "the process mistake"):
        assert re.search(f"{time}miburi: {failed} has failed\nTraceback", done.stderr, re.M)
    assert done.stderr.count("KeyError: 'angles'") == 2


def test_the_level_is_one_that_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)  # as it was, afterwards
    monkeypatch.setenv(VARIABLE, "loud")
    with pytest.raises(InputError, match="'loud'"):
        log_to_stderr()
