"""``miburi fleet``: all partners at a broker, in the terminal and on a page; stop one or all."""

import asyncio
import sys
from collections.abc import Callable
from socket import socket
from typing import TYPE_CHECKING, Annotated

import typer

from miburi.cli.options import BrokerCertificates
from miburi.errors import BodyError

if TYPE_CHECKING:
    import uvicorn
    from rich.table import Table

    from miburi.doors.broker import Broker
    from miburi.doors.fleet import Fleet, FleetOut


#: The time between two updates of the table, in s.
_PERIOD = 1.0


def fleet(
    broker: Annotated[str, typer.Option(help="\\[mqtt://|mqtts://][USER@]HOST[:PORT]\\[/GROUP].")],
    broker_ca: BrokerCertificates = None,
    port: Annotated[int, typer.Option(help="The page's port; 0 takes a free one.")] = 8090,
    stop: Annotated[
        str | None,
        typer.Option(help="Stop this partner, or all, and list those that confirmed."),
    ] = None,
) -> None:
    """Show all partners at a broker: what they feel, who is stopped and why, who is lost."""
    from miburi.doors.broker import find_broker
    from miburi.doors.fleet import Fleet, stop_and_look

    found = find_broker(broker, broker_ca)
    if stop is not None:
        print("Stopping, and checking whether it has stopped …", file=sys.stderr)
        answers = asyncio.run(stop_and_look(found, stop))
        for name in answers.held:
            print(f"{name} is stopped.")
        for name, wall in answers.off.items():
            since = "" if wall is None else f" at {wall.astimezone():%Y-%m-%d %H:%M}"
            print(f"{name} was switched off{since}, and this broker has not heard of it since.")
        if answers.unknown:
            names = ", ".join(answers.unknown)
            raise BodyError(f"{names} did not confirm it; go there, and use the power switch.")
        return
    _watch(Fleet(found), found, port)


def _watch(fleet: "Fleet", broker: "Broker", port: int) -> None:
    import uvicorn
    from rich.live import Live

    from miburi.serving.access import Gate
    from miburi.serving.addresses import listening
    from miburi.serving.http import configure
    from miburi.studio.fleet_page import make_fleet_app

    with listening("127.0.0.1", port) as listener:
        url = f"http://127.0.0.1:{listener.getsockname()[1]}"
        print(
            f"The fleet at {broker.host}:{broker.port}. Page: {url}   (end with Ctrl-C)", flush=True
        )
        server = uvicorn.Server(configure(Gate(make_fleet_app(fleet))))
        with Live(_table(fleet.news), auto_refresh=False) as live:

            def show() -> None:
                live.update(_table(fleet.news), refresh=True)

            asyncio.run(_serve(server, [listener], show))


async def _serve(server: "uvicorn.Server", sockets: list[socket], show: Callable[[], None]) -> None:
    async def showing() -> None:
        while True:
            await asyncio.sleep(_PERIOD)
            show()

    task = asyncio.create_task(showing())
    try:
        await server.serve(sockets)
    finally:
        task.cancel()


def _table(news: "FleetOut") -> "Table":
    from rich.table import Table

    heads = (
        "partner",
        "feels",
        "body",
        "stopped because",
        "stops today",
        "hottest",
        "runs since",
        "version",
    )
    table = Table(
        *heads,
        caption=None
        if news.connected
        else "No connection to the broker, so Stop reaches no robot from here: stop them at their "
        "own pages, or switch them off.",
    )
    for partner in news.partners:
        report, row = partner.report, [partner.name]
        if report is not None:
            why = [] if report.stopped is None else [report.stopped.spoken, report.motor or ""]
            row += [
                f"{report.feeling} {report.mood} %",
                "stopped" if report.stopped else "paused" if report.paused else "awake",
                " ".join(why).strip(),
                f"{report.stops_today}",
                "" if partner.hottest is None else f"{partner.hottest:.0f} °C",
                "" if report.since is None else f"{report.since.astimezone():%Y-%m-%d %H:%M}",
                report.version or "",
            ]
        gone = partner.lost or partner.off
        if gone:
            row[1:3] = ["", "lost" if partner.lost else "off"]
        stopped = report is not None and report.stopped is not None
        table.add_row(*row, style="dim" if gone else "red" if stopped else "")
    return table
