"""Send a live partner what its interface does not promise to understand.

    python bench/studio/fuzz.py [--messages 100000] [--minutes 10] [--seed 1]

Messages over the WebSocket, from a seed: bytes, broken JSON, JSON of any shape, and commands with a
value changed. Then Schemathesis, for so many minutes and within the allowance of an address.
It prints how each ended, and what the partner said on stderr. Exit 1: something did not hold.
"""

import argparse
import json
import random
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import httpx
from measure import memory
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.protocol import State
from websockets.sync.client import connect

SOCKETS = 8
COMMANDS = (
    {"do": "hand", "position": [0.05, -0.24, 0.16], "along": [1.0, 0.0, 0.0]},
    {"do": "hand", "position": None},
    {"do": "stimulus", "feeling": "happiness", "strength": 0.5, "source": "program"},
    {"do": "stop"},
    {"do": "release"},
    {"do": "rate", "rate": 30},
)
NASTY = (None, True, -1, 0, 1e308, -1e-308, 2**70, "", "\0", "stop", "\ud800", "ß" * 300, [], {},
         [[[[]]]], float("nan"), float("inf"), "__proto__", "'; --", [0.0] * 9)  # fmt: skip


def value(rng: random.Random, depth: int = 0) -> object:
    """Draw anything that JSON can say, and a little more."""
    kind = rng.randrange(4 if depth < 6 else 2)
    if kind == 2:
        return [value(rng, depth + 1) for _ in range(rng.randrange(4))]
    if kind == 3:
        return {str(rng.choice(NASTY)): value(rng, depth + 1) for _ in range(rng.randrange(4))}
    return rng.choice(NASTY) if kind else rng.uniform(-1e6, 1e6)


def message(rng: random.Random) -> str | bytes:
    """Draw a message."""
    kind = rng.randrange(6)
    if kind == 0:
        return rng.randbytes(rng.randrange(60))
    if kind == 1:
        return "[" * rng.randrange(1, 3000)
    if kind == 2:
        return json.dumps(value(rng))
    command: dict[str, object] = dict(rng.choice(COMMANDS))
    if kind > 3:
        command[rng.choice([*command, "extra"])] = value(rng)
    text = json.dumps(command)
    cut = rng.randrange(len(text))
    return text[:cut] + chr(rng.randrange(1, 0xD7FF)) + text[cut:] if kind == 3 else text


def send(url: str, messages: list[str | bytes]) -> Counter[str]:
    """Send messages over sockets that are opened again whenever the partner has had enough."""
    ends, left, address = Counter[str](), iter(messages), "ws" + url.removeprefix("http")
    more = True
    while more:
        try:
            with connect(
                address + "/api/v1/live?rate=1", open_timeout=30, max_queue=None
            ) as socket:
                for number, told in enumerate(left):
                    socket.send(told)
                    if number % 16 == 15:  # or they wait in a pipe that is closed, and nobody reads
                        pong = socket.ping()
                        while not pong.wait(0.05) and socket.protocol.state is State.OPEN:
                            pass
                more = False
        except ConnectionClosed as error:
            ends[f"closed with {error.rcvd.code if error.rcvd else 'nothing'}"] += 1
        except InvalidStatus as error:  # so many connections in a short time
            ends[f"refused with {error.response.status_code}"] += 1
            time.sleep(0.05)  # the allowance fills again
    return ends


def stop(url: str) -> str:
    """Press Stop, and say what came back."""
    with httpx.Client(base_url=url + "/api/v1", timeout=5) as client:
        before = time.monotonic()
        answer = client.post("/stop")
        took = time.monotonic() - before
        # The answer comes past the server, which hears of it a step or two later.
        held = any(client.get("/state").json()["held"] for _ in range(100))
    return f"{answer.status_code} after {1000 * took:.0f} ms, {'held' if held else 'NOT HELD'}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=100_000)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    wish = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "miburi", "run", "--headless", "--port", "0",
                   "--folder", folder]  # fmt: skip
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert process.stdout
        said = process.stdout.readline()
        found = re.search(r"http://[\d.:]+", said)
        assert found, said
        url = found.group()
        httpx.get(url + "/")
        before = memory(process.pid)
        rng = random.Random(wish.seed)
        messages = [message(rng) for _ in range(wish.messages)]
        with ThreadPoolExecutor(SOCKETS) as pool:  # each is read at the loop's pace
            parts = [messages[first::SOCKETS] for first in range(SOCKETS)]
            ends = sum(pool.map(partial(send, url), parts), Counter[str]())
        print(f"{wish.messages} messages: {dict(ends)}")
        print(f"memory: {before:.0f} → {memory(process.pid):.0f} MB; Stop: {stop(url)}")
        scan = Path(sys.executable).with_name("st")
        checks = "not_a_server_error,status_code_conformance,content_type_conformance," \
                 "response_schema_conformance,response_headers_conformance"  # fmt: skip
        described = subprocess.run(
            [scan, "run", url + "/api/openapi.json", "--max-time", str(round(60 * wish.minutes)),
             "--rate-limit", "45/s", "--seed", str(wish.seed), "--checks", checks],
            capture_output=True, text=True, check=False, cwd=folder,
        )  # fmt: skip
        cases = re.search(r"\d+ generated.*", described.stdout)
        print(f"schemathesis, {wish.minutes:g} minutes: {cases.group() if cases else ''}, "
              f"exit {described.returncode}")  # fmt: skip
        print(f"memory: {memory(process.pid):.0f} MB; Stop: {stop(url)}")
        alive = process.poll() is None
        process.terminate()
        errors = process.communicate(timeout=60)[1].replace(folder, "FOLDER")
        told = [line for line in errors.splitlines() if not line.startswith(url)]  # of a probe
    print(f"alive: {alive}; exit {process.returncode}; on stderr: {told or 'nothing'}")
    sys.exit(not (alive and described.returncode == process.returncode == 0 and not told))


if __name__ == "__main__":
    main()
