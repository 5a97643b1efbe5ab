"""`miburi status`, `feel` and `stop`, as somebody at a terminal uses them."""

import json
import re

from tests.fixtures.live import Server
from tests.fixtures.waiting import until
from typer.testing import CliRunner, Result

from miburi.cli.commands import app
from miburi.errors import InputError
from miburi.version import __version__


def miburi(*arguments: str) -> Result:
    return CliRunner().invoke(app, arguments)


def test_somebody_at_a_terminal_lets_it_feel_stops_it_and_sees_why(server: Server) -> None:
    here = ("--url", server.url)
    wrong = miburi("feel", "boredom", *here)
    assert isinstance(wrong.exception, InputError)
    assert "happiness" in str(wrong.exception)
    assert miburi("feel", "surprise", "--strength", "0.9", *here).exit_code == 0
    said = miburi("status", *here).stdout
    assert "feels    surprise" in said
    assert re.search(
        rf"^runs     since \d{{4}}-\d\d-\d\d \d\d:\d\d, Miburi {__version__}$", said, re.M
    )
    assert miburi("stop", *here).stdout.startswith("stopped")
    until(lambda: server.runner.held)
    told = until(lambda: "stopped: " in (said := miburi("status", *here).stdout) and said)
    assert "a person must release it" in told
    assert json.loads(miburi("status", "--json", *here).stdout)["held"]
    nobody = miburi("status", "--url", "http://127.0.0.1:9").exception
    assert "is `miburi run` running there?" in str(nobody)
