"""A partner with a ninth feeling: run in a process of its own, with ``MIBURI_FEELINGS`` set.

    python pride.py FOLDER

The folder holds ``feelings.toml``, ``gestures/pride.toml`` and ``temperament.toml``. What was seen
is printed as JSON.
"""

import asyncio
import json
import re
import sys
from pathlib import Path

import httpx
import numpy as np
from fastapi import FastAPI

from miburi.errors import DescriptionError, InputError
from miburi.feelings import (
    FEELINGS,
    EmotionalModel,
    Expression,
    Stimulus,
    load_temperament,
    shipped_temperament,
)
from miburi.feelings.spiking import SpikingModel
from miburi.gestures import read_repertoire
from miburi.interface.api import make_api
from miburi.interface.wire import StimulusIn
from miburi.live.archive import Recordings
from miburi.live.runner import Runner
from miburi.robot import iphonoid
from miburi.studies.day import live_day
from miburi.studies.face import face
from miburi.studio.face_page import add_face_page


def refusal(action: object) -> str:
    """What an action is refused with."""
    try:
        action()  # type: ignore[operator]
    except (DescriptionError, InputError) as error:
        return str(error)
    return ""


def page_of(app: FastAPI, path: str) -> str:
    """What the server answers."""

    async def get() -> str:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://miburi") as client:
            return (await client.get(path)).raise_for_status().text

    return asyncio.run(get())


def main(folder: Path) -> dict[str, object]:
    own = load_temperament(folder / "temperament.toml")
    seen: dict[str, object] = {"feelings": FEELINGS}

    # Felt.
    for kind in (EmotionalModel, SpikingModel):
        model = kind(own)
        model.set_state(emotion={"sadness": 0.5})
        for _ in range(10):
            model.stimulate(Stimulus("pride", 0.8))
            model.step(15)
        shown = model.express()
        again = kind.load(model.save(), own)
        seen[kind.kind] = {
            "shown": shown and shown.feeling,
            "mood": shown and shown.mood,
            "levels": [len(level) for level in (model.emotion, model.feeling, model.mood)],
            "again": bool(np.array_equal(again.mood, model.mood)),
        }
    seen["day"] = live_day(EmotionalModel(own)).levels.shape[1:]
    shipped = shipped_temperament()
    pride = FEELINGS.index("pride")
    seen["shipped"] = [shipped.lasting["pride"], shipped.matrix[pride].tolist()]
    text = (folder / "temperament.toml").read_text()
    (folder / "lacking.toml").write_text(re.sub(r"(?m)^pride = 1.*\n", "", text))
    seen["lacking"] = refusal(lambda: load_temperament(folder / "lacking.toml"))
    old = EmotionalModel(own).save()
    del old["feelings"]
    seen["old state"] = refusal(lambda: EmotionalModel.load(old))

    # Performed.
    robot = iphonoid()
    model = EmotionalModel(own)
    model.stimulate(Stimulus("pride", 1.0))
    repertoire = read_repertoire(folder / "gestures", robot)
    runner = Runner(robot, model, Recordings(folder / "recordings"), repertoire=repertoire)
    runner.perform(Expression("pride", 0.9))
    runner.tick()
    state = runner.snapshot.state
    seen["felt"] = state.felt and state.felt.feeling
    extent = 0.0
    while state.asked:
        extent = max(extent, state.extent)
        seen["expressed"] = state.expressed and state.expressed.feeling
        seen["weights"] = state.face
        runner.tick()
        state = runner.snapshot.state
    seen["extent"], seen["stop"] = extent, state.stop is not None

    # Offered and drawn.
    app: FastAPI = make_api(runner)
    add_face_page(app)
    seen["state"] = json.loads(page_of(app, "/api/v1/state"))
    seen["robot"] = json.loads(page_of(app, "/api/v1/robot"))["feelings"]
    seen["stimulus"] = StimulusIn.model_json_schema()["properties"]["feeling"]["enum"]
    for language in ("en", "ja"):
        page = page_of(app, f"/face?lang={language}")
        words = re.search(r'<script type="application/json" id="words">(.*)</script>', page)
        assert words
        seen[f"page {language}"] = json.loads(words[1])
    seen["film"] = bool(np.array_equal(face(Expression("pride", 0.9)), face(None)))
    return seen


if __name__ == "__main__":
    print(json.dumps(main(Path(sys.argv[1]))))
