import re
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import pytest
from PIL import Image

from miburi.bodies.rehearsal import rehearse
from miburi.feelings import FEELINGS
from miburi.gestures import key_poses, load, shipped_repertoire
from miburi.safety.stop import Stop, StopReason
from miburi.studies.gestures import gallery
from miburi.studies.gestures.pictures import Pictures

STOP = Stop(0.4, StopReason.CONTACT, "left_elbow", "speed", 0.5)


def test_the_page_shows_every_feeling_at_three_moods(robot, tmp_path, monkeypatch):
    rehearsal = rehearse(robot, key_poses(robot, load("surprise"), 0.0))

    def show(robot, function, mood, folder, _, face):
        names = [f"{function.name}-{mood}{end}" for end in ("-strip.png", ".mp4", "-paths.png")]
        for name in names:
            (folder / name).touch()
        Image.new("RGB", (60, 10)).save(folder / names[0])
        stopped = (function.name, mood) == ("anger", 0.9)
        shown = replace(rehearsal, stop=STOP) if stopped else rehearsal
        return Pictures(function, mood, shown, *names)

    monkeypatch.setattr(gallery, "show", show)
    monkeypatch.setattr(gallery, "camera_on", lambda _: nullcontext())
    told = []
    out = tmp_path / "gallery"
    page = gallery.write_gallery(robot, shipped_repertoire(), out, progress=told.append)
    text = page.read_text(encoding="utf-8")
    named = set(re.findall(r'src="([^"]+)"', text))
    assert named == {file.name for file in page.parent.iterdir()} - {"index.html", "overview.png"}
    assert len(named) == 3 * 3 * len(FEELINGS)
    fault = "not shown whole: the contact rule stopped it after 0.40 s at the left elbow"
    assert text.count(fault) == 1
    assert [line for line in told if ":" in line] == [f"anger 0.9: {fault}"]
    assert "http" not in text  # works without a network
    assert all(f'<section id="{feeling}">' in text for feeling in FEELINGS)
    assert len(re.findall("<tr><td>", text)) == 3 * len(FEELINGS)


def test_what_an_interrupted_gallery_has_drawn_stays(robot, tmp_path, monkeypatch):
    """A page of an earlier gallery would show films that are not its own."""

    def show(robot, function, mood, folder, _, face):
        if mood == gallery.MOODS[1]:
            raise KeyboardInterrupt
        (folder / f"{function.name}.mp4").touch()
        return SimpleNamespace(fault="")

    monkeypatch.setattr(gallery, "show", show)
    monkeypatch.setattr(gallery, "camera_on", lambda _: nullcontext())
    (tmp_path / "index.html").touch()
    repertoire = shipped_repertoire()
    with pytest.raises(KeyboardInterrupt):
        gallery.write_gallery(robot, repertoire, tmp_path)
    films = [file.name for file in tmp_path.iterdir()]
    assert films == [f"{repertoire.functions[0].name}.mp4"]
