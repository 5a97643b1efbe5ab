"""Check a partner with a ninth feeling, in its own process, with ``MIBURI_FEELINGS`` set.

    python pride.py FOLDER

The folder holds ``feelings.toml``, ``gestures/pride.toml`` and ``temperament.toml``.
"""

import asyncio
import json
import re
import sys
from pathlib import Path

import httpx
import numpy as np
import pytest
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
from miburi.feelings.catalogue import PAPER
from miburi.gestures import read_repertoire
from miburi.interface.api import make_api
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.live.wishes import Perform
from miburi.robot import iphonoid
from miburi.studio.face_page import add_face_page
from miburi.wire.messages import StimulusIn

FOLDER = Path(sys.argv[1])
OWN = load_temperament(FOLDER / "temperament.toml")
NINE = [*PAPER, "pride"]
assert list(FEELINGS) == NINE

# Felt, and saved.
for kind in (EmotionalModel, SpikingModel):
    model = kind(OWN)
    model.set_state(emotion={"sadness": 0.5})
    for _ in range(10):
        model.stimulate(Stimulus("pride", 0.8))
        model.step(15)
    shown = model.express()
    assert shown is not None
    assert shown.feeling == "pride"
    assert shown.mood > 0.02
    assert np.array_equal(kind.load(model.save(), OWN).mood, model.mood)
old = EmotionalModel(OWN).save()
del old["feelings"]
with pytest.raises(InputError, match="must be for the feelings happiness"):
    EmotionalModel.load(old)

# Shipped temperaments are neutral about it; a user's own must name it.
shipped = shipped_temperament()
assert shipped.lasting["pride"] == 1.0
assert shipped.matrix[FEELINGS.index("pride")].tolist() == [0.0] * 8 + [1.0]
lacking = FOLDER / "lacking.toml"
lacking.write_text(re.sub(r"(?m)^pride = 1.*\n", "", (FOLDER / "temperament.toml").read_text()))
with pytest.raises(DescriptionError, match="lacking.toml: lasting: .*pride is missing"):
    load_temperament(lacking)

# Performed.
robot = iphonoid()
model = EmotionalModel(OWN)
model.stimulate(Stimulus("pride", 1.0))
repertoire = read_repertoire(FOLDER / "gestures", robot)
runner = Runner(robot, model, Archive(FOLDER / "recordings"), repertoire=repertoire)
runner.ask(Perform(Expression("pride", 0.9)))
runner.tick()
state, extent = runner.snapshot.state, 0.0
assert state.felt is not None
assert state.felt.feeling == "pride"
while state.asked:
    extent = max(extent, state.extent)
    if state.expressed is not None:
        assert state.expressed.feeling == "pride"
        assert list(state.face) == [0.0] * 8 + [0.9]
    runner.tick()
    state = runner.snapshot.state
assert extent > 0.05
assert state.stop is None

# Offered to programs, and drawn.
app: FastAPI = make_api(runner)
add_face_page(app, runner)


async def page_of(path: str) -> str:
    """Return the page that the server sends."""
    transport = httpx.ASGITransport(app)
    async with httpx.AsyncClient(transport=transport, base_url="http://miburi") as client:
        return (await client.get(path)).raise_for_status().text


answer = json.loads(asyncio.run(page_of("/api/v1/state")))
assert {len(answer[level]) for level in ("emotion", "feeling", "mood", "face")} == {9}
assert json.loads(asyncio.run(page_of("/api/v1/robot")))["feelings"] == NINE
assert StimulusIn.model_json_schema()["properties"]["feeling"]["enum"] == NINE
found = re.search(r'id="words">(.*)</script>', asyncio.run(page_of("/face?lang=ja")))
assert found is not None
words = json.loads(found[1])
assert [face["name"] for face in words["faces"]["feelings"]] == NINE
assert words["faces"]["feelings"][-1]["mouth"] == {"width": 34, "smile": 14, "down": -2}
assert words["feelings"]["pride"] == "誇り"
