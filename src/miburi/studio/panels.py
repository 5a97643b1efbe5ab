"""The studio's panels for gestures and for the body."""

import asyncio
from collections.abc import Callable
from html import escape
from typing import Any

from nicegui import ui
from pydantic import ValidationError

from miburi import gestures
from miburi.bodies.registry import KINDS
from miburi.errors import MiburiError
from miburi.feelings import Expression
from miburi.robot import JOINTS
from miburi.studio.api import done, performance
from miburi.studio.parts import button, heading, set_label
from miburi.studio.runner import Runner
from miburi.studio.wire import ExpressIn, State
from miburi.studio.words import Words
from miburi.temperament import FEELINGS, TEMPERAMENTS

_EFFORT = ("space", "weight", "time", "flow")
Update = Callable[[State], None]


async def attempt(future: Any) -> None:
    """Wait for a command; say why it was refused, if it was."""
    try:
        await done(future)
    except MiburiError as error:
        ui.notify(str(error), type="warning", position="bottom")


def gestures_panel(runner: Runner, words: Words) -> None:
    """Preview any gesture: its μ, another blended in, its effort."""
    say, names = words["gesture"], dict(words["feeling"])
    with ui.element("div").classes("panel"):
        with ui.element("div"):
            with ui.element("div").classes("row-2"):
                lead = ui.select(names, value=FEELINGS[0], label=say["choose"])
                other = ui.select({"": say["none"], **names}, value="", label=say["blend"])
            mood = _slider(say["mood"], 0.7)
            share = _slider(say["blend_mood"], 0.5)
            share.bind_enabled_from(other, "value", backward=bool)
        with ui.element("div"):
            heading(say["effort"])
            with ui.element("div").classes("two"):
                efforts = {name: _slider(say[name], 0.5) for name in _EFFORT}
            with ui.element("div").classes("row-2"):
                written = button(say["as_written"], "")
                go = button(say["perform"], say["hint"], "strong")

    def as_written() -> None:
        effort = gestures.load(lead.value).effort
        for name, slider in efforts.items():
            slider.set_value(getattr(effort, name))

    async def perform() -> None:
        effort = {name: float(slider.value) for name, slider in efforts.items()}
        own = gestures.load(lead.value).effort.model_dump()
        changed = any(abs(effort[name] - own[name]) > 1e-6 for name in _EFFORT)
        blend = {other.value: float(share.value)} if other.value else {}
        try:
            wish = ExpressIn.model_validate(
                {
                    "feeling": lead.value,
                    "mood": float(mood.value),
                    "blend": blend,
                    "effort": effort if changed else None,
                }
            )
            poses = await asyncio.to_thread(performance, runner.robot, wish)
            await attempt(runner.perform(Expression(wish.feeling, wish.mood), poses))
        except (MiburiError, ValidationError) as error:
            ui.notify(str(error), type="warning", position="bottom")

    as_written()
    lead.on_value_change(as_written)
    written.on("click", as_written)
    go.on("click", perform)


def body_panel(runner: Runner, words: Words, updates: list[Update]) -> None:
    """Choose the body, the temperament, and record."""
    say = words["body"]
    with ui.element("div").classes("panel"):
        with ui.element("div"):
            kinds = {
                kind.name: say[kind.name] + ("" if kind.available else f" ({say['missing']})")
                for kind in KINDS.values()
            }
            with ui.element("div").classes("row-2"):
                kind = ui.select(kinds, value=runner.body_name, label=say["kind"])
                port = ui.input(say["port"], placeholder="/dev/ttyACM0")
                port.bind_visibility_from(
                    kind, "value", backward=lambda name: KINDS[name].needs_port
                )
                connect = button(say["connect"], "")
            character = ui.select(
                {name: say[name] for name in TEMPERAMENTS},
                value=runner.snapshot.state.temperament,
                label=say["temperament"],
            )
            with ui.element("div").classes("row-2").style("margin-top: 14px"):
                record = button(say["record"], "")
            heading(say["recordings"]).style("margin-top: 12px")
            kept = ui.html("", sanitize=False)
        with ui.element("div"):
            heading(say["angles"])
            angles = ui.html("", sanitize=False)
            ui.label(say["temperature"]).classes("field-label")
            ui.label(say["calibrate"]).classes("field-label")

    async def use() -> None:
        try:
            future = await asyncio.to_thread(runner.use, kind.value, port.value or None)
        except MiburiError as error:
            ui.notify(str(error), type="warning", position="bottom")
        else:
            await attempt(future)

    async def change(event: Any) -> None:
        if event.value != runner.snapshot.state.temperament:
            await attempt(runner.temperament(event.value))

    async def toggle() -> None:
        await attempt(runner.record(runner.snapshot.state.recording is None))

    connect.on("click", use)
    character.on_value_change(change)
    record.on("click", toggle)
    names: list[str] | None = None

    def update(state: State) -> None:
        nonlocal names
        set_label(record, say["end_recording" if state.recording else "record"])
        if character.value != state.temperament:
            character.set_value(state.temperament)
        if state.latest != update_seen[0]:
            update_seen[0] = state.latest
            found = runner.recordings.names()
            if found != names:
                names = found
                kept.set_content(_downloads(found) or escape(say["none"]))
        angles.set_content(_angles(state, words["joint"]))

    update_seen = [-1]
    updates.append(update)


def _slider(label: str, value: float) -> ui.slider:
    with ui.element("div"):
        ui.label(label).classes("field-label")
        slider = ui.slider(min=0, max=1, step=0.05, value=value)
    return slider.props(f'label dense aria-label="{label}"')


def _downloads(names: list[str]) -> str:
    links = "".join(
        f'<li><a href="/api/v1/recordings/{escape(name)}" download>{escape(name)}</a></li>'
        for name in reversed(names[-8:])
    )
    return f"<ul>{links}</ul>" if links else ""


def _angles(state: State, names: dict[str, str]) -> str:
    cells = "".join(
        f"<span>{escape(names[joint])} <b>{angle:+.2f} rad</b></span>"
        for joint, angle in zip(JOINTS, state.angles, strict=True)
    )
    return f'<div class="angles">{cells.replace("-", "−")}</div>'
