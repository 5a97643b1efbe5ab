"""Does `miburi fleet --stop all` ever say that robots have stopped which have not?

    python bench/fleet/deaf.py [--rounds 10] [--seed 1] > bench/fleet/deaf.txt

Partners without bodies are at one broker; some of them, drawn anew in each round, do not obey. A
false success is exit code 0 although one was deaf, or a deaf one named as stopped.
"""

import argparse
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import paho.mqtt.client as paho

from miburi.interface.report import HomeReport, Topics
from miburi.safety.stop import StopReason

PORT = 18_834
#: Partners, and how many of them are deaf.
CASES = ((5000, 50), (1000, 10), (1000, 1), (1000, 0), (0, 0))


def report(stopped: StopReason | None) -> str:
    return HomeReport(
        feeling="neutral", mood=0, body="resting", paused=False, stopped=stopped, motor=None,
        held=stopped is not None, stops_today=0, temperatures={},
    ).model_dump_json()  # fmt: skip


class Crowd:
    """Partners that announce themselves, and obey unless they are deaf."""

    def __init__(self) -> None:
        self.client = paho.Client(paho.CallbackAPIVersion.VERSION2)
        self.client.max_queued_messages_set(0)
        self.names: list[str] = []
        self.deaf: set[str] = set()
        self.client.on_message = lambda *_: self._say(
            StopReason.ASKED, [name for name in self.names if name not in self.deaf]
        )
        self.client.connect("127.0.0.1", PORT)
        self.client.subscribe("miburi/all/stop")
        self.client.loop_start()

    def come(self, count: int, deaf: set[str]) -> None:
        """Let so many be there, and none be stopped."""
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
    with tempfile.TemporaryDirectory() as folder:
        conf = Path(folder) / "mosquitto.conf"
        conf.write_text(f"listener {PORT} 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\n")
        broker = subprocess.Popen(["mosquitto", "-c", conf], stderr=subprocess.DEVNULL)
        try:
            time.sleep(1.0)
            crowd = Crowd()
            for count, number in CASES:
                false = named = failures = 0
                for _ in range(wish.rounds):
                    deaf = set(rng.sample([f"p{i}" for i in range(count)], number))
                    crowd.come(count, deaf)
                    done = subprocess.run(
                        [sys.executable, "-m", "miburi", "fleet", "--broker", f"127.0.0.1:{PORT}",
                         "--stop", "all"], capture_output=True, text=True, check=False, timeout=60,
                    )  # fmt: skip
                    said = {line.partition(" ")[0] for line in done.stdout.splitlines()}
                    false += (done.returncode == 0 and bool(deaf)) or not deaf.isdisjoint(said)
                    failures += done.returncode != 0
                    named += bool(deaf) and all(name in done.stderr for name in deaf)
                print(f"{count:5} partners, {number:2} deaf: {failures:2} of {wish.rounds} ended "
                      f"with an error, {named:2} named all deaf ones; false successes: {false}",
                      flush=True)  # fmt: skip
        finally:
            broker.kill()
            broker.wait()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
