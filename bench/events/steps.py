"""How soon an event is heard, and how many of the robot's steps, on a computer with much to do.

A partner runs as a user runs it, beside a number of busy programs. The stream brings its events;
the WebSocket and ROS bring its steps. Each event's own time tells how late it was heard.

python bench/events/steps.py --load 15 --seconds 60
"""

import argparse
import itertools
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from datetime import datetime

import httpx
import numpy as np
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from websockets.sync.client import connect as open_socket

from miburi.doors.ros_types import JointStateMsg

DOMAIN = 84
#: So that this program finds a partner that stays on this computer.
FIND = (
    "<CycloneDDS><Domain><Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery>"
    "</Domain></CycloneDDS>"
)
_ALL = Qos(Policy.Reliability.Reliable(0), Policy.History.KeepAll)


def hear_events(url: str, until: float, late: list[float]) -> None:
    """Keep how late each event was heard, s."""
    with httpx.stream("GET", f"{url}/api/v1/events", timeout=30.0) as answer:
        for line in answer.iter_lines():
            if line.startswith("data: "):
                event = json.loads(line[6:])
                late.append(time.time() - datetime.fromisoformat(event["wall"]).timestamp())
            if time.time() > until:
                return


def hear_steps(url: str, until: float, serials: list[int]) -> None:
    """Keep the number of each step that is heard."""
    with open_socket(f"{url.replace('http', 'ws')}/api/v1/live?rate=50") as socket:
        while time.time() < until:
            serials.append(json.loads(socket.recv())["serial"])


def hear_ros(until: float, stamps: list[int]) -> None:
    """Keep the stamp of each joint state that is heard, ns."""
    participant = DomainParticipant(DOMAIN)
    reader = DataReader(participant, Topic(participant, "rt/joint_states", JointStateMsg), _ALL)
    while time.time() < until:
        for message in reader.take(500):
            stamp = message.header.stamp
            stamps.append(stamp.sec * 10**9 + stamp.nanosec)
        time.sleep(0.02)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--load", type=int, default=15, help="programs beside it")
    options.add_argument("--seconds", type=float, default=60.0)
    given = options.parse_args()
    os.environ |= {"ROS_DOMAIN_ID": str(DOMAIN), "CYCLONEDDS_URI": FIND}
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "miburi", "run", "--headless", "--port", "0", "--ros"]
        own = {name: value for name, value in os.environ.items() if name != "CYCLONEDDS_URI"}
        run = subprocess.Popen(
            [*command, "--folder", folder], stdout=subprocess.PIPE, text=True, env=own
        )
        assert run.stdout is not None
        found = re.search(r"http://[\d.:]+", run.stdout.readline())
        assert found
        url = found.group()
        busy = [
            subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(given.load)
        ]
        late, serials, stamps = list[float](), list[int](), list[int]()
        until = time.time() + given.seconds
        threads = [
            threading.Thread(target=hear_events, args=(url, until, late)),
            threading.Thread(target=hear_steps, args=(url, until, serials)),
            threading.Thread(target=hear_ros, args=(until, stamps)),
        ]
        for thread in threads:
            thread.start()
        for number in itertools.count():
            if time.time() > until:
                break
            wish = {"text": "Hello."} if number % 2 else {"feeling": "happiness", "mood": 0.7}
            httpx.post(f"{url}/api/v1/{'speak' if number % 2 else 'express'}", json=wish)
            time.sleep(1.0)
        for thread in threads:
            thread.join()
        for one in (*busy, run):
            one.terminate()
            one.wait()
    steps = serials[-1] - serials[0] + 1
    print(f"{given.load} busy programs on {os.cpu_count()} cores, {given.seconds:g} s")
    p50, p99 = np.percentile(1e3 * np.array(late), [50, 99])
    print(f"events: {len(late)}; heard after {p50:.0f} ms (median), {p99:.0f} ms (p99), "
          f"{1e3 * max(late):.0f} ms (latest)")  # fmt: skip
    print(f"WebSocket: {100 * len(set(serials)) / steps:.2f} % of {steps} steps")
    gaps = np.diff(np.array(stamps)) / 1e9
    span = (stamps[-1] - stamps[0]) / 1e9
    missed = int(np.sum(np.round(gaps / 0.02).clip(1) - 1))
    print(f"ROS: {100 * len(stamps) / (len(stamps) + missed):.2f} % of the steps in {span:.0f} s, "
          f"{int(np.sum(gaps <= 0))} equal or earlier stamps")  # fmt: skip


if __name__ == "__main__":
    main()
