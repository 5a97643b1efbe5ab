"""``miburi run``: parse the arguments and start the live partner."""

import asyncio
import re
import socket
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from miburi.cli.options import (
    BrokerCertificates,
    CalibrationFile,
    EmotionalModelName,
    GesturesFolder,
    IkWay,
    LanguagesFolder,
    RobotFile,
    SensesFile,
    ServoName,
    TemperamentName,
    calibrated,
    emotional_model_of,
    load_gestures,
    robot_of,
    settings_of,
    temperament_of,
    warn_of_meetings,
    warn_of_misfits,
)
from miburi.errors import InputError
from miburi.ground.log import LEVELS, VARIABLE, log_to_stderr

if TYPE_CHECKING:
    from miburi.doors.doors import Doors
    from miburi.talk.endpoint import Endpoint


def run(
    body: Annotated[str, typer.Option(help="simulated, card or emulated-card.")] = "simulated",
    serial: Annotated[str | None, typer.Option(help="A card's serial port.")] = None,
    https: Annotated[
        bool,
        typer.Option(
            "--https", help="Let phones connect with a token, and use their camera and microphone."
        ),
    ] = False,
    host: Annotated[
        str | None,
        typer.Option(
            help="The address to listen on; 0.0.0.0 lets others in, with a token. "
            "Default: 127.0.0.1, or 0.0.0.0 with --https."
        ),
    ] = None,
    port: Annotated[
        int, typer.Option(help="The port for http; the next is for https. 0: any free one.")
    ] = 8080,
    headless: Annotated[bool, typer.Option("--headless", help="Do not open a browser.")] = False,
    agents: Annotated[bool, typer.Option("--agents", help="Let agents in at /mcp (MCP).")] = False,
    broker: Annotated[
        str | None,
        typer.Option(
            help="A home's MQTT broker: \\[mqtt://|mqtts://][USER@]HOST[:PORT]\\[/GROUP]."
        ),
    ] = None,
    broker_ca: BrokerCertificates = None,
    ros: Annotated[bool, typer.Option("--ros", help="Connect to ROS 2 nodes over DDS.")] = False,
    name: Annotated[
        str | None,
        typer.Option(
            help="The partner's name at a broker (default: this computer's), its namespace in ROS "
            "(default: none)."
        ),
    ] = None,
    talk: Annotated[
        str | None,
        typer.Option(
            help="The server of a language model that answers people, such as "
            "http://localhost:11434/v1. By default nothing leaves this computer."
        ),
    ] = None,
    model: Annotated[str | None, typer.Option(help="The model's name on that server.")] = None,
    voice: Annotated[
        str | None,
        typer.Option(
            help="flite: this computer synthesises English speech for all pages whose voice is "
            "on; by default each device uses its own voice."
        ),
    ] = None,
    region: Annotated[
        str | None,
        typer.Option(
            help="Where you live, such as GB or JP: the partner names that region's emergency "
            "numbers to somebody in distress. It calls nobody itself."
        ),
    ] = None,
    temperament: TemperamentName = "playful",
    emotional_model: EmotionalModelName = "cascade",
    robot: RobotFile = None,
    servo: ServoName = None,
    gestures: GesturesFolder = None,
    senses: SensesFile = None,  # noqa: ARG001  (its callback hands it on)
    languages: LanguagesFolder = None,  # noqa: ARG001  (its callback hands it on)
    calibration: CalibrationFile = None,
    solver: IkWay = "default",
    folder: Annotated[
        Path | None,
        typer.Option(
            help="Folder for token, feelings and recordings; default: ~/.local/state/miburi."
        ),
    ] = None,
    forget: Annotated[
        bool, typer.Option("--forget", help="Delete the moods of the last run.")
    ] = False,
    rest: Annotated[
        Literal["still", "quiet", "lively"] | None,
        typer.Option(
            help="How much the partner moves while idle; default: as its temperament says."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="The seed of the gestures' variations; 0 or more.")] = 0,
    programs_may_release: Annotated[
        bool,
        typer.Option(
            "--programs-may-release", help="Let programs release the body after a person's Stop."
        ),
    ] = False,
    allow_origin: Annotated[
        list[str] | None,
        typer.Option(
            help="Let web pages from this origin use the interface, such as https://example.org; "
            "give it once for each."
        ),
    ] = None,
    door: Annotated[
        list[str] | None,
        typer.Option(help="Also open this door, from another installed package."),
    ] = None,
    log_level: Annotated[
        str,
        typer.Option(
            envvar=VARIABLE,
            help=f"The lowest level to log: {', '.join(LEVELS)}.",
            show_envvar=True,
        ),
    ] = "warning",
) -> None:
    """Wake the robot partner, and open its studio (a web page) in the browser."""
    if servo is not None and body != "simulated":
        raise InputError("--servo is for the simulated body; a card has servos of its own.")
    if serial is not None and body != "card":
        raise InputError(f"--serial {serial} is for a card; give --body card, too.")
    if folder is not None and folder.is_file():
        raise InputError(f"--folder: {folder} is a file, and a folder is needed.")
    from miburi.host.server import Launch, serve
    from miburi.serving.addresses import EVERYWHERE
    from miburi.serving.origins import check_origin
    from miburi.talk.care import Care, find_region
    from miburi.talk.synthesizer import find_synthesizer

    log_to_stderr(log_level, apart=True)

    doors = replace(
        _doors(agents, ros, broker, broker_ca, name),
        talk=_endpoint(talk, model),
        voice=None if voice is None else find_synthesizer(voice),
        care=Care(None if region is None else find_region(region)),
        origins=frozenset(map(check_origin, allow_origin or ())),
        seed=seed,
        packages=tuple(door or ()),
    )
    if doors.broker is not None:
        doors.need()
        from miburi.doors.home import check_free

        asyncio.run(check_free(doors.broker, doors.name))

    def warn() -> None:
        warn_of_misfits(description, repertoire.functions)
        if robot is not None or gestures is not None:
            warn_of_meetings(
                description, repertoire.functions, by_rule=rule is None and body != "card"
            )

    description, rule = calibrated(robot_of(robot, servo), calibration)
    repertoire = load_gestures(description, gestures)
    character = temperament_of(temperament)
    character = character.model_copy(update={"at_rest": rest or character.at_rest})
    serve(
        Launch(
            description,
            repertoire,
            character,
            emotional_model_of(emotional_model),
            rule,
            settings_of(description, solver),
            body=body,
            port_of_body=serial,
            host=host or (EVERYWHERE[0] if https else "127.0.0.1"),
            port=port,
            https=https,
            headless=headless,
            doors=doors,
            folder=folder,
            forget=forget,
            seed=seed,
            programs_may_release=programs_may_release,
        ),
        # This loads the solver while the server's process loads its libraries.
        meanwhile=warn,
    )


def _endpoint(url: str | None, model: str | None) -> "Endpoint | None":
    from miburi.talk.endpoint import find_endpoint

    if (url is None) is not (model is None):
        raise InputError("--talk and --model belong together; give both.")
    return None if url is None or model is None else find_endpoint(url, model)


def _doors(
    agents: bool, ros: bool, broker: str | None, ca: Path | None, name: str | None
) -> "Doors":
    from miburi.doors.broker import check_name, find_broker
    from miburi.doors.doors import Doors
    from miburi.doors.ros_network import find_ros

    if broker is None and ca is not None:
        raise InputError("--broker-ca is for a home's broker; give --broker, too.")
    if broker is None and not ros and name is not None:
        raise InputError("--name is for a home's broker or for ROS; give --broker or --ros, too.")
    if name is not None:
        check_name(name)
    network = find_ros(name) if ros else None
    if broker is None:
        return Doors(agents, ros=network)
    if name is None:  # this computer's name, in letters that a topic allows
        name = re.sub(r"[^a-z0-9]+", "-", socket.gethostname().lower()).strip("-")[:40] or "miburi"
    return Doors(agents, find_broker(broker, ca), check_name(name), ros=network)
