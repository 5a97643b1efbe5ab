"""Does `miburi fleet --stop all` ever say that robots have stopped which have not?

    python bench/studio/deaf.py [--rounds 10] [--seed 1] > bench/studio/deaf.txt

The partners have no bodies. In each round a few, drawn at random, are deaf: they ignore Stop. A
false success is exit code 0 with a deaf partner present, or a deaf partner reported as stopped.
"""

import argparse
import random
import subprocess
import sys

import paho.mqtt.client as paho
from programs import broker, print_load

from miburi.doors.topics import HomeReport, Topics
from miburi.safety.stop import StopReason

#: Partners, and how many of them are deaf.
CASES = ((5000, 50), (1000, 10), (1000, 1), (1000, 0), (0, 0))


def report(stopped: StopReason | None) -> str:
    return HomeReport(
        feeling="neutral", mood=0, body="resting", paused=False, stopped=stopped, motor=None,
        held=stopped is not None, stops_today=0, temperatures={},
    ).model_dump_json()  # fmt: skip


class Crowd:
    """Partners that announce themselves, and obey unless they are deaf."""

    def __init__(self, port: int) -> None:
        self.client = paho.Client(paho.CallbackAPIVersion.VERSION2)
        self.client.max_queued_messages_set(0)
        self.names: list[str] = []
        self.deaf: set[str] = set()
        self.client.on_message = lambda *_: self._say(
            StopReason.ASKED, [name for name in self.names if name not in self.deaf]
        )
        self.client.connect("127.0.0.1", port)
        self.client.subscribe("miburi/all/stop")
        self.client.loop_start()

    def come(self, count: int, deaf: set[str]) -> None:
        """Announce this many partners, none of them stopped."""
        for gone in self.names[count:]:
            for topic in (Topics(gone).available, Topics(gone).report):
                self.client.publish(topic, "", qos=1, retain=True)
        self.names, self.deaf = [f"p{number}" for number in range(count)], deaf
        for name in self.names:
            self.client.publish(Topics(name).available, "online", qos=1, retain=True)
        self._say(None, self.names)
        last = self.client.publish("miburi/bench", "", qos=1)
        last.wait_for_publish(60)
        assert last.is_published(), "the broker takes nothing"

    def _say(self, stopped: StopReason | None, names: list[str]) -> None:
        for name in names:
            self.client.publish(Topics(name).report, report(stopped), qos=1, retain=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    wish = parser.parse_args()
    rng = random.Random(wish.seed)
    with broker() as port:
        crowd = Crowd(port)
        for count, number in CASES:
            false = named = failures = 0
            for _ in range(wish.rounds):
                deaf = set(rng.sample([f"p{i}" for i in range(count)], number))
                crowd.come(count, deaf)
                done = subprocess.run(
                    [sys.executable, "-m", "miburi", "fleet", "--broker", f"127.0.0.1:{port}",
                     "--stop", "all"], capture_output=True, text=True, check=False, timeout=60,
                )  # fmt: skip
                said = {line.partition(" ")[0] for line in done.stdout.splitlines()}
                false += (done.returncode == 0 and bool(deaf)) or not deaf.isdisjoint(said)
                failures += done.returncode != 0
                named += bool(deaf) and all(name in done.stderr for name in deaf)
            print(f"{count:5} partners, {number:2} deaf: {failures:2} of {wish.rounds} ended "
                  f"with an error, {named:2} named all deaf ones; false successes: {false}",
                  flush=True)  # fmt: skip
    print_load()


if __name__ == "__main__":
    main()
