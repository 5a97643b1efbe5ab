"""The studio's panel for the body: its kind, motors, temperament and recordings."""

import asyncio
from collections.abc import Callable
from functools import partial
from html import escape
from math import degrees
from typing import Any

from nicegui import ui
from serial.tools.list_ports import comports

from miburi.feelings import TEMPERAMENTS
from miburi.feelings.temperament import REST_LEVELS
from miburi.live.bodies import KINDS
from miburi.live.recording.archive import Kept
from miburi.live.state import MotorOut, MotorsOut, State
from miburi.live.view import LivePartner, Recordings
from miburi.live.wishes import ChangeBody, ChangeTemperament
from miburi.servos import Servo
from miburi.studio.elements import Choice
from miburi.studio.parts import attempt, button, heading, refusals_shown, set_label
from miburi.studio.words import Words

#: A motor is marked as warm from this many °C below the limit.
_WARM = 5.0
#: The time between two checks of the recordings, in s, and how many of them are listed.
_LOOK, _LISTED = 0.5, 20
#: Bodies with simulated servos; and, for each origin of a servo's constants, the key of the text
#: about this origin.
_SIMULATED = ("simulated", "emulated-card")
_STANDINGS = {
    "identified by others": "servo_identified",
    "data sheet": "servo_sheet",
    "ours": "servo_ours",
}
Update = Callable[[State], None]


def body_panel(runner: LivePartner, words: Words, updates: list[Update]) -> None:
    """Add the panel, and append to ``updates`` the functions to call with each new state."""
    with ui.element("div").classes("panel"):
        with ui.element("div"):
            _body(runner, words["body"], updates)
            _temperament(runner, words["body"], updates)
            _recordings(runner, words["body"], updates)
        with ui.element("div"):
            _motors(runner, words, updates)


def _body(runner: LivePartner, say: dict[str, str], updates: list[Update]) -> None:
    kinds = {
        kind.name: say[kind.name] + ("" if kind.available else f" ({say['missing']})")
        for kind in KINDS.values()
    }
    ports = [port.device for port in comports()]
    with ui.element("div").classes("row-2"):
        kind = Choice(kinds, runner.body_name, say["kind"])
        port = ui.input(
            say["port"],
            value=ports[0] if ports else "",
            placeholder="/dev/ttyACM0",
            autocomplete=ports,
        )
        port.bind_visibility_from(kind, "value", backward=lambda name: KINDS[name].needs_port)
        connect = button(say["connect"], say["connect_hint"])

    async def use() -> None:
        name = kind.value
        set_label(connect, say["connecting"])
        connect.props("disabled")
        where = (str(port.value or "") or None) if KINDS[name].needs_port else None
        try:
            await attempt(runner, ChangeBody(name, where))
        finally:
            connect.props(remove="disabled")
            set_label(connect, say["connect"])

    connect.on("click", use)
    _follow(kind, lambda state: state.body, updates)


def _follow(choice: Choice, value: Callable[[State], str], updates: list[Update]) -> None:
    """Show what another page or a program has chosen."""
    shown = choice.value

    def update(state: State) -> None:
        nonlocal shown
        if (now := value(state)) != shown:
            shown = now
            choice.set_value(now)

    updates.append(update)


def _temperament(runner: LivePartner, say: dict[str, str], updates: list[Update]) -> None:
    character = Choice(
        {name: say[name] if name in TEMPERAMENTS else name for name in runner.temperaments},
        runner.snapshot.state.temperament,
        say["temperament"],
    )

    async def change(event: Any) -> None:
        if event.value != runner.snapshot.state.temperament:
            await attempt(runner, ChangeTemperament(event.value))

    character.on_value_change(change)
    rest = Choice(
        {level: say[f"rest_{level}"] for level in REST_LEVELS},
        runner.snapshot.state.rest,
        say["rest"],
    )

    async def change_rest(event: Any) -> None:
        state = runner.snapshot.state
        if event.value != state.rest:
            await attempt(runner, ChangeTemperament(state.temperament, event.value))

    rest.on_value_change(change_rest)
    _follow(character, lambda state: state.temperament, updates)
    _follow(rest, lambda state: state.rest, updates)


def _recordings(runner: LivePartner, say: dict[str, str], updates: list[Update]) -> None:
    with ui.element("div").classes("row-2").style("margin-top: 14px"):
        record = button(say["record"], "")
    heading(say["recordings"]).style("margin-top: 12px")
    total = ui.label(say["none"]).classes("field-label")
    listed = ui.element("ul").classes("recordings")
    recordings = runner.recordings

    async def toggle() -> None:
        await _try(recordings.end if recordings.current else recordings.start)

    record.on("click", toggle)
    shown: list[Kept] = []
    sure: set[str] = set()
    seen = -1

    async def look() -> None:
        nonlocal shown, seen
        latest = runner.snapshot.state.latest
        if latest == seen:
            return
        kept = await asyncio.to_thread(recordings.kept)
        seen, ended = latest, [one for one in kept if one.name != recordings.current]
        if ended == shown:
            return
        shown = ended
        taken, limit = sum(one.bytes for one in ended) / 1e6, recordings.limit / 1e6
        words = say["kept"].format(taken=f"{taken:.0f}", limit=f"{limit:.0f}")
        total.set_text(words if ended else say["none"])
        listed.clear()
        with listed:
            for one in reversed(ended[-_LISTED:]):
                _add_recording(recordings, one, say, sure)

    ui.timer(_LOOK, look)

    def update(state: State) -> None:
        set_label(record, say["end_recording" if state.recording else "record"])

    updates.append(update)


def _add_recording(recordings: Recordings, one: Kept, say: dict[str, str], sure: set[str]) -> None:
    """Add a recording to the list, with a button that deletes it when pressed twice.

    ``sure`` has the names of recordings whose button was pressed once.
    """
    with ui.element("li"):
        ui.link(one.name, f"/api/v1/recordings/{one.name}").props("download")
        ui.label(f"{one.bytes / 1e6:.1f} MB" + ("" if one.whole else f", {say['broken_off']}"))
        delete = button("", "")

    def label() -> None:
        text = say["delete_sure" if one.name in sure else "delete"]
        set_label(delete, text)
        delete.props(f'aria-label="{text} {one.name}"')

    async def press() -> None:
        if one.name in sure:
            await _try(partial(recordings.delete, one.name))
        else:
            sure.add(one.name)
            label()

    label()
    delete.on("click", press)


async def _try(act: Callable[[], None]) -> None:
    """Run ``act``, which may wait for the disk, in a thread; show a refusal."""
    with refusals_shown():
        await asyncio.to_thread(act)


def _motors(runner: LivePartner, words: Words, updates: list[Update]) -> None:
    say = words["body"]
    heading(say["motors"])
    table = ui.html("", sanitize=False)
    health = ui.label().classes("field-label")
    servo = ui.label(_servo(runner.robot.servo.model, say)).classes("field-label")
    calibration = ui.html("", sanitize=False).classes("field-label")

    def update(state: State) -> None:
        motors = runner.motors
        table.set_content(_table(state, motors, words))
        limits = motors.hottest is not None and motors.lowest is not None
        health.set_text(
            say["limits"].format(hottest=f"{motors.hottest:.0f}", lowest=f"{motors.lowest:.1f}")
            if limits
            else say["temperature"]
        )
        servo.set_visibility(motors.body in _SIMULATED)
        calibration.set_content(_calibration(motors, say))

    updates.append(update)


def _servo(servo: Servo, say: dict[str, str]) -> str:
    return say[_STANDINGS[servo.motor.standing]].format(servo=servo.name)


def _table(state: State, motors: MotorsOut, words: Words) -> str:
    say = words["body"]
    columns = [say[name] for name in ("motor", "angle", "lag", "slack")]
    if motors.hottest is not None:
        columns[2:2] = [say["degrees"], say["supply"]]
    head = "".join(f'<th scope="col">{escape(column)}</th>' for column in columns)
    rows = "".join(
        f'<tr class="{_mark(motor, motors)}"><th scope="row">{escape(words["joint"][motor.joint])}'
        f"</th>{_cells(motor, angle, motors, say)}</tr>"
        for motor, angle in zip(motors.motors, state.angles, strict=True)
    )
    return f'<table class="motors"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'


def _cells(motor: MotorOut, angle: float, motors: MotorsOut, say: dict[str, str]) -> str:
    cells = [f"{degrees(angle):+.0f}°".replace("-", "−")]
    if motors.hottest is not None:
        if not motor.answers:
            cells += [escape(say["silent"]), ""]
        elif motor.temperature is None or motor.voltage is None:
            cells += ["", ""]
        else:
            cells += [f"{motor.temperature:.0f} °C", f"{motor.voltage:.1f} V"]
    cells += [f"{1000 * motor.guards.lag:.0f} ms", f"{degrees(motor.guards.slack):.1f}°"]
    return "".join(f"<td>{cell}</td>" for cell in cells)


def _mark(motor: MotorOut, motors: MotorsOut) -> str:
    hot = motors.hottest is not None and (motor.temperature or 0) >= motors.hottest - _WARM
    low = motors.lowest is not None and (motor.voltage or 99) <= motors.lowest
    return "poor" if hot or low or motor.answers is False else ""


def _calibration(motors: MotorsOut, say: dict[str, str]) -> str:
    if motors.settings is None:
        return escape(say["simulated_guards"])
    origin = say["own_guards" if motors.calibrated else "shipped_guards"]
    text = escape(origin.format(settings=motors.settings))
    if motors.port is None:
        return text
    command = escape(f"miburi card calibrate {motors.port}")
    return f"{text} {escape(say['calibrate'])} <code>{command}</code>"
