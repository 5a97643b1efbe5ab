"""Run a partner with a ninth feeling, in its own process, with ``MIBURI_FEELINGS`` set.

    python pride.py FOLDER

The folder holds ``feelings.toml``, ``gestures/pride.toml`` and ``temperament.toml``. The script
prints a report as JSON.
"""

import asyncio
import json
import re
import sys
from collections.abc import Callable
from pathlib import Path

import httpx
import numpy as np
from fastapi import FastAPI

from miburi.errors import DescriptionError, InputError
from miburi.feelings import (
    FEELINGS,
    EmotionalModel,
    Expression,
    SpikingModel,
    Stimulus,
    load_temperament,
    shipped_temperament,
)
from miburi.gestures import read_repertoire
from miburi.interface.api import make_api
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.live.wishes import Perform
from miburi.robot import iphonoid
from miburi.studies.day import live_day
from miburi.studies.face import face
from miburi.studio.face_page import add_face_page
from miburi.wire.messages import StimulusIn


def refusal(action: Callable[[], object]) -> str:
    """Return the message with which an action is refused."""
    try:
        action()
    except (DescriptionError, InputError) as error:
        return str(error)
    return ""


def page_of(app: FastAPI, path: str) -> str:
    """Return the page that the server sends."""

    async def get() -> str:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://miburi") as client:
            return (await client.get(path)).raise_for_status().text

    return asyncio.run(get())


def main(folder: Path) -> dict[str, object]:
    own = load_temperament(folder / "temperament.toml")
    report: dict[str, object] = {"feelings": FEELINGS}

    # Felt.
    for kind in (EmotionalModel, SpikingModel):
        model = kind(own)
        model.set_state(emotion={"sadness": 0.5})
        for _ in range(10):
            model.stimulate(Stimulus("pride", 0.8))
            model.step(15)
        shown = model.express()
        again = kind.load(model.save(), own)
        report[kind.kind] = {
            "shown": shown and shown.feeling,
            "mood": shown and shown.mood,
            "levels": [len(level) for level in (model.emotion, model.feeling, model.mood)],
            "again": bool(np.array_equal(again.mood, model.mood)),
        }
    report["day"] = live_day(EmotionalModel(own)).levels.shape[1:]
    shipped = shipped_temperament()
    pride = FEELINGS.index("pride")
    report["shipped"] = [shipped.lasting["pride"], shipped.matrix[pride].tolist()]
    text = (folder / "temperament.toml").read_text()
    (folder / "lacking.toml").write_text(re.sub(r"(?m)^pride = 1.*\n", "", text))
    report["lacking"] = refusal(lambda: load_temperament(folder / "lacking.toml"))
    old = EmotionalModel(own).save()
    del old["feelings"]
    report["old state"] = refusal(lambda: EmotionalModel.load(old))

    # Performed.
    robot = iphonoid()
    model = EmotionalModel(own)
    model.stimulate(Stimulus("pride", 1.0))
    repertoire = read_repertoire(folder / "gestures", robot)
    runner = Runner(robot, model, Archive(folder / "recordings"), repertoire=repertoire)
    runner.ask(Perform(Expression("pride", 0.9)))
    runner.tick()
    state = runner.snapshot.state
    report["felt"] = state.felt and state.felt.feeling
    extent = 0.0
    while state.asked:
        extent = max(extent, state.extent)
        report["expressed"] = state.expressed and state.expressed.feeling
        report["weights"] = state.face
        runner.tick()
        state = runner.snapshot.state
    report["extent"], report["stop"] = extent, state.stop is not None

    # Offered and drawn.
    app: FastAPI = make_api(runner)
    add_face_page(app, runner)
    report["state"] = json.loads(page_of(app, "/api/v1/state"))
    report["robot"] = json.loads(page_of(app, "/api/v1/robot"))["feelings"]
    report["stimulus"] = StimulusIn.model_json_schema()["properties"]["feeling"]["enum"]
    for language in ("en", "ja"):
        page = page_of(app, f"/face?lang={language}")
        words = re.search(r'<script type="application/json" id="words">(.*)</script>', page)
        assert words
        report[f"page {language}"] = json.loads(words[1])
    report["film"] = bool(np.array_equal(face(Expression("pride", 0.9)), face(None)))
    return report


if __name__ == "__main__":
    print(json.dumps(main(Path(sys.argv[1]))))
