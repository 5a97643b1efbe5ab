"""``miburi mcp``: a live partner's tools for an assistant that starts this command."""

import os
from typing import Annotated

import typer

__all__ = ["mcp"]


def mcp(
    url: Annotated[str, typer.Option(help="Where the partner lives.")] = "http://127.0.0.1:8080",
) -> None:
    """Give an assistant the partner's tools (MCP) on standard input and output.

    If the partner runs on another computer, the command needs MIBURI_TOKEN, and over https
    MIBURI_AUTHORITY, a file with the certificate of the partner's home authority. Every call checks
    whether a partner is running, so the partner may be started later.
    """
    from miburi.client.asker import Asker
    from miburi.doors.agents import make_agents

    known = os.environ.get("MIBURI_TOKEN"), os.environ.get("MIBURI_AUTHORITY")
    make_agents(Asker.at(url, *known)).run("stdio")
