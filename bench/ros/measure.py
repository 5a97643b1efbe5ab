"""What the door for ROS 2 costs: the server's cores without it, with it, and with a listener.

Each round wakes a partner as a user does and looks at the CPU time of its server's process, in
which the door is; the listener is Cyclone DDS's own command, in a process of its own. The three
ways take turns.

    python bench/ros/measure.py > bench/ros/measure.txt
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROUNDS, SECONDS = 4, 6.0
DOMAIN = "83"
WAYS = {"no door": ([], []), "door": (["--ros"], []),
        "door, heard": (["--ros"], ["rt/joint_states", "rt/tf"])}  # fmt: skip
#: So that the command finds a partner that stays on this computer.
FIND = (
    "<CycloneDDS><Domain><Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery>"
    "</Domain></CycloneDDS>"
)


def cpu(pid: int) -> float:
    """CPU seconds that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def server_of(pid: int) -> int:
    """The process that serves: the child with the most memory."""
    children = map(
        int, Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="utf-8").split()
    )
    return max(
        children,
        key=lambda one: int(Path(f"/proc/{one}/statm").read_text(encoding="utf-8").split()[1]),
    )


def measure(options: list[str], topics: list[str]) -> float:
    environment = os.environ | {"ROS_DOMAIN_ID": DOMAIN}
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.Popen(
            [sys.executable, "-m", "miburi", "run", "--headless", "--port", "0", "--forget",
             "--folder", folder, *options],
            stdout=subprocess.PIPE, env=environment, text=True,
        )  # fmt: skip
        while "awake" not in run.stdout.readline():
            pass
        heard = [
            subprocess.Popen(
                ["cyclonedds", "subscribe", "-i", DOMAIN, "-r", "4s", topic],
                stdout=subprocess.DEVNULL, env=environment | {"CYCLONEDDS_URI": FIND},
            )
            for topic in topics
        ]  # fmt: skip
        time.sleep(7)  # their scan of 4 s is over, and they listen
        server = server_of(run.pid)
        before, then = cpu(server), time.monotonic()
        time.sleep(SECONDS)  # what is measured is what passes meanwhile
        used = (cpu(server) - before) / (time.monotonic() - then)
        for process in (*heard, run):
            process.terminate()
            process.wait()
        return used


def main() -> None:
    results: dict[str, list[float]] = {way: [] for way in WAYS}
    for _ in range(ROUNDS):
        for way, (options, topics) in WAYS.items():
            results[way].append(measure(options, topics))
    print(f"{ROUNDS} rounds of {SECONDS:g} s; the server's cores, median (lowest–highest)")
    for way, used in results.items():
        print(f"{way:>12}  {statistics.median(used):.3f} ({min(used):.3f}–{max(used):.3f})")


if __name__ == "__main__":
    main()
