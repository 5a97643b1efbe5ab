"""A live partner comes before other programs where that is allowed, and runs where it is not."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from miburi.ground.cores import available_cores

ASK = """
import os
from miburi.ground.cores import come_first
come_first(apart=True)
print(os.getpriority(os.PRIO_PROCESS, 0), os.getsid(0) == os.getpid())
"""


MEANWHILE = """
import os
from pathlib import Path
from miburi.ground.cores import coming_first
own = Path("/proc/self/autogroup")
os.setsid()
before = own.read_text()
usual = os.getpriority(os.PRIO_PROCESS, 0)
with coming_first():
    print(own.read_text().split()[-1])
print(own.read_text() == before and os.getpriority(os.PRIO_PROCESS, 0) == usual)
"""


def answer(*before: str) -> list[str]:
    run = [*before, sys.executable, "-c", ASK]
    return subprocess.run(run, capture_output=True, text=True, check=True).stdout.split()


def may() -> bool:
    """Whether a process of ours may take more than its share; root in a container may not."""
    run = [sys.executable, "-c", "import os; os.nice(-1)"]
    return subprocess.run(run, capture_output=True, check=False).returncode == 0


def test_there_is_a_core() -> None:
    assert available_cores() >= 1


@pytest.mark.skipif(sys.platform != "linux", reason="sessions and priorities are Linux's")
def test_a_process_comes_first_where_it_may() -> None:
    nice, apart = answer()
    usual = os.getpriority(os.PRIO_PROCESS, 0)
    assert int(nice) == (min(usual, -10) if may() else usual)
    assert apart == "True"


@pytest.mark.skipif(
    not Path("/proc/self/autogroup").exists(), reason="this kernel shares no time among sessions"
)
def test_the_terminals_session_comes_first_meanwhile() -> None:
    run = [sys.executable, "-c", MEANWHILE]
    nice, back = subprocess.run(run, capture_output=True, text=True, check=True).stdout.split()
    assert (int(nice), back) == (-10 if may() else 0, "True")


@pytest.mark.skipif(sys.platform != "linux", reason="sessions and priorities are Linux's")
def test_without_the_right_nothing_changes() -> None:
    if not may():
        pytest.skip("there is no right here to give up")
    nice, apart = answer("setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice")
    usual = os.getpriority(os.PRIO_PROCESS, 0)
    assert (int(nice), apart) == (usual, "True")
