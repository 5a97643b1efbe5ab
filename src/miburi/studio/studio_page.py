"""The studio (``/``): the robot, its feelings, and why it stopped.

What changes many times a second is drawn by the browser from the live WebSocket
(:mod:`miburi.studio.elements`); the rest is put together here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from html import escape

import numpy as np
from fastapi import Request
from nicegui import ui

from miburi.studio.api import describe
from miburi.studio.elements import Levels, Plots, RobotView
from miburi.studio.pairing import pairing_url, qr_svg
from miburi.studio.panels import body_panel, gestures_panel
from miburi.studio.parts import button, heading, set_label
from miburi.studio.runner import Runner
from miburi.studio.wire import Entry, State
from miburi.studio.words import LANGUAGES, Words, own_name, preferred, words

#: Seconds between two looks at what changes slowly.
_LOOK = 0.25
_LOG_LINES = 60
#: Where the hand appears, m: beside the right arm, in front.
HAND_START = (0.05, -0.24, 0.16)
LANGUAGE_COOKIE, DARK_COOKIE = "miburi_language", "miburi_dark"
_TOGGLE_DARK = f"""() => {{
    const dark = !document.body.classList.contains("body--dark");
    Quasar.Dark.set(dark);
    document.cookie = `{DARK_COOKIE}=${{dark ? 1 : 0}};path=/;max-age=31536000;samesite=strict`;
}}"""
_CHOOSE_LANGUAGE = (
    f'document.cookie = "{LANGUAGE_COOKIE}=$;path=/;max-age=31536000;samesite=strict";'
    "location.reload()"
)


def add_studio_page(runner: Runner, addresses: list[str], token: str | None) -> None:
    """Add the studio at ``/``."""

    @ui.page("/", response_timeout=20.0)
    def studio(request: Request) -> None:
        language = preferred(
            request.query_params.get("lang"),
            request.cookies.get(LANGUAGE_COOKIE),
            request.headers.get("accept-language"),
        )
        dark = {"1": True, "0": False}.get(request.cookies.get(DARK_COOKIE, ""))
        _Studio(runner, words(language), language, dark, _Phones(addresses, token)).build()


@dataclass(frozen=True)
class _Phones:
    """Under which addresses other devices reach us, and the token that they need."""

    addresses: list[str]
    token: str | None


class _Studio:
    """One open studio page."""

    def __init__(
        self, runner: Runner, words: Words, language: str, dark: bool | None, phones: _Phones
    ) -> None:
        self._runner = runner
        self._words = words
        self._language = language
        ui.dark_mode(dark)
        self._phones = phones
        self._seen = -1
        self._updates: list[Callable[[State], None]] = []

    def build(self) -> None:
        """Put the page together."""
        ui.colors(primary="#b3432f")
        ui.page_title(self._words["studio"]["title"])
        ui.query("html").props(f'lang="{self._language}"')
        ui.add_head_html(
            '<link rel="stylesheet" href="/static/studio.css">'
            '<script type="module" src="/static/page.js"></script>'
        )
        self._top()
        with ui.element("main").classes("studio"):
            self._stage()
            self._feelings()
            self._tabs()
        with ui.element("div").classes("lost").props('role="alert"'):
            ui.label(self._words["studio"]["lost"])
        ui.timer(_LOOK, self._look)

    def _top(self) -> None:
        say = self._words["studio"]
        with ui.element("header").classes("bar-top"):
            with ui.element("h1").classes("brand"):
                ui.html("Miburi <small>身振り</small>", sanitize=False)
            pill = ui.label("…").classes("pill").props('role="status"')
            ui.element("div").classes("grow")
            pause = button(say["pause"], say["pause_hint"])
            pause.on("click", self._toggle_pause)
            face = button(say["face"], say["face_hint"])
            face.on("click", self._pairing().open)
            languages = {name: own_name(name) for name in LANGUAGES}
            choice = ui.select(languages, value=self._language).props(
                f'dense outlined options-dense aria-label="{say["choose_language"]}"'
            )
            choice.on_value_change(
                lambda event: ui.run_javascript(_CHOOSE_LANGUAGE.replace("$", event.value))
            )
            button("◐", say["dark"]).on("click", js_handler=_TOGGLE_DARK)
            release = button(say["release"], say["release_hint"], "release-button")
            release.props('data-ask="/release"')
            stop = button(say["stop"], say["stop_hint"], "stop-button")
            stop.props('data-ask="/stop" aria-keyshortcuts="Escape"')

        def update(state: State) -> None:
            resting = state.paused and state.phase == "idle"
            pill.set_text(self._words["phase"]["paused" if resting else state.phase])
            set_label(pause, say["resume" if state.paused else "pause"])

        self._updates.append(update)

    def _stage(self) -> None:
        say = self._words["studio"]
        with ui.element("section").classes("card stage").props(f'aria-label="{say["scene"]}"'):
            view = RobotView(describe(self._runner.robot).model_dump(), say["scene"])
            with ui.element("div").classes("why").props('role="alert" aria-live="assertive"'):
                why = ui.label()
                more = ui.element("small")
                with more:
                    more_words = ui.label()
            with ui.element("div").classes("over low"):
                hand = button(say["hand_out"], say["hand_hint"])
                button(say["reset_view"], "").on("click", view.reset)
                hint = ui.label(say["hand_hint"]).classes("hint")
                hint.set_visibility(False)

        def toggle() -> None:
            out = self._runner.snapshot.state.hand_out
            place = None if out else np.array(HAND_START)
            self._runner.hand(place, np.array([0.0, 1.0, 0.0]))

        hand.on("click", toggle)

        def update(state: State) -> None:
            shown = state.hand_out
            hand.set_visibility(state.hand is not None)
            hint.set_visibility(shown)
            set_label(hand, say["hand_away" if shown else "hand_out"])
            if state.stop is not None:
                first, second = self._why(state)
                why.set_text(first)
                more_words.set_text(second)

        self._updates.append(update)

    def _feelings(self) -> None:
        say, level = self._words["studio"], dict(self._words["level"])
        with ui.element("section").classes("card feelings"):
            heading(say["feelings"])
            board = Levels({**level, "names": self._words["feeling"]}, 0.7)
            with ui.element("div").classes("strength"):
                ui.label(say["strength"]).classes("field-label")
                strength = ui.slider(min=0.05, max=1, step=0.05, value=0.7)
                strength.props(f'label aria-label="{say["strength"]}"')
                strength.on_value_change(lambda event: board.set_strength(float(event.value)))
                ui.label(level["press"]).classes("field-label")

    def _tabs(self) -> None:
        say = self._words["studio"]
        panels: dict[str, Callable[[], None]] = {
            "contact": self._contact,
            "time": self._plots,
            "gestures": partial(gestures_panel, self._runner, self._words),
            "body": partial(body_panel, self._runner, self._words, self._updates),
        }
        with ui.element("section").classes("card tabs-card"):
            with ui.tabs().props("align=left inline-label no-caps") as tabs:
                for name in panels:
                    ui.tab(name, label=say[name])
            with ui.tab_panels(tabs, value="contact", animated=False, keep_alive=True):
                for name, panel in panels.items():
                    with ui.tab_panel(name):
                        panel()

    def _plots(self) -> None:
        robot = describe(self._runner.robot)
        say = {**self._words["plot"], "moods": self._words["plot"]["moods"]}
        Plots(
            say,
            robot.threshold,
            [self._words["feeling"][name] for name in robot.feelings],
            [self._words["joint"][name] for name in robot.joints],
        )

    def _contact(self) -> None:
        say = self._words["contact"]
        with ui.element("div").classes("panel"):
            with ui.element("div"):
                headline = ui.element("h2")
                with headline:
                    first = ui.label()
                second = ui.label()
                facts = ui.html("", sanitize=False)
            with ui.element("div"):
                heading(say["log"])
                log = ui.html("", sanitize=False)
        shown: tuple[object, ...] = ()

        def update(state: State) -> None:
            nonlocal shown
            if state.latest != self._seen:
                self._seen = state.latest
                log.set_content(self._log())
            now = (state.stop, state.phase, state.held)
            if now == shown:
                return
            shown = now
            words = self._why(state)
            first.set_text(words[0])
            second.set_text(words[1])
            facts.set_content(self._facts(state))

        self._updates.append(update)

    def _why(self, state: State) -> tuple[str, str]:
        """Say in two sentences what holds the body, if anything does."""
        say, stop = self._words["contact"], state.stop
        if stop is None:
            going_back = state.phase == "returning"
            return say["free"], say["returning" if going_back else "free_more"]
        if stop.reason == "contact" and stop.motor is not None:
            words = say["met"].format(motor=self._words["joint"][stop.motor])
            return words, say["held" if state.held else "waits"]
        if stop.reason == "asked":
            return say["asked"], say["held"]
        return say["failed"].format(reason=stop.reason), say["held"]

    def _facts(self, state: State) -> str:
        """Return what was measured at a contact, as HTML."""
        say, stop = self._words["contact"], state.stop
        if stop is None or stop.reason != "contact":
            return ""
        rows = []
        if stop.measured is not None and stop.expected is not None:
            rows += [
                (say["measured"], f"{stop.measured:.2f} rad/s"),
                (say["expected"], f"{stop.expected:.2f} rad/s"),
            ]
        if stop.ratio is not None:
            rows.append((say["ratio"], f"{stop.ratio:.2f} ({say['limit']})"))
        rows.append((say["sign"], say[f"sign_{stop.sign}"]))
        if stop.force is not None:
            rows.append((say["force"], f"{stop.force:.1f} N"))
        change = 100 * (stop.mood_after / stop.mood_before - 1) if stop.mood_before else 0.0
        moods = f"{stop.mood_before:.2f} → {stop.mood_after:.2f} ({change:+.0f} %)"
        rows.append((say["mood"], moods.replace("-", "−")))
        cells = "".join(f"<dt>{escape(a)}</dt><dd>{escape(b)}</dd>" for a, b in rows)
        return f'<dl class="facts">{cells}</dl>'

    def _log(self) -> str:
        entries = self._runner.log()[-_LOG_LINES:]
        if not entries:
            return escape(self._words["contact"]["empty"])
        lines = "".join(
            f'<li class="{entry.kind}"><time>{entry.time:.1f} s</time>'
            f"<span>{escape(self._line(entry))}</span></li>"
            for entry in reversed(entries)
        )
        return f'<ol class="log" tabindex="0">{lines}</ol>'

    def _line(self, entry: Entry) -> str:
        say, stop = self._words["log"], entry.stop
        name = entry.name or ""
        if stop is not None and stop.reason == "contact" and stop.motor is not None:
            return say["stopped"].format(
                motor=self._words["joint"][stop.motor],
                ratio=f"{100 * (stop.ratio or 0):.0f} %",
                before=f"{stop.mood_before:.2f}",
                after=f"{stop.mood_after:.2f}",
            )
        if stop is not None:
            key = "stopped_asked" if stop.reason == "asked" else "stopped_other"
            return say[key].format(name=stop.reason)
        return say[entry.kind].format(
            name=name,
            feeling=self._words["feeling"].get(entry.feeling or "", ""),
            source=self._words["source"].get(entry.source or "", ""),
            strength=f"{entry.strength or 0:.2f}",
            mood=f"{entry.mood or 0:.2f}",
        )

    def _pairing(self) -> ui.dialog:
        say = self._words["pair"]
        with ui.dialog() as dialog, ui.card().classes("card"):
            heading(say["title"])
            ui.link(say["here"], "/face", new_tab=True)
            token = self._phones.token
            if token is None or not self._phones.addresses:
                ui.label(say["local"])
            else:
                url = pairing_url(self._phones.addresses[0], token, "/face")
                ui.html(f'<div class="qr">{qr_svg(url)}</div>', sanitize=False)
                ui.label(say["scan"])
        return dialog

    def _toggle_pause(self) -> None:
        self._runner.pause(not self._runner.snapshot.state.paused)

    def _look(self) -> None:
        state = self._runner.snapshot.state
        for update in self._updates:
            update(state)
