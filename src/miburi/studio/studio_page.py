"""The studio (``/``): the robot, its feelings, and the panels.

The browser draws fast changes from the live WebSocket (:mod:`miburi.studio.elements`). This module
builds the rest, and updates it four times a second.
"""

import time
from collections.abc import Callable, Sequence
from functools import partial
from html import escape
from pathlib import Path

import numpy as np
from fastapi import FastAPI, Request
from nicegui import Client, ui
from nicegui import app as pages
from nicegui.events import GenericEventArguments

from miburi.feelings import FEELINGS
from miburi.feelings.catalogue import CATALOGUE
from miburi.interface.description import describe
from miburi.live.state import State
from miburi.live.view import LivePartner
from miburi.live.wishes import MoveHand, Pause, Release
from miburi.robot import JOINTS
from miburi.serving.access import PAIRING
from miburi.serving.reach import Reach, pairing_url, qr_svg
from miburi.studio.body_panel import body_panel
from miburi.studio.contact_panel import contact_panel, why_ended
from miburi.studio.elements import Choice, Levels, Plots, RobotView
from miburi.studio.forms import banner, reason, senses_form, signs, talk_form
from miburi.studio.gestures_panel import gestures_panel
from miburi.studio.pages import missing_page
from miburi.studio.parts import attempt, button, heading, set_label
from miburi.studio.preferences import TABS, Preferences, keep
from miburi.studio.words import own_name, page_languages, words
from miburi.talk.care import Care

#: The time, in s, between two checks for pages that no browser has connected to. Each such page
#: takes about 0.8 MB. NiceGUI keeps the page for 60 s, because a slow computer needs that long to
#: connect.
_LOOKS = 5.0
#: If more pages than ``_MANY`` are waiting, those older than ``_FLOODED`` s are dropped.
_MANY, _FLOODED = 20, 10.0
#: The interval between two updates, in s.
_LOOK = 0.25
#: The hand's first position, in m: low in front of the robot, clear of both arms.
HAND_START = (0.22, 0.0, 0.05)
_TOGGLE_DARK = f"""() => {{
    const dark = !document.body.classList.contains("body--dark");
    Quasar.Dark.set(dark);
    {keep("dark", "dark ? 1 : 0")}
    emit(dark);
}}"""
#: Sends the serial number of the state on the page, so that a Stop after that state still holds.
_RELEASE = "() => emit(Number(document.documentElement.dataset.serial))"
_CHOOSE_LANGUAGE = f"""(event) => {{
    {keep("language", "event.target.value")}
    const page = new URL(location);
    page.searchParams.delete("lang");
    location.replace(page);
}}"""


def make_studio(runner: LivePartner, reach: Reach, sounded: Sequence[str], care: Care) -> FastAPI:
    """Return the studio as an application; NiceGUI allows one in a process.

    ``sounded`` are the languages of the partner's own voice; ``care`` knows the region's numbers.
    """

    @ui.page("/", response_timeout=20.0)
    def studio(request: Request) -> None:
        _Studio(runner, Preferences.of(request), reach, sounded, care).build()

    # else Quasar shows an unlabelled bar at its own requests
    pages.config.quasar_config["loadingBar"]["skipHijack"] = True
    # NiceGUI's own page would keep a client for each request, and log the visitor's URL.
    pages.add_exception_handler(404, missing_page)
    pages.timer(_LOOKS, forget_pages)
    app = FastAPI()
    ui.run_with(
        app,
        title="Miburi",
        favicon=Path(__file__).parent / "static" / "icon.svg",
        dark=None,
        binding_refresh_interval=None,
        show_welcome_message=False,
        reconnect_timeout=30.0,  # a page that was busy is not reloaded
        tailwind=False,
    )
    return app


def forget_pages() -> None:
    """Drop pages without a browser if many were requested within a minute."""
    since = time.time() - 60
    waiting = (each for each in Client.instances.values() if not each.has_socket_connection)
    if sum(each.created > since for each in waiting) > _MANY:
        Client.prune_instances(client_age_threshold=_FLOODED)


class _Studio:
    """An open studio page."""

    def __init__(
        self,
        runner: LivePartner,
        preferences: Preferences,
        reach: Reach,
        sounded: Sequence[str],
        care: Care,
    ) -> None:
        self._runner = runner
        self._preferences = preferences
        self._words = words(preferences.language)
        self._reach, self._sounded, self._care = reach, sounded, care
        self._updates: list[Callable[[State], None]] = []
        #: Updates that run only while their panel is open.
        self._panel_updates: dict[str, list[Callable[[State], None]]] = {tab: [] for tab in TABS}

    def build(self) -> None:
        """Build the page."""
        self._dark = ui.dark_mode(self._preferences.dark)
        ui.colors(primary="#b3432f")
        ui.page_title(self._words["studio"]["title"])
        ui.query("html").props(f'lang="{self._preferences.language}"')
        # Preloaded, because Chromium does not redraw bold text that it drew without the font.
        ui.add_head_html(
            '<link rel="preload" href="/static/fonts/japanese.woff" as="font" crossorigin>'
            '<link rel="stylesheet" href="/static/studio.css">'
            '<script type="module" src="/static/page.js"></script>'
            '<script type="module" src="/static/why.js"></script>'
            '<script type="module" src="/static/senses.js"></script>'
        )
        without = escape(self._words["studio"]["no_script"])
        ui.add_body_html(
            f'<noscript><p class="lost" style="display: block">{without}</p></noscript>'
        )
        self._top()
        told = banner(self._words, self._care, self._preferences.language)
        ui.html(told, sanitize=False).classes("needs")
        if not self._preferences.met:
            self._first_hint()
        with ui.element("div").classes("studio"):  # NiceGUI brings the main landmark
            ui.html(reason(self._words), sanitize=False).classes("why-place")
            self._stage()
            self._feelings()
            self._tabs()
        with ui.element("div").classes("lost").props('role="alert"') as lost:
            lost.props["data-back"] = self._words["studio"]["back"]
            lost.props["data-back-stopped"] = self._words["studio"]["back_stopped"]
            ui.label(self._words["studio"]["lost"])
            ui.label(self._words["studio"]["stop_unsent"]).classes("unsent")
        ui.timer(_LOOK, self._look)

    def _top(self) -> None:
        say = self._words["studio"]
        with ui.element("header").classes("bar-top"):
            with ui.element("h1").classes("brand"):
                ui.html("Miburi <small>身振り</small>", sanitize=False)
            pill = ui.label("…").classes("pill")  # not announced: it changes with each move
            ui.label(say["unreachable"]).classes("pill-lost")
            recording = ui.label(say["recording"]).classes("on-air")
            ui.html(signs(self._words), sanitize=False).classes("signs")
            ended = ui.label().classes("recording-ended").props('role="status"')
            ui.element("div").classes("grow")
            # On a phone, a button opens these controls, so that Stop has room.
            with ui.element("div").classes("bar-more").props('id="more" popover="auto"'):
                pause = button(say["pause"], say["pause_hint"])
                pause.on("click", self._toggle_pause)
                face = button(say["face"], say["face_hint"])
                face.props('popovertarget="more" popovertargetaction="hide"')
                face.on("click", self._pairing().open)
                self._languages()
                # The element on the server must change, too, or the next update would undo this.
                dark = button(say["dark"], "")
                dark.on(
                    "click", lambda event: self._dark.set_value(event.args), js_handler=_TOGGLE_DARK
                )
            more = button("⋯", say["more"], "more-button")
            more.props(f'popovertarget="more" aria-label="{say["more"]}"')
            release = button(say["release"], say["release_hint"], "release-button")
            release.on("click", self._release, js_handler=_RELEASE)
            stop = button(say["stop"], say["stop_hint"], "stop-button", "Esc")
            stop.set_content(
                f'<span class="reached">{stop.content}</span>'
                f'<span class="unreached">{escape(say["stop_unreached"])}</span>'
            )
            stop.props('data-ask="/stop" aria-keyshortcuts="Escape"')

        def update(state: State) -> None:
            resting = state.paused and state.phase == "idle"
            recording.set_visibility(state.recording is not None)
            end = state.recording_end
            because = why_ended(end.reason, end.detail, self._words) if end else ""
            ended.set_text(say["recording_ended"].format(reason=because) if end else "")
            breathing = state.phase == "moving" and state.expressed is None and not state.asked
            shown = "paused" if resting else "idle" if breathing else state.phase
            pill.set_text(self._words["phase"][shown])
            set_label(pause, say["resume" if state.paused else "pause"])

        self._updates.append(update)

    def _first_hint(self) -> None:
        """Show what one can do here, until the visitor confirms having read it."""
        say = self._words["studio"]
        with ui.element("div").classes("first"):
            steps = "".join(f"<li>{escape(say[f'first_{step}'])}</li>" for step in (1, 2, 3))
            ui.html(f"<b>{escape(say['first'])}</b><ol>{steps}</ol>", sanitize=False)
            read = button(say["first_read"], "")
        away = 'event.currentTarget.closest(".first").hidden = true;'
        read.on("click", js_handler=f"(event) => {{ {keep('met', '1')} {away} }}")

    def _languages(self) -> None:
        chosen = self._preferences.language
        options = "".join(
            f'<option value="{name}"{" selected" if name == chosen else ""}>{own_name(name)}'
            for name in page_languages()
        )
        choice = ui.html(options, sanitize=False, tag="select").classes("plain-button")
        choice.props(f'aria-label="{self._words["studio"]["choose_language"]}"')
        choice.on("change", js_handler=_CHOOSE_LANGUAGE)

    def _stage(self) -> None:
        say = self._words["studio"]
        with ui.element("section").classes("card stage").props(f'aria-label="{say["scene"]}"'):
            robot = describe(self._runner).model_dump()
            told = {name: say[name] for name in ("no_3d", "clip", "clip_making")}
            view = RobotView(robot=robot, faces=CATALOGUE.faces(), label=say["scene"], words=told)
            with ui.element("div").classes("over low"):
                hand = button(say["hand_out"], say["hand_hint"])
                button(say["reset_view"], "").on("click", view.reset)
                hint = ui.label(say["hand_hint"]).classes("hint")
                hint.set_visibility(False)

        async def toggle() -> None:
            out = self._runner.snapshot.state.hand_out
            place = None if out else np.array(HAND_START)
            if not out:
                view.reach(HAND_START)
            await attempt(self._runner, MoveHand(place, np.array([0.0, 1.0, 0.0])))

        hand.on("click", toggle)

        def update(state: State) -> None:
            shown = state.hand_out
            hand.set_visibility(state.hand is not None)
            hint.set_visibility(shown)
            set_label(hand, say["hand_away" if shown else "hand_out"])

        self._updates.append(update)

    def _feelings(self) -> None:
        say, level = self._words["studio"], dict(self._words["level"])
        with ui.element("section").classes("card feelings"):
            heading(say["feelings"])
            begin = self._preferences.strength
            names = {**level, "names": self._words["feeling"]}
            board = Levels(words=names, faces=CATALOGUE.faces(), strength=begin)
            with ui.element("div").classes("strength"):
                ui.label(say["strength"]).classes("field-label")
                strength = ui.slider(min=0.05, max=1, step=0.05, value=begin)
                strength.props(f'label aria-label="{say["strength"]}"')
                strength.on_value_change(lambda event: board.set_strength(float(event.value)))
                strength.on(
                    "update:model-value", js_handler=f"(v) => {{ {keep('strength', 'v')} }}"
                )
                ui.label(level["press"]).classes("field-label")
            ui.html(
                talk_form(self._words)
                + senses_form(
                    self._words, "voice", "speech", "ears", "eyes", sounded=self._sounded
                ),
                sanitize=False,
            )

    def _tabs(self) -> None:
        say, inside = self._words["studio"], self._panel_updates
        panels: dict[str, Callable[[], None]] = {
            "contact": partial(contact_panel, self._runner, self._words, inside["contact"]),
            "time": self._plots,
            "gestures": partial(gestures_panel, self._runner, self._words),
            "body": partial(body_panel, self._runner, self._words, inside["body"]),
        }
        with ui.element("section").classes("card tabs-card"):
            with ui.tabs().props("align=left inline-label no-caps") as tabs:
                for name in TABS:
                    ui.tab(name, label=say[name])
            tabs.on("update:model-value", js_handler=f"(tab) => {{ {keep('tab', 'tab')} }}")
            shown = self._preferences.tab
            self._open = ui.tab_panels(tabs, value=shown, animated=False, keep_alive=True)
            with self._open:
                for name in TABS:
                    with ui.tab_panel(name):
                        panels[name]()

    def _plots(self) -> None:
        Plots(
            words=self._words["plot"],
            feelings=[self._words["feeling"][name] for name in FEELINGS],
            colours=[feeling.colour.screen for feeling in CATALOGUE.feeling],
            joints=[self._words["joint"][name] for name in JOINTS],
        )

    def _pairing(self) -> ui.dialog:
        say = self._words["pair"]
        with ui.dialog() as dialog, ui.card().classes("card"):
            dialog.props(f'aria-label="{say["title"]}"')
            heading(say["title"])
            ui.link(say["here"], "/face", new_tab=True)
            token, safe = self._reach.token, self._reach.authority is not None
            if token is None or not self._reach.addresses:
                ui.label(say["local"])
            else:
                self._codes(token)
                ui.label(say["warns" if safe else "plain"])
            if safe:
                ui.link(say["install"], PAIRING, new_tab=True)
            else:
                ui.html("miburi run --https", sanitize=False, tag="code")
            button(say["close"], "").on("click", dialog.close)
        return dialog

    def _codes(self, token: str) -> None:
        say = self._words["pair"]
        urls = {address: pairing_url(address, token, "/face") for address in self._reach.addresses}
        first = self._reach.addresses[0]
        code = ui.html(qr_svg(urls[first]), sanitize=False).classes("qr")
        ui.label(say["scan"])
        if len(urls) > 1:
            names = {address: address.partition("://")[2] for address in urls}
            network = Choice(names, first, say["network"])
            network.on_value_change(lambda event: code.set_content(qr_svg(urls[event.value])))

    async def _release(self, event: GenericEventArguments) -> None:
        # A person here sees the body, and need not wait for the pause after a contact.
        seen = event.args if isinstance(event.args, int) else None
        await attempt(self._runner, Release(by_person=True, seen=seen))

    async def _toggle_pause(self) -> None:
        await attempt(self._runner, Pause(not self._runner.snapshot.state.paused))

    def _look(self) -> None:
        state = self._runner.snapshot.state
        for update in (*self._updates, *self._panel_updates.get(self._open.value, ())):
            update(state)
