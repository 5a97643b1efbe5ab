"""How many reports a home gets from a happy robot, counted over a stretch and set out for a day.

`miburi run` and Mosquitto as they are; somebody is kind to the robot every few seconds, touches it
now and then, and releases it after each contact. Temperatures are left out: the simulated body
reports none.

python bench/events/day.py --minutes 30 --seed 1
"""

import argparse
import collections
import signal
import tempfile
import time
from pathlib import Path

import httpx
import numpy as np
import paho.mqtt.client as paho
from measure import Broker, Partner

#: s between two kind words, on average (ours): far more often than in any home.
BETWEEN = 8.0
#: s between two Stops, on average, and s until the robot is released.
STOPS, RELEASED = 180.0, 4.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng, folder = np.random.default_rng(options.seed), Path(tempfile.mkdtemp())
    broker, heard = Broker(folder), collections.Counter[str]()
    client = paho.Client(paho.CallbackAPIVersion.VERSION2)
    client.on_connect = lambda one, *_: one.subscribe("miburi/#", qos=1)
    client.on_message = lambda _client, _data, message: heard.update(
        [message.topic.rsplit("/", 1)[1]]
    )
    client.connect("127.0.0.1", broker.port)
    client.loop_start()
    partner = Partner(folder, broker.port)
    api = httpx.Client(
        base_url=f"{partner.url}/api/v1", headers={"Miburi-By": "program"}, timeout=10.0
    )
    begin = time.monotonic()
    kind, stop = begin + 1.0, begin + rng.exponential(STOPS)
    done = collections.Counter[str]()
    while time.monotonic() < begin + 60 * options.minutes:
        if time.monotonic() >= kind:
            feeling = rng.choice(["happiness", "thrill", "surprise", "happiness"])
            api.post("/stimulus", json={"feeling": str(feeling), "strength": rng.uniform(0.3, 1)})
            kind += rng.exponential(BETWEEN)
            done["kind words"] += 1
        if time.monotonic() >= stop:
            api.post("/stop")
            time.sleep(RELEASED)
            api.post("/release").raise_for_status()
            stop += rng.exponential(STOPS)
            done["stops"] += 1
        time.sleep(0.1)
    minutes = (time.monotonic() - begin) / 60
    partner.end(signal.SIGTERM)
    client.loop_stop()
    broker.kill()
    print(f"{minutes:.1f} minutes; done: {dict(done)}")
    print(f"heard: {dict(heard)}")
    rate = heard["report"] / minutes
    print(f"reports a minute: {rate:.2f}; a day: {1440 * rate:,.0f}")


if __name__ == "__main__":
    main()
