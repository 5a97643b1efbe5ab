"""``miburi status``, ``miburi feel`` and ``miburi stop``: use a running partner from a terminal."""

import os
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from miburi.client.remote import RemotePartner
    from miburi.live.state import State

__all__ = ["HERE", "PartnerAddress", "feel", "partner_at", "status", "stop"]

PartnerAddress = Annotated[str, typer.Option("--url", help="Where the partner lives.")]
#: The default address of a partner.
HERE = "http://127.0.0.1:8080"


def partner_at(url: str) -> "RemotePartner":
    """Connect to the partner at an address, with MIBURI_TOKEN and MIBURI_AUTHORITY."""
    from miburi.client.remote import connect

    return connect(url, os.environ.get("MIBURI_TOKEN"), os.environ.get("MIBURI_AUTHORITY"))


def status(
    url: PartnerAddress = HERE,
    as_json: Annotated[bool, typer.Option("--json", help="Print the whole state as JSON.")] = False,
) -> None:
    """Print the state of a live partner: what it feels, whether its body is stopped, and why."""
    with partner_at(url) as partner:
        state = partner.state
    print(state.model_dump_json() if as_json else _in_words(state))


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


def _in_words(state: "State") -> str:
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
    return "\n".join(lines)
