"""Can two partners with one name live at a broker, and does Stop reach the one that does?

    python bench/studio/names.py [--tries 10] > bench/studio/names.txt

A partner lives at a broker; another is started with its name, again and again. After each try, Stop
is sent by MQTT as a home sends it, and a person releases the body by the face's way.
"""

import argparse
import json
import subprocess
import tempfile
import time
from queue import Empty, SimpleQueue

import httpx
import paho.mqtt.client as paho
from programs import broker, command, partner, print_load

from miburi.doors.topics import Topics

HERE = Topics("hall")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tries", type=int, default=10)
    wish = parser.parse_args()
    reports: SimpleQueue[dict[str, object]] = SimpleQueue()
    changes = refused = stopped = 0
    with broker() as port, tempfile.TemporaryDirectory() as folder:
        home = ("--broker", f"127.0.0.1:{port}", "--name", "hall")
        with partner(*home) as one:

            def hear(_client: object, _data: object, message: paho.MQTTMessage) -> None:
                nonlocal changes
                if message.topic == HERE.available:
                    changes += 1
                else:
                    reports.put(json.loads(message.payload))

            client = paho.Client(paho.CallbackAPIVersion.VERSION2)
            client.on_message = hear
            client.connect("127.0.0.1", port)
            client.subscribe([(HERE.available, 1), (HERE.report, 1)])
            client.loop_start()
            assert _comes(reports, stopped=False), "it has not come to the broker"
            page, release = {"Origin": one.url}, f"{one.url}/api/page/release"
            for _ in range(wish.tries):
                second = subprocess.run(
                    command(folder, *home), capture_output=True, text=True, timeout=60, check=False
                )
                refused += second.returncode != 0
                client.publish(HERE.stop, "", qos=1)
                stopped += _comes(reports, stopped=True)
                while httpx.post(release, json={}, headers=page).is_error:
                    time.sleep(0.2)  # it has not come to rest
                _comes(reports, stopped=False)
    print(f"the second was refused {refused} of {wish.tries} times: {second.stderr.strip()}")
    print(f"Stop reached the first {stopped} of {wish.tries} times; its availability was told "
          f"{changes} times")  # fmt: skip
    print_load()


def _comes(reports: "SimpleQueue[dict[str, object]]", *, stopped: bool) -> bool:
    """Whether a report says so within ten seconds."""
    until = time.perf_counter() + 10.0
    while (left := until - time.perf_counter()) > 0:
        try:
            if (reports.get(timeout=left)["stopped"] is not None) == stopped:
                return True
        except Empty:
            return False
    return False


if __name__ == "__main__":
    main()
