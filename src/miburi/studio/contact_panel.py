"""The studio's panel for contacts: the reason for a stop, the measurements, and the log."""

from collections.abc import Callable
from html import escape
from math import degrees

from nicegui import ui

from miburi.live.events.event import LiveEvent
from miburi.live.state import EndReason, State, StopOut
from miburi.live.view import LivePartner
from miburi.safety.stop import StopReason
from miburi.senses import Brought
from miburi.senses.tone import RAISED
from miburi.studio.parts import heading
from miburi.studio.words import Words, pressed_by

_LOG_LINES = 60
#: The largest force shown, in N. Above this force the page says "more than", because a simulated
#: hand that is pushed through an arm does not measure the motors. In trials, hands that move as
#: people's do felt 51 N at most (docs/safety.md).
_FIRM = 60.0
#: How many reasons the log's line for a stimulus shows at most, before a visitor opens it.
_WHYS = 3


def contact_panel(
    runner: LivePartner, words: Words, updates: list[Callable[[State], None]]
) -> None:
    """Add the panel, and append to ``updates`` the function to call with each new state."""
    say = words["contact"]
    with ui.element("div").classes("panel"):
        with ui.element("div"):
            headline = ui.element("h2")
            with headline:
                first = ui.label()
            second = ui.label()
            measured = ui.html("", sanitize=False)
        with ui.element("div"):
            heading(say["log"])
            log = ui.html("", sanitize=False)
    shown: tuple[object, ...] = ()
    seen = -1

    def update(state: State) -> None:
        nonlocal shown, seen
        now = (state.stop, state.phase, state.held, state.latest, state.rule)
        if now == shown:
            return
        shown = now
        first_words, second_words = why(state, words)
        first.set_text(first_words)
        second.set_text(second_words)
        entries = runner.history.after(0)
        measured.set_content(facts(state, entries, words))
        if state.latest != seen:
            seen = state.latest
            log.set_content(_log([e for e in entries if _shows(e, words)][-_LOG_LINES:], words))

    updates.append(update)


def why(state: State, words: Words) -> tuple[str, str]:
    """Return two sentences: why the body is stopped or not, and what comes next."""
    say, stop = words["contact"], state.stop
    if stop is None:
        going_back = state.phase == "returning"
        # A number and its unit stay on one line.
        rule = {
            "ratio": f"{100 * state.rule.ratio:g}\N{NO-BREAK SPACE}%",
            "period": f"{state.rule.period:g}\N{NO-BREAK SPACE}s",
        }
        return say["free"], say["returning" if going_back else "free_more"].format(**rule)
    if stop.reason is StopReason.CONTACT and stop.motor is not None:
        contact = say["met"].format(motor=words["joint"][stop.motor])
        return contact, say["held" if state.held else "waits"]
    if stop.reason is StopReason.ASKED:
        return say["asked"], say["held"]
    waits = stop.reason.passes and not state.held
    if stop.reason is StopReason.TOUCHED and stop.motor is not None:
        led = say["led"].format(motor=words["joint"][stop.motor])
        return led, say["rests" if waits else "held"]
    failed = say["failed"].format(reason=words["reason"][stop.reason])
    return failed, say["waits" if waits else "held"]


def why_ended(reason: EndReason, detail: str | None, words: Words) -> str:
    """Return why a recording ended by itself, in words."""
    return words["recording"][reason].format(detail=detail)


def facts(state: State, entries: list[LiveEvent], words: Words) -> str:
    """Return the measurements of the present or latest contact, as HTML."""
    stop = state.stop
    if stop is not None:
        contact = stop.reason is StopReason.CONTACT
        return measurements(stop, state.rule.ratio, words) if contact else ""
    contacts = [
        entry for entry in entries if entry.stop and entry.stop.reason is StopReason.CONTACT
    ]
    if not contacts or contacts[-1].stop is None:
        return ""
    latest = contacts[-1].stop
    title = words["contact"]["latest"].format(
        motor=words["joint"].get(latest.motor or "", ""), time=f"{contacts[-1].time:.1f} s"
    )
    return f"<h3>{escape(title)}</h3>{measurements(latest, contacts[-1].limit, words)}"


def measurements(stop: StopOut, limit: float | None, words: Words) -> str:
    """Return the measurements of a contact stop, as HTML."""
    say = words["contact"]
    rows = []
    if stop.measured is not None and stop.expected is not None:
        rows += [
            (say["measured"], f"{degrees(stop.measured):.0f} °/s"),
            (say["expected"], f"{degrees(stop.expected):.0f} °/s"),
        ]
    by_speed = stop.sign == "speed"
    untold = not by_speed or stop.measured is None
    if untold and stop.moved is not None and stop.due is not None:
        rows += [
            (say["moved"], f"{degrees(stop.moved):.1f}°"),
            (say["due"], f"{degrees(stop.due):.1f}°"),
        ]
    if stop.ratio is not None:
        beside = f" ({say['limit'].format(limit=limit)})" if by_speed else ""
        rows.append((say["ratio" if by_speed else "way"], f"{stop.ratio:.2f}{beside}"))
    rows.append((say["sign"], say[f"sign_{stop.sign}"]))
    if stop.force is not None:
        over = say["force_over"].format(most=_FIRM)
        rows.append((say["force"], f"{stop.force:.1f} N" if stop.force <= _FIRM else over))
    if stop.mood_before is not None and stop.mood_after is not None:
        change = 100 * (stop.mood_after / stop.mood_before - 1) if stop.mood_before else 0.0
        moods = f"{stop.mood_before:.2f} → {stop.mood_after:.2f} ({change:+.0f} %)"
        rows.append((say["mood"], moods.replace("-", "−")))
    cells = "".join(f"<dt>{escape(a)}</dt><dd>{escape(b)}</dd>" for a, b in rows)
    return f'<dl class="facts">{cells}</dl>'


def _shows(event: LiveEvent, words: Words) -> bool:
    if event.kind == "wish_dropped":
        return event.name == "lapsed"
    return event.kind == "stop" or event.kind in words["log"]


def _log(entries: list[LiveEvent], words: Words) -> str:
    if not entries:
        return escape(words["contact"]["empty"])
    lines = "".join(
        f'<li class="{entry.kind}"><time>{entry.time:.1f} s</time>{_entry_html(entry, words)}</li>'
        for entry in reversed(entries)
    )
    return f'<ol class="log" tabindex="0">{lines}</ol>'


def _entry_html(entry: LiveEvent, words: Words) -> str:
    """Return an entry as HTML, which opens to show its reasons with their weights."""
    text = escape(line(entry, words))
    if not entry.why:
        return f"<span>{text}</span>"
    parts = escape(
        ", ".join(f"{_sign(part, entry, words)} +{part.weight:.1f}" for part in entry.why)
    )
    hint = escape(words["talk"]["weights"])
    return (
        f'<details data-entry="{entry.number}"><summary>{text}</summary>'
        f"<small>{hint}: {parts}</small></details>"
    )


def _sign(part: Brought, entry: LiveEvent, words: Words) -> str:
    """Return one reason for a stimulus: a word as it was said, or what happened, in words."""
    if part.what == RAISED:
        return words["talk"]["raised"]
    if entry.source == "speech":
        return words["talk"]["quoted"].format(what=part.what)
    return words["happening"].get(part.what.replace(" ", "_"), part.what)


def line(entry: LiveEvent, words: Words) -> str:
    """Return an entry of the log in words."""
    say, stop = words["log"], entry.stop
    if stop is not None and stop.reason is StopReason.CONTACT and stop.motor is not None:
        return say["stopped" if stop.sign == "speed" else "stopped_way"].format(
            motor=words["joint"][stop.motor],
            ratio=f"{100 * (stop.ratio or 0):.0f} %",
            before=f"{stop.mood_before or 0:.2f}",
            after=f"{stop.mood_after or 0:.2f}",
        )
    name = (entry.text or "…") if entry.kind == "speech_begun" else entry.name or ""
    if entry.kind == "distress":
        quoted = words["talk"]["quoted"].format(what=entry.text) if entry.text else ""
        name = f"{words['distress'][name]} {quoted}".strip()
    if entry.kind == "stop":
        key = "stopped_asked" if name == StopReason.ASKED else "stopped_other"
        return say[key].format(name=words["reason"][name])
    if entry.reason is not None:
        reason = why_ended(entry.reason, entry.detail, words)
        return say["recording_ended"].format(name=name, reason=reason)
    if entry.why:
        first = line(entry.model_copy(update={"why": None}), words)
        told = ", ".join(_sign(part, entry, words) for part in entry.why[:_WHYS])
        return say["stimulus_why"].format(line=first, why=told)
    if entry.by is not None and entry.kind in ("pressed", "release_begun"):
        pressed = pressed_by(entry.by, entry.detail, words)
        released = say["released_by"].format(by=words["by"][entry.by])
        return pressed if entry.kind == "pressed" else released
    moves = entry.kind == "gesture_begun" and entry.feeling is None
    return say["move_begun" if moves else entry.kind].format(
        name=words["body"].get(name, name) if entry.kind in ("body", "temperament") else name,
        feeling=words["feeling"].get(entry.feeling or "", ""),
        source=words["source"].get(entry.source or "", ""),
        strength=f"{entry.strength or 0:.2f}",
        mood=f"{entry.mood or 0:.2f}",
    )
