"""A clip of the last seconds, judged by ffmpeg."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect
from tests.fixtures.browser import ask, needs_browser, until

pytestmark = needs_browser

WIDTH, HEIGHT = 96, 60


def seen(page: Page) -> float:
    """The s that a page remembers."""
    return float(
        page.evaluate(
            "() => { const all = document.querySelector('.robot-view').view.past.moments;"
            " return (all.at(-1).at - all[0].at) / 1000; }"
        )
    )


@pytest.mark.proof("test_the_scene_is_drawn_as_it_should_be")
@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs ffmpeg")
def test_the_last_seconds_are_saved_as_a_film(scene: Page, tmp_path: Path) -> None:
    # A recorder may begin late, as on a busy machine: nothing of the film is lost by that.
    scene.evaluate(
        "() => { const start = MediaRecorder.prototype.start; MediaRecorder.prototype.start ="
        " function (...how) { setTimeout(() => start.apply(this, how), 1500); }; }"
    )
    ask(scene, "/express", feeling="thrill", mood=1.0)
    until(scene, lambda now: now["asked"] and now["extent"] > 0.1)
    least = seen(scene)
    with scene.expect_download() as waiting:
        scene.get_by_role("button", name="Save clip").click()
        expect(scene.get_by_role("button", name="Making the clip")).to_be_disabled()
    path = tmp_path / waiting.value.suggested_filename
    waiting.value.save_as(path)
    scale = ["-vf", f"fps=5,scale={WIDTH}:{HEIGHT},format=gray", "-f", "rawvideo", "-"]
    film = subprocess.run(
        ["ffmpeg", "-v", "error", "-i", str(path), *scale], capture_output=True, check=True
    )
    pictures = np.frombuffer(film.stdout, np.uint8).reshape(-1, HEIGHT, WIDTH).astype(float)
    assert len(pictures) / 5 >= least - 0.2
    assert np.abs(pictures - pictures[0]).mean(axis=(1, 2)).max() > 1.0  # the arms have moved
