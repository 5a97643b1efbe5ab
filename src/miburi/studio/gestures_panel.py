"""The studio's panel for gestures: choose one, change it, and perform it."""

import asyncio

from nicegui import ui
from pydantic import ValidationError

from miburi.errors import MiburiError
from miburi.feelings import FEELINGS, Expression
from miburi.interface.api import performance
from miburi.interface.wire import ExpressIn
from miburi.live.view import LivePartner
from miburi.studio.parts import attempt, button, heading
from miburi.studio.words import Words

__all__ = ["gestures_panel"]

_EFFORT = ("space", "weight", "time", "flow")


def gestures_panel(runner: LivePartner, words: Words) -> None:
    """Add the panel: a gesture, its μ, a second gesture to blend in, and the effort."""
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
        effort = runner.repertoire.of(lead.value)[0].effort
        for name, slider in efforts.items():
            slider.set_value(getattr(effort, name))

    async def perform() -> None:
        effort = {name: float(slider.value) for name, slider in efforts.items()}
        own = runner.repertoire.of(lead.value)[0].effort.model_dump()
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
            poses = await asyncio.to_thread(performance, runner, wish)
            await attempt(runner.perform(Expression(wish.feeling, wish.mood), poses))
        except (MiburiError, ValidationError) as error:
            ui.notify(str(error), type="warning", position="bottom")

    as_written()
    lead.on_value_change(as_written)
    written.on("click", as_written)
    go.on("click", perform)


def _slider(label: str, value: float) -> ui.slider:
    with ui.element("div"):
        ui.label(label).classes("field-label")
        slider = ui.slider(min=0, max=1, step=0.05, value=value)
    return slider.props(f'label dense aria-label="{label}"')
