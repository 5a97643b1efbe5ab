"""``miburi mcp``: the tools of a running partner, for an assistant that starts this command."""

import os
from typing import Annotated

import typer

__all__ = ["mcp"]


def mcp(
    url: Annotated[str, typer.Option(help="The partner's address.")] = "http://127.0.0.1:8080",
) -> None:
    """Give an assistant the partner's tools (MCP) on standard input and output.

    If the partner runs on another computer, set MIBURI_TOKEN. For https, also set MIBURI_AUTHORITY
    to the file with the certificate of the partner's own authority. Every call checks whether a
    partner is running, so the partner may be started later.
    """
    from miburi.client.asker import Asker
    from miburi.doors.agents import make_agents

    known = os.environ.get("MIBURI_TOKEN"), os.environ.get("MIBURI_AUTHORITY")
    make_agents(Asker.at(url, *known)).run("stdio")
