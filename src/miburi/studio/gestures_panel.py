"""The studio's panel for gestures: choose one, change it, and perform it."""

import asyncio

from nicegui import ui

from miburi.feelings import Expression
from miburi.gestures import MovementFunction, blend
from miburi.gestures.effort import Effort
from miburi.live.view import LivePartner
from miburi.live.wishes import Perform
from miburi.studio.elements import Choice
from miburi.studio.parts import attempt, button, heading, refusals_shown
from miburi.studio.words import Words

_EFFORT = ("space", "weight", "time", "flow")


def gestures_panel(runner: LivePartner, words: Words) -> None:
    """Add the panel: a gesture, its membership μ, a second gesture to blend in, and the effort."""
    say = words["gesture"]
    functions = {function.name: function for function in runner.repertoire.functions}
    names = {name: _title(function, words) for name, function in functions.items()}
    with ui.element("div").classes("panel"):
        with ui.element("div"):
            with ui.element("div").classes("row-2"):
                lead = Choice(names, next(iter(names)), say["choose"])
                other = Choice({"": say["none"], **names}, "", say["blend"])
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
        effort = functions[lead.value].effort.model_dump()
        for name, slider in efforts.items():
            slider.set_value(effort[name])

    async def perform() -> None:
        effort = Effort(**{name: float(slider.value) for name, slider in efforts.items()})
        chosen = functions[lead.value].model_copy(update={"effort": effort})
        parts = [(chosen, float(mood.value))]
        if other.value:
            parts.append((functions[other.value], float(share.value)))
        with refusals_shown():
            poses = await asyncio.to_thread(blend, runner.robot, parts)
            await attempt(runner, Perform(Expression(chosen.feeling, float(mood.value)), poses))

    as_written()
    lead.on_value_change(as_written)
    written.on("click", as_written)
    go.on("click", perform)


def _title(function: MovementFunction, words: Words) -> str:
    feeling = words["feeling"][function.feeling]
    return feeling if function.name == function.feeling else f"{feeling}: {function.name}"


def _slider(label: str, value: float) -> ui.slider:
    with ui.element("div"):
        ui.label(label).classes("field-label")
        slider = ui.slider(min=0, max=1, step=0.05, value=value)
    return slider.props(f'label dense aria-label="{label}"')
