"""``miburi status``, ``feel``, ``stop`` and ``mcp``: use a running partner from a terminal."""

import os
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from miburi.client.remote import RemotePartner
    from miburi.live.state import State
    from miburi.wire.robot import RobotOut


PartnerAddress = Annotated[str, typer.Option("--url", help="Where the partner lives.")]
#: The default address of a partner.
HERE = "http://127.0.0.1:8080"


def partner_at(url: str) -> "RemotePartner":
    """Connect to the partner at an address, with MIBURI_TOKEN and MIBURI_AUTHORITY."""
    from miburi.client.remote import connect

    return connect(url, *_known())


def _known() -> tuple[str | None, str | None]:
    return os.environ.get("MIBURI_TOKEN"), os.environ.get("MIBURI_AUTHORITY")


def mcp(url: Annotated[str, typer.Option(help="The partner's address.")] = HERE) -> None:
    """Give an assistant the partner's tools (MCP) on standard input and output.

    If the partner runs on another computer, set MIBURI_TOKEN. For https, also set MIBURI_AUTHORITY
    to the file with the certificate of the partner's own authority. Every call checks whether a
    partner is running, so the partner may be started later.
    """
    from miburi.client.asker import Asker
    from miburi.doors.agents import make_agents

    make_agents(Asker.at(url, *_known())).run("stdio")


def status(
    url: PartnerAddress = HERE,
    as_json: Annotated[bool, typer.Option("--json", help="Print the whole state as JSON.")] = False,
) -> None:
    """Print the state of a live partner: what it feels, whether its body is stopped, and why."""
    with partner_at(url) as partner:
        state, robot = partner.state, partner.robot
    print(state.model_dump_json() if as_json else _in_words(state, robot))


def feel(
    feeling: Annotated[str, typer.Argument(help="Such as happiness.")],
    strength: Annotated[float, typer.Option(help="0 to 1.")] = 0.8,
    url: PartnerAddress = HERE,
) -> None:
    """Make a running partner feel something; it decides what to show."""
    from miburi.feelings import Stimulus

    with partner_at(url) as partner:
        partner.stimulate(Stimulus(feeling, strength))
        felt = partner.state.felt
    print("it feels nothing strongly" if felt is None else f"it feels {felt.feeling}")


def stop(url: PartnerAddress = HERE) -> None:
    """Stop all motors of a live partner, until a person releases them in the studio."""
    with partner_at(url) as partner:
        partner.stop(by_person=True)
    print("stopped; a person can release it in the studio or on the face's page.")


def _in_words(state: "State", robot: "RobotOut") -> str:
    felt = (
        "nothing strongly" if state.felt is None else f"{state.felt.feeling} {state.felt.mood:.2f}"
    )
    lines = [f"feels    {felt}"]
    if state.stop is None:
        lines.append(f"body     {'paused' if state.paused else state.phase} ({state.body})")
    else:
        motor = "" if state.stop.motor is None else f" at the {state.stop.motor.replace('_', ' ')}"
        waits = "; a person must release it" if state.held else ""
        lines.append(f"body     stopped: {state.stop.reason.spoken}{motor}{waits}")
    lines.append(f"nature   {state.temperament}")
    if robot.since is not None:
        since = f"{robot.since.astimezone():%Y-%m-%d %H:%M}"
        lines.append(f"runs     since {since}, Miburi {robot.version}")
    return "\n".join(lines)
