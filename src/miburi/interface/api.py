"""The interface for programs: ``/api/v1``, described by OpenAPI at ``/api/openapi.json``."""

import asyncio
from collections.abc import Callable
from datetime import datetime
from functools import partial
from http import HTTPStatus
from pathlib import Path as FilePath
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Depends, FastAPI, Header, HTTPException, Request, Response
from fastapi.routing import APIRoute

from miburi.feelings import Expression, Stimulus
from miburi.gestures import look as glance
from miburi.interface.acting import acts_of, check_words, poses_of, shown_by
from miburi.interface.description import describe, describe_interface
from miburi.interface.events import add_events
from miburi.interface.people import add_people
from miburi.interface.recordings import add_recordings
from miburi.interface.refusing import (
    NO_ROOM,
    NOTHING,
    REFUSED,
    Refusals,
    known_queries,
    refuse_in_words,
)
from miburi.live.bodies import KINDS
from miburi.live.settle import done, granted
from miburi.live.state import MotorsOut, Sample, State
from miburi.live.view import LivePartner, UnreachableError
from miburi.live.wishes import (
    AllowWords,
    Attend,
    ChangeBody,
    ChangeTemperament,
    Feel,
    MoveHand,
    Pause,
    Perform,
    PerformActs,
    Release,
    See,
    Sense,
    Speak,
)
from miburi.safety.stop import StopReason
from miburi.senses.happenings import notice
from miburi.serving.access import CAME
from miburi.serving.allowance import Allowance
from miburi.serving.beside import live_beside
from miburi.serving.heads import asker
from miburi.serving.press import BY, PRESS, press, who
from miburi.talk.care import Care
from miburi.talk.dates import local_time
from miburi.talk.endpoint import Endpoint
from miburi.talk.said import SayOut
from miburi.talk.speech import Speech
from miburi.version import __version__
from miburi.wire.messages import (
    AttendIn,
    BodyIn,
    BodyOut,
    ExpressIn,
    FaceIn,
    GestureOut,
    HandIn,
    LookIn,
    PauseIn,
    PerformanceIn,
    PosesAct,
    PosesIn,
    SayIn,
    SenseIn,
    SpeakIn,
    StimulusIn,
    TemperamentIn,
    WishOut,
    WordsIn,
)
from miburi.wire.robot import RobotOut

_ABOUT = """A robot partner: what it feels, what it shows, and how to talk to it.

The WebSocket `/api/v1/live?rate=30&events=new` sends states, and events as `{"event": …}`; it takes
`{"do": "stimulus", "feeling": …}`, `{"do": "hand", "position": …}`, `{"do": "stop"}`,
`{"do": "release"}` and `{"do": "rate", "rate": 10}`. If it refuses a message, it answers
`{"refused": "…"}`."""
_TAGS = {
    "stop": "Requests that are not rate-limited.",
    "look": "The partner's state, body and gestures.",
    "events": "What has happened, and events as they happen.",
    "ask": "What to make it feel, notice and do.",
    "show": "What to make it show and say; each request gets an id, by which events refer to it.",
    "recordings": "Recordings of its motion and feelings, as MCAP files.",
    "privacy": "Whether events may contain what people said.",
    "people": "The people it knows, and when it may speak unasked.",
}
_PLAIN = Care()
#: How many touches, sounds, faces and turns one address may send per second, and in a burst (our
#: numbers).
NOTICED_RATE, NOTICED_BURST = 5.0, 10.0
#: Refusals that any request but Stop may get.
_OFTEN: Refusals = {429: {"description": "Too many requests."}}
_BY = "`program` if programs may release it again; otherwise it counts as a person's Stop."
#: How many requests with key poses one address may send per second, and in a burst (our numbers).
_REHEARSED_RATE, _REHEARSED_BURST = 0.5, 5.0
_Asker = Annotated[
    str, Header(alias=BY, description="Who asks: `program`, `home`, `agent`, `ros` or `person`.")
]


def make_api(
    runner: LivePartner,
    endpoint: Endpoint | None = None,
    care: Care = _PLAIN,
    seed: int = 0,
    folder: FilePath | None = None,
    clock: Callable[[], datetime] = local_time,
) -> FastAPI:
    """Return the interface to a live partner, without pages.

    Parameters
    ----------
    runner
        The partner.
    endpoint
        The composer of the partner's answers; if None, the partner answers by itself.
    care
        How the partner answers somebody in distress; by default it names no telephone number.
    seed
        Seeds the choice among the partner's own answers.
    folder
        The folder for what the partner knows about people; if None, the partner forgets them when
        the program ends.
    clock
        Tells the local time at the partner.
    """
    app = FastAPI(
        title="Miburi",
        version=__version__,
        description=_ABOUT,
        servers=[{"url": "/", "description": "where this description is served"}],
        openapi_tags=[{"name": name, "description": what} for name, what in _TAGS.items()],
        generate_unique_id_function=_route_name,
        openapi_url="/api/openapi.json",
        docs_url=None,
        redoc_url=None,
    )
    speech = Speech(runner, endpoint, care, clock, seed, folder)
    _add_requests(app, runner, speech, clock)
    live_beside(app, speech.live)
    describe_interface(app)
    refuse_in_words(app)
    return app


def _route_name(route: APIRoute) -> str:
    return route.name


def _add_requests(
    app: FastAPI, runner: LivePartner, speech: Speech, clock: Callable[[], datetime]
) -> None:
    parts: dict[str, Callable[[APIRouter, LivePartner], None]] = {
        "stop": _stopping,
        "look": _looking,
        "ask": partial(_asking, speech=speech),
        "show": _showing,
        "recordings": add_recordings,
        "privacy": _private,
        "people": lambda part, _: add_people(part, speech.memory, speech.beginning, clock),
        "events": add_events,
    }
    for tag, add in parts.items():
        stop = tag == "stop"  # obeyed whatever comes with it
        part = APIRouter(
            prefix="/api/v1",
            tags=[tag],
            responses={422: {}, **({} if stop else _OFTEN)},
            dependencies=[] if stop else [Depends(known_queries)],
            generate_unique_id_function=_route_name,
        )
        add(part, runner)
        # ``include_router`` would build each of the router's routes again.
        app.router.routes += part.routes


def _limited(rate: float, burst: float, words: str) -> Callable[[Request], None]:
    """Return a check that allows each address ``rate`` requests a second, and ``burst`` at once."""
    allowance = Allowance(rate, burst)

    def check(request: Request) -> None:
        if not allowance.take(asker(request.scope)):
            raise HTTPException(HTTPStatus.TOO_MANY_REQUESTS, words)

    return check


def _stopping(router: APIRouter, runner: LivePartner) -> None:
    """Add the requests that are exempt from limits."""

    @router.post("/stop", status_code=NOTHING, responses=REFUSED)
    async def stop(
        by: Annotated[str, Header(alias=BY, description=_BY)] = "person",
        name: Annotated[str, Header(alias=PRESS, include_in_schema=False)] = "",
    ) -> None:
        """Stop all motors; after a person's Stop, only a person can release them."""
        await done(runner.stop(press(by, name)))


def _looking(router: APIRouter, runner: LivePartner) -> None:
    """Add the read-only requests."""

    @router.get("/state", response_model=State)
    async def state() -> Response:
        """Return all of the present state that a viewer needs."""
        if not runner.reachable:
            raise UnreachableError
        return Response(runner.snapshot.json, media_type="application/json")

    @router.get("/robot")
    async def robot() -> RobotOut:
        """Return the robot's description: names, limits, links and solids."""
        return describe(runner)

    @router.get("/samples")
    async def samples() -> list[Sample]:
        """Return the samples of the last two minutes, for plots."""
        return [sample for _, sample in runner.samples_after(0)]

    @router.get("/gestures")
    async def gestures() -> list[GestureOut]:
        """Return the movement functions."""
        return [
            GestureOut.model_validate(function.model_dump(include=set(GestureOut.model_fields)))
            for function in runner.repertoire.functions
        ]

    @router.get("/motors")
    async def motors() -> MotorsOut:
        """Return the motors' temperatures and voltages, and the contact rule's tolerances."""
        return runner.motors

    @router.get("/bodies")
    async def bodies() -> list[BodyOut]:
        """Return the kinds of body, and the present one."""
        return [
            BodyOut(
                name=kind.name,
                available=kind.available,
                needs_port=kind.needs_port,
                chosen=kind.name == runner.body_name,
            )
            for kind in KINDS.values()
        ]


def _asking(router: APIRouter, runner: LivePartner, speech: Speech) -> None:
    """Add the requests to feel, notice and do something."""

    @router.post("/stimulus", responses=REFUSED)
    async def stimulus(wish: StimulusIn, by: _Asker = "program") -> WishOut:
        """Let the partner feel something; returns the event's id."""
        felt = Stimulus(wish.feeling, wish.strength, wish.source)
        return WishOut(id=await granted(runner, Feel(felt, who(by))))

    @router.post("/say", responses=REFUSED)
    async def say(wish: SayIn, by: _Asker = "person") -> SayOut:
        """Say something to the partner, which takes on the words' feeling, and answers.

        It obeys orders, too: "stop" stops all motors; "wave" and "lift your arms" are carried out.
        """
        return await speech.take(wish.text, tone=wish.tone, by=by, usual=wish.language)

    often = f"too many requests; at most {NOTICED_RATE:g} a second."
    not_too_often = _limited(NOTICED_RATE, NOTICED_BURST, often)

    @router.post("/sense", status_code=NOTHING, responses=REFUSED)
    async def sense(wish: SenseIn, request: Request, by: _Asker = "person") -> None:
        """Let the partner notice a touch, a motion or a sound; never more than a few a second."""
        not_too_often(request)
        since = _since_contact(runner)
        noticed = notice(wish.kind, wish.clearness, since_contact=since)
        felt = await granted(runner, Sense(noticed, by=who(by)))
        speech.beginning.notice()
        await speech.count(felt)

    @router.post("/face", status_code=NOTHING, responses=REFUSED)
    async def face(wish: FaceIn, request: Request) -> None:
        """Turn slowly to a face while the partner shows no feeling.

        Repeat this within 5 s, or the face counts as gone.
        """
        not_too_often(request)
        if wish.x is not None:
            speech.beginning.notice()
        await granted(runner, See(wish.x))

    @router.post("/attend", status_code=NOTHING, responses=REFUSED)
    async def attend(wish: AttendIn, request: Request) -> None:
        """Face the person who is talking, and look away now and then, as people do."""
        not_too_often(request)
        await granted(runner, Attend(wish.turn))

    @router.post("/release", status_code=NOTHING, responses=REFUSED)
    async def release(request: Request) -> None:
        """Resume after a stop; refused in the pause after a contact, and after a person's Stop."""
        await granted(runner, Release(came=request.scope.get("state", {}).get(CAME)))

    @router.post("/pause", status_code=NOTHING, responses=REFUSED)
    async def pause(wish: PauseIn, by: _Asker = "person") -> None:
        """Pause at neutral, or resume."""
        await granted(runner, Pause(wish.paused, who(by)))

    @router.post("/hand", status_code=NOTHING, responses=REFUSED)
    async def hand(wish: HandIn) -> None:
        """Move the simulated human hand; it can get in the robot's way."""
        await granted(runner, move_hand(wish))

    @router.post("/temperament", status_code=NOTHING, responses=REFUSED)
    async def temperament(wish: TemperamentIn) -> None:
        """Change to another temperament."""
        await granted(runner, ChangeTemperament(wish.name, wish.rest))

    @router.post("/bodies", status_code=NOTHING, responses=REFUSED)
    async def body(wish: BodyIn) -> None:
        """Use another body from now on."""
        await granted(runner, ChangeBody(wish.name, wish.port))


def _showing(router: APIRouter, runner: LivePartner) -> None:
    """Add the requests to show and say something; each wish has an id, which its events carry."""

    @router.post("/speak", responses=REFUSED)
    async def speak(wish: SpeakIn, by: _Asker = "program") -> WishOut:
        """Say something aloud on pages whose voice is on; a new sentence replaces the last."""
        await asyncio.to_thread(check_words, wish.text, who(by))
        return WishOut(id=await granted(runner, Speak(wish.text, who(by))))

    @router.post("/express", responses=REFUSED)
    async def express(wish: ExpressIn, by: _Asker = "program") -> WishOut:
        """Perform a gesture once, whatever the feelings are."""
        poses = await asyncio.to_thread(shown_by, runner, wish)
        shown = Expression(wish.feeling, wish.mood)
        return WishOut(id=await granted(runner, Perform(shown, poses, "gesture", who(by))))

    @router.post("/look", responses=REFUSED)
    async def look(wish: LookIn, by: _Asker = "program") -> WishOut:
        """Look somewhere for a while, as soon as the body is at rest; the next wish ends it."""
        poses = glance(runner.robot, wish.at, wish.seconds)
        return WishOut(id=await granted(runner, Perform(None, poses, "look", who(by))))

    often = "too many key poses to rehearse at once; wait a moment."
    rehearsed_seldom = _limited(_REHEARSED_RATE, _REHEARSED_BURST, often)

    @router.post("/poses", responses=REFUSED)
    async def poses(wish: PosesIn, request: Request, by: _Asker = "program") -> WishOut:
        """Perform your own key poses once; they are rehearsed first, which takes a moment."""
        rehearsed_seldom(request)
        own = await asyncio.to_thread(poses_of, runner, wish)
        shown = None if wish.feeling is None else Expression(wish.feeling, wish.mood)
        return WishOut(id=await granted(runner, Perform(shown, own, "poses", who(by))))

    @router.post("/performance", responses=REFUSED)
    async def performance(wish: PerformanceIn, request: Request, by: _Asker = "program") -> WishOut:
        """Perform gestures, looks, key poses and sentences together."""
        if any(isinstance(act, PosesAct) for act in wish.acts):
            rehearsed_seldom(request)
        acts = await asyncio.to_thread(acts_of, runner, wish, who(by))
        return WishOut(id=await granted(runner, PerformActs(acts, wish.when == "next", who(by))))


def _private(router: APIRouter, runner: LivePartner) -> None:
    """Add the setting that decides whether people's words are kept."""

    @router.post("/words", status_code=NOTHING, responses=REFUSED | NO_ROOM)
    async def words(wish: WordsIn) -> None:
        """Set whether events include people's words; if not, the words kept so far are deleted."""
        await granted(runner, AllowWords(wish.allowed))


def _since_contact(runner: LivePartner) -> float | None:
    """Return the time since the latest contact stop in the log, s; None if there is none."""
    contacts = [
        e for e in runner.history.after(0) if e.stop and e.stop.reason is StopReason.CONTACT
    ]
    return runner.snapshot.state.time - contacts[-1].time if contacts else None


def move_hand(wish: HandIn) -> MoveHand:
    """Return the request in a message about the hand, from HTTP or the WebSocket."""
    position = None if wish.position is None else np.array(wish.position)
    return MoveHand(position, np.array(wish.along))
