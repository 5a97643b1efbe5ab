"""``miburi words`` and ``miburi say``: parse, call, print."""

import json
import os
import sys
from dataclasses import asdict
from typing import Annotated

import typer

from miburi.errors import InputError

__all__ = ["say", "words"]


def words(
    as_json: Annotated[
        bool, typer.Option("--json", help="Answer as JSON: feeling (or null), strength, why.")
    ] = False,
) -> None:
    """Say what each line on standard input shows of a feeling, and which words spoke for it."""
    if sys.stdin.isatty():
        raise InputError("give sentences on standard input, a line each.")
    from miburi.senses.words import hear

    for line in sys.stdin.buffer:
        heard = hear(line.decode(errors="replace").strip())
        if as_json:
            why = [asdict(part) for part in heard.why]
            answer = {"feeling": heard.feeling, "strength": round(heard.strength, 4), "why": why}
            print(json.dumps(answer, ensure_ascii=False), flush=True)
        else:
            print(heard.reason, flush=True)


def say(
    text: Annotated[str, typer.Argument(help="In English or Japanese.")],
    url: Annotated[str, typer.Option(help="Where the partner lives.")] = "http://127.0.0.1:8080",
) -> None:
    """Say something to a live partner.

    Away from its computer it needs MIBURI_TOKEN, and by https MIBURI_AUTHORITY.
    """
    from miburi.interface.client import connect
    from miburi.senses import Brought, Impression

    known = os.environ.get("MIBURI_TOKEN"), os.environ.get("MIBURI_AUTHORITY")
    with connect(url, *known) as partner:
        heard = partner.say(text)
    why = tuple(Brought(part.what, part.weight) for part in heard.why)
    print(Impression(heard.feeling, heard.strength, "speech", why).reason)
    for stimulus in heard.felt:
        print(f"it feels {stimulus.feeling} {stimulus.strength:.2f}")
    if heard.answer:
        print(f"it says: {heard.answer}")
