"""Can two partners with one name live at a broker, and does Stop reach the one that does?

    python bench/fleet/names.py [--tries 10] > bench/fleet/names.txt

A partner lives at a broker; another is started with its name, again and again. After each try, Stop
is sent by MQTT as a home sends it, and a person releases the body by the face's way.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from queue import Empty, SimpleQueue

import httpx
import paho.mqtt.client as paho

from miburi.interface.report import Topics

PORT = 18_835
HERE = Topics("hall")


def run(folder: str) -> list[str]:
    return [
        sys.executable, "-m", "miburi", "run", "--headless", "--port", "0", "--folder", folder,
        "--forget", "--broker", f"127.0.0.1:{PORT}", "--name", "hall",
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tries", type=int, default=10)
    wish = parser.parse_args()
    reports: SimpleQueue[dict[str, object]] = SimpleQueue()
    changes = refused = stopped = 0
    with tempfile.TemporaryDirectory() as folder:
        conf = Path(folder) / "mosquitto.conf"
        conf.write_text(f"listener {PORT} 127.0.0.1\nallow_anonymous true\n")
        broker = subprocess.Popen(["mosquitto", "-c", conf], stderr=subprocess.DEVNULL)
        time.sleep(1.0)
        process = subprocess.Popen(run(f"{folder}/one"), stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            found = re.search(r"http://[\d.:]+", process.stdout.readline())
            assert found
            url = found.group()

            def hear(_client: object, _data: object, message: paho.MQTTMessage) -> None:
                nonlocal changes
                if message.topic == HERE.available:
                    changes += 1
                else:
                    reports.put(json.loads(message.payload))

            client = paho.Client(paho.CallbackAPIVersion.VERSION2)
            client.on_message = hear
            client.connect("127.0.0.1", PORT)
            client.subscribe([(HERE.available, 1), (HERE.report, 1)])
            client.loop_start()
            assert _comes(reports, stopped=False), "it has not come to the broker"
            for _ in range(wish.tries):
                second = subprocess.run(
                    run(f"{folder}/two"), capture_output=True, text=True, timeout=60, check=False
                )
                refused += second.returncode != 0
                client.publish(HERE.stop, "", qos=1)
                stopped += _comes(reports, stopped=True)
                while httpx.post(
                    f"{url}/api/page/release", json={}, headers={"Origin": url}
                ).is_error:
                    time.sleep(0.2)  # it has not come to rest
                _comes(reports, stopped=False)
        finally:
            process.terminate()
            process.wait()
            broker.kill()
            broker.wait()
    print(f"the second was refused {refused} of {wish.tries} times: {second.stderr.strip()}")
    print(f"Stop reached the first {stopped} of {wish.tries} times; its availability was told "
          f"{changes} times")  # fmt: skip
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


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
