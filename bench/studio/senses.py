"""Whether memory stays flat while a face sees, hears and speaks.

    python bench/studio/senses.py [--minutes 30]

Starts `miburi run --voice flite` and opens its face in headless Chromium, into whose camera a
portrait goes, and into whose microphone talk and claps; eyes, ears and voice are on. Something is
said to it every 20 s, which it answers aloud. Prints each minute, in MB: the memory of the
partner's processes, that of Chromium's renderer (its share, PSS), and the page's JavaScript heap
after a collection; at last how much each grew an hour, by least squares after the fifth minute,
what it told, and how long it looked at a picture (wall clock, so of the whole machine's load, too).
"""

import argparse
import io
import os
import re
import sys
import tempfile
import time
from pathlib import Path

import httpx
import numpy as np
from measure import CHROMIUM, PLAIN, memory, partner, processes
from PIL import Image
from playwright.sync_api import Page, expect, sync_playwright

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))  # the tests' made sounds and portrait
from tests.fixtures.sounds import add, claps, talks, write_sound  # noqa: E402  (below the root)

SMILE = ROOT / "tests" / "fixtures" / "smile.jpg"
SENTENCES = ("I am so happy today!", "I am so sad today", "That scares me", "What a lovely day")
EVERY, WARM = 20.0, 5
#: Keeps in window.looks how long each look took, ms; eyes.js writes it on the page.
WATCH_LOOKS = """() => {
  const { dataset } = document.documentElement;
  window.looks = [];
  new MutationObserver(() => window.looks.push(Number(dataset.seeing))).observe(
    document.documentElement, { attributeFilter: ["data-seeing"] });
}"""
SWITCHES = ("Voice", "Ears", "Eyes")


def film(folder: Path) -> Path:
    """A portrait that moves from left to right and back; a camera repeats it."""
    path, frames = folder / "face.mjpeg", io.BytesIO()
    smile = Image.open(SMILE).resize((170, 170))
    for number in range(60):
        picture = Image.new("RGB", (320, 240), (120, 130, 140))
        picture.paste(smile, (round(75 + 60 * np.sin(2 * np.pi * number / 60)), 40))
        picture.save(frames, "JPEG", quality=90)
    path.write_bytes(frames.getvalue())
    return path


def sound(folder: Path) -> Path:
    """Talk, and a clap in it; a microphone repeats it."""
    samples = claps(np.random.default_rng(1))
    add(samples, 0, talks(np.random.default_rng(1))[: len(samples) // 2])
    path = folder / "sound.wav"
    write_sound(path, samples)
    return path


def renderer(pid: int) -> float:
    """Return the share of memory of the largest renderer among a process's children, MB."""
    shares = [0.0]
    for one in processes(pid)[1:]:
        if b"--type=renderer" in Path(f"/proc/{one}/cmdline").read_bytes():
            found = re.search(
                r"Pss:\s+(\d+)", Path(f"/proc/{one}/smaps_rollup").read_text(encoding="utf-8")
            )
            shares.append(int(found.group(1)) / 1024 if found else 0.0)
    return max(shares)


def browser_of(pid: int) -> int:
    """Return the process of Chromium among a process's children."""
    for one in processes(pid)[1:]:
        if b"--remote-debugging-pipe" in Path(f"/proc/{one}/cmdline").read_bytes():
            return one
    raise SystemExit("Chromium was not found among this program's processes.")


def switch_on(page: Page, url: str) -> None:
    page.goto(url + "/face")
    page.locator(".senses summary").click()
    for name in SWITCHES:
        page.get_by_role("switch", name=name).click()
        expect(page.locator("html")).to_have_attribute(f"data-{name.lower()}", "on", timeout=60_000)


def slope(minutes: list[float], values: list[float]) -> float:
    return float(np.polyfit(minutes, values, 1)[0] * 60)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--minutes", type=int, default=30)
    length = parser.parse_args().minutes
    with (
        tempfile.TemporaryDirectory() as place,
        partner("--forget", "--voice", "flite") as (url, pid),
        sync_playwright() as playwright,
    ):
        flags = [
            *PLAIN, "--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream",
            f"--use-file-for-fake-video-capture={film(Path(place))}",
            f"--use-file-for-fake-audio-capture={sound(Path(place))}",
        ]  # fmt: skip
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=flags)
        page = browser.new_page(locale="en-GB", viewport={"width": 390, "height": 844})
        told = {"/sense": 0, "/face": 0, "/voice": 0}

        def count(path: str) -> None:
            for name in told:
                told[name] += f"/api/v1{name}" in path

        page.on("request", lambda request: count(request.url))
        chromium = browser_of(os.getpid())
        switch_on(page, url)
        page.evaluate(WATCH_LOOKS)
        inspector = page.context.new_cdp_session(page)
        inspector.send("Performance.enable")
        print("minute  partner  renderer  heap    load", flush=True)
        seen: list[tuple[float, float, float, float]] = []
        begin = time.monotonic()
        for minute in range(length + 1):
            for turn in range(round(60 / EVERY) if minute else 0):
                httpx.post(url + "/api/v1/say", json={"text": SENTENCES[(minute + turn) % 4]})
                due = begin + 60 * (minute - 1) + EVERY * (turn + 1)
                page.wait_for_timeout(max(0.0, 1000 * (due - time.monotonic())))  # it lives on
            inspector.send("HeapProfiler.collectGarbage")
            metrics = inspector.send("Performance.getMetrics")["metrics"]
            heap = next(one["value"] for one in metrics if one["name"] == "JSHeapUsedSize") / 2**20
            now = (float(minute), memory(pid), renderer(chromium), heap)
            seen.append(now)
            print(f"{minute:6d}{now[1]:9.1f}{now[2]:10.1f}{heap:6.1f}{os.getloadavg()[0]:8.1f}",
                  flush=True)  # fmt: skip
        late = [one for one in seen if one[0] >= min(WARM, length / 2)]
        minutes = [one[0] for one in late]
        for column, name in ((1, "partner"), (2, "renderer"), (3, "heap")):
            print(f"{name}: {slope(minutes, [one[column] for one in late]):+.1f} MB an hour")
        print(f"told: {told['/sense']} signs, {told['/face']} places; {told['/voice']} sentences")
        looks = np.percentile(page.evaluate("window.looks"), (5, 50, 95))
        print("a picture took {:.0f} to {:.0f} ms, {:.0f} in the median".format(*looks[[0, 2, 1]]))
        browser.close()


if __name__ == "__main__":
    main()
