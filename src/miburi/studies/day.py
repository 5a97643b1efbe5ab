"""A day of conversation: run an emotional model through scripted stimuli, and plot its levels."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from miburi.feelings import LEVELS, EmotionalModel, FeelingModel, Stimulus
from miburi.feelings.catalogue import CATALOGUE, FEELINGS
from miburi.feelings.temperament import Array, Temperament
from miburi.ground.files import whole_files
from miburi.studies.figures import figure_file

#: One colour for each feeling, in the order of ``FEELINGS``.
COLOURS = tuple(feeling.colour.paper for feeling in CATALOGUE.feeling)
_HOUR = 3600.0
_STARTS, _ENDS = 8, 20  # o'clock
_SAMPLE = 10.0  # s between two points of the record
_CLOSE_UP = (17.0, 17.0 + 2 / 60)  # two minutes with a record every second


@dataclass(frozen=True)
class Episode:
    """A part of the day, from ``hour`` o'clock on, ``minutes`` long.

    It has ``count`` stimuli, taken from ``stimuli`` in turn. Near the end of the episode, somebody
    blocks ``contacts`` gestures.
    """

    title: str
    hour: float
    minutes: float
    count: int
    stimuli: tuple[Stimulus, ...]
    contacts: int = 0


#: The script of the day.
DAY = (
    Episode("a happy\nbreakfast", 8.25, 25, 50, (
        Stimulus("happiness", 0.7, "speech"),
        Stimulus("happiness", 0.6, "face"),
        Stimulus("happiness", 0.5, "touch"),
    )),
    Episode("a door\nslams", 9.75, 3, 6, (
        Stimulus("fright", 1.0, "application"),
        Stimulus("fear", 0.7, "face"),
    )),
    Episode("sad news", 10.75, 35, 60, (
        Stimulus("sadness", 0.8, "speech"),
        Stimulus("sadness", 0.7, "face"),
    )),
    Episode("the grandchildren\nplay with it", 13.0, 40, 120, (
        Stimulus("happiness", 0.8, "speech"),
        Stimulus("thrill", 0.8, "speech"),
        Stimulus("happiness", 0.7, "face"),
        Stimulus("thrill", 0.7, "touch"),
    ), contacts=3),
    Episode("a quarrel", 15.5, 20, 45, (
        Stimulus("anger", 0.9, "speech"),
        Stimulus("disgust", 0.6, "speech"),
        Stimulus("anger", 0.8, "face"),
    )),
    Episode("a visitor", 17.0, 30, 60, (
        Stimulus("surprise", 0.9, "face"),
        Stimulus("happiness", 0.7, "speech"),
        Stimulus("happiness", 0.6, "face"),
    )),
)  # fmt: skip


@dataclass(frozen=True)
class Day:
    """The record of a day: n moments, and the levels of k feelings at each."""

    hours: Array  # (n,), h
    levels: Array  # (n, 3, k) in [0, 1]: emotion, feeling, mood
    shown: Array  # (n,) indices into FEELINGS, −1 while neutral
    contacts: Array  # (m,) times at which somebody blocked a gesture, h


def live_day(model: FeelingModel, *, seed: int = 1) -> Day:
    """Run an emotional model through ``DAY``, from its state at eight in the morning.

    ``seed`` shifts each stimulus by up to half the interval between two stimuli. The record has a
    row every 10 s, every second in the close-up, and after each stimulus and contact.
    """
    random = np.random.default_rng(seed)
    events: list[tuple[float, Stimulus | None]] = []
    contacts: list[float] = []
    for episode in DAY:
        start, length = episode.hour * _HOUR, episode.minutes * 60
        at = start + (np.arange(episode.count) + random.uniform(0, 1, episode.count)) * (
            length / episode.count
        )
        events += [(t, episode.stimuli[k % len(episode.stimuli)]) for k, t in enumerate(at)]
        contacts += [start + length * (0.75 + 0.1 * k) for k in range(episode.contacts)]
    events += [(t, None) for t in contacts]
    whole = np.arange(_STARTS * _HOUR, _ENDS * _HOUR, _SAMPLE)
    close = np.arange(_CLOSE_UP[0] * _HOUR, _CLOSE_UP[1] * _HOUR)
    moments = [(float(t), "record") for t in np.union1d(whole, close)]
    agenda = sorted([*moments, *events], key=lambda event: event[0])

    now, rows = _STARTS * _HOUR, []
    for time, event in agenda:
        model.step(time - now)
        now = time
        if isinstance(event, Stimulus):
            model.stimulate(event)
        elif event is None:
            model.contact()
        expression = model.express()
        rows.append(
            (
                time / _HOUR,
                np.stack([model.emotion, model.feeling, model.mood]),
                -1 if expression is None else FEELINGS.index(expression.feeling),
            )
        )
    hours, levels, shown = zip(*rows, strict=True)
    return Day(np.array(hours), np.stack(levels), np.array(shown), np.array(contacts) / _HOUR)


def plot_day(
    out: Path | str,
    model: FeelingModel | None = None,
    *,
    seed: int = 1,
    about: Mapping[str, str] = MappingProxyType({}),
) -> Path:
    """Run a model through the day as :func:`live_day` does, and write ``day.png`` into a folder.

    By default the model is a new :class:`EmotionalModel`. ``about`` becomes the picture's metadata.
    Beside the picture, ``day.csv`` has a row for each moment: the hour, the feeling that is shown,
    and the three levels of each feeling.

    Raises OutputError if the files cannot be written there.
    """
    model = model or EmotionalModel()
    day = live_day(model, seed=seed)
    with (
        whole_files(out) as draft,
        figure_file(draft / "day.png", (13, 9), dpi=120, about=about) as figure,
    ):
        _draw(figure, day, model.temperament)
        _write_levels(day, draft / "day.csv")
    return Path(out) / "day.png"


def _write_levels(day: Day, path: Path) -> None:
    names = [f"{level}_{feeling}" for level in LEVELS for feeling in FEELINGS]
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["hour", "shown", *names])
        for hour, shown, levels in zip(day.hours, day.shown, day.levels, strict=True):
            feeling = FEELINGS[shown] if shown >= 0 else ""
            table.writerow([round(float(hour), 6), feeling, *levels.ravel().round(6).tolist()])


def _draw(figure: Figure, day: Day, temperament: Temperament) -> None:
    strip, *panels = figure.subplots(
        4, 1, sharex=True, gridspec_kw={"height_ratios": [0.35, 2, 2, 2.6]}
    )
    figure.suptitle(f"A day of conversation ({temperament.name} temperament)", fontsize=15)
    for feeling, colour in enumerate(COLOURS):
        strip.fill_between(day.hours, 0, 1, where=day.shown == feeling, color=colour, step="post")
    strip.set_yticks([])
    strip.set_ylabel("shown", rotation=0, ha="right", va="center")
    for row, (axes, level) in enumerate(zip(panels, LEVELS, strict=True)):
        for feeling, colour in enumerate(COLOURS):
            values = day.levels[:, row, feeling]
            axes.plot(day.hours, values, color=colour, lw=0.6 if row == 0 else 2)
            rest = temperament.rest[feeling] if level == "mood" else 0.0
            alpha = 0.25 if row == 0 else 0.12
            axes.fill_between(day.hours, rest, values, color=colour, alpha=alpha)
        axes.set_ylim(0, 1.05)
        axes.set_ylabel(
            f"{level}\n({_in_words(getattr(temperament.time_constants, level))})", fontsize=12
        )
        axes.grid(axis="y", alpha=0.25)
    for axes in (strip, *panels):
        axes.spines[["top", "right"]].set_visible(False)
        for episode in DAY:
            axes.axvspan(
                episode.hour, episode.hour + episode.minutes / 60, color="0.5", alpha=0.13, lw=0
            )
    for episode in DAY:
        middle = episode.hour + episode.minutes / 120
        strip.annotate(
            episode.title, (middle, 1.1), ha="center", va="bottom", annotation_clip=False
        )
    mood = panels[-1]
    for contact in day.contacts:
        mood.axvline(contact, color="0.2", lw=1, ls=":")
    if len(day.contacts):
        mood.annotate(
            "blocked: mood × 0.8",
            (day.contacts[-1], 1.0),
            (6, 0),
            textcoords="offset points",
            va="center",
        )
    _zoom(panels[0], day)
    _name_moods(mood, day)
    lines = [Line2D([], [], color=colour, lw=4) for colour in COLOURS]
    figure.legend(lines, FEELINGS, loc="outside lower center", ncols=len(FEELINGS), frameon=False)
    mood.set_xlim(_STARTS, _ENDS)
    mood.set_xticks(range(_STARTS, _ENDS + 1), [f"{h}:00" for h in range(_STARTS, _ENDS + 1)])


def _in_words(seconds: float) -> str:
    """Return a time constant in its usual unit: h, min or s."""
    for unit, length in (("h", _HOUR), ("min", 60.0)):
        if seconds >= length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.3g} s"


def _zoom(emotion: Axes, day: Day) -> None:
    """Show two minutes of the last episode, in which the emotion changes within seconds."""
    start, end = _CLOSE_UP
    close = emotion.inset_axes((0.83, 0.2, 0.17, 0.7))
    inside = (day.hours >= start) & (day.hours <= end)
    seconds = (day.hours[inside] - start) * _HOUR
    for feeling, colour in enumerate(COLOURS):
        close.plot(seconds, day.levels[inside, 0, feeling], color=colour, lw=1.5)
    close.set_xlim(0, (end - start) * _HOUR)
    close.set_ylim(0, 1.05)
    close.set_xlabel("seconds of the visit", labelpad=1)
    close.tick_params(labelsize=8)


def _name_moods(mood: Axes, day: Day) -> None:
    """Label the mood that rises most in each episode."""
    ends = [*(episode.hour for episode in DAY[1:]), float(_ENDS)]
    for episode, end in zip(DAY, ends, strict=True):
        of_episode = np.flatnonzero((day.hours > episode.hour) & (day.hours < end))
        # Compare rises, because earlier moods may still be higher.
        values = day.levels[of_episode, 2]
        peak, feeling = np.unravel_index(np.argmax(values - values[0]), values.shape)
        mood.annotate(
            FEELINGS[feeling],
            (day.hours[of_episode[peak]], values[peak, feeling]),
            (0, 4),
            textcoords="offset points",
            ha="center",
            color=COLOURS[feeling],
            fontweight="bold",
        )
