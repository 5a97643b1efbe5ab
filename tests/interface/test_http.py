"""The server's own limits: on headers, on connections, and on who is who."""

import httpx
from tests.fixtures.live import interface, serving

from miburi.interface.access import BURST, Gate
from miburi.live.runner import Runner


def test_a_header_that_anybody_can_write_lifts_no_limit(runner: Runner) -> None:
    gate = Gate(interface(runner), clock=lambda: 0.0)
    with serving(gate) as url, httpx.Client(base_url=url) as client:
        answers = [
            client.get("/api/v1/state", headers={"X-Forwarded-For": f"10.0.0.{i}"}).status_code
            for i in range(int(BURST) + 2)
        ]
    assert answers == [200] * int(BURST) + [429] * 2
