"""What startles it, on sounds that were not recorded by us, at levels from -40 to 0 dBFS.

    apt install lmms-common sonic-pi-samples hydrogen-data sound-theme-freedesktop alsa-utils \\
        sox libsox-fmt-all flite espeak-ng nodejs
    python bench/startle.py > bench/startle.txt

Sources, all from Debian: claps and snaps of lmms-common (GPL-2+), hydrogen-data (GPL-2+) and
sonic-pi-samples (CC0); sentences by flite's voices (BSD), espeak-ng (GPL-3+) and the speaker of
alsa-utils (GPL-2+); loops and music of sonic-pi-samples and lmms-common; signals of
sound-theme-freedesktop (GPL, CC-BY-SA). Levels: the peak of a clap, the RMS of what is spoken (of
its louder half) and of music, in dB over full scale. Each sound lies in a room's noise at
-65 dBFS, dry and with sox's reverb, after 3 s of that noise, with and without 0.3 s of zeros before
it; claps also after two seconds of talk at -30. ``static/startle.js`` listens, in node.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "bench")]

from words import share  # noqa: E402  (below the folder that holds it)

RATE = 48_000
REVERB = ("reverb", "40")
SHARE = Path("/usr/share")
CLAPS = [
    *sorted((SHARE / "lmms/samples/drums").glob("clap*.ogg")),
    SHARE / "hydrogen/data/drumkits/GMRockKit/HandClap.wav",
    SHARE / "hydrogen/data/drumkits/TR808EmulationKit/808_Clap.flac",
    SHARE / "sonic-pi/samples/perc_snap.flac",
    SHARE / "sonic-pi/samples/perc_snap2.flac",
]
SENTENCES = (
    "Good morning, how did you sleep?", "I put the kettle on and then the telephone rang.",
    "Take two of these with water.", "Could you please open the window a bit?",
    "Ten past twelve, and still no post.", "The cat sat on my newspaper again.",
    "Yes, that is what I thought.", "Peter and Kate are coming to tea on Sunday.",
    "It costs a pound and twenty pence.", "Stop at the corner and turn left.",
)  # fmt: skip
VOICES = ("slt", "rms", "awb", "kal", "espeak-ng")
SPOKEN = sorted((SHARE / "sounds/alsa").glob("*_*.wav"))
MUSIC = [
    *sorted((SHARE / "sonic-pi/samples").glob("loop_*.flac")),
    *sorted((SHARE / "sonic-pi/samples").glob("ambi_*.flac")),
]
SIGNALS = sorted((SHARE / "sounds/freedesktop/stereo").glob("*.oga"))


def sound(path: Path, *effects: str) -> np.ndarray:
    """Return a file as mono at RATE, through sox's effects."""
    command = ["sox", str(path), "-t", "f32", "-r", str(RATE), "-c", "1", "-", *effects]
    done = subprocess.run(command, capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.float32).astype(np.float64)


def spoken(text: str, voice: str, folder: Path) -> Path:
    """Return a file of a sentence."""
    path = folder / f"{voice}-{abs(hash(text))}.wav"
    if voice == "espeak-ng":
        subprocess.run(["espeak-ng", "-w", str(path), text], check=True)
    else:
        subprocess.run(["flite", "-voice", voice, "-t", text, "-o", str(path)], check=True)
    return path


def level(part: np.ndarray) -> float:
    """Return the RMS of the louder half of a sound's 20 ms frames, dB."""
    frames = part[: len(part) // 960 * 960].reshape(-1, 960)
    power = np.sort((frames**2).mean(axis=1))[len(frames) // 2 :]
    return float(10 * np.log10(power.mean() + 1e-12))


def heard(cases: list[np.ndarray]) -> list[list[float]]:
    """Return the startles in each sound, 0.5 to 1."""
    with tempfile.TemporaryDirectory() as folder:
        for n, case in enumerate(cases):
            np.clip(case, -1, 1).astype(np.float32).tofile(Path(folder) / f"{n}.f32")
        program = f"""
import {{ readFileSync }} from "node:fs";
import {{ Startle }} from "{ROOT}/src/miburi/studio/static/startle.js";
const out = [];
for (let n = 0; n < {len(cases)}; n++) {{
  const bytes = readFileSync("{folder}/" + n + ".f32");
  const all = new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
  const ear = new Startle({RATE}), found = [];
  for (let at = 0; at < all.length; at += 128) {{
    const strength = ear.take(all.subarray(at, at + 128));
    if (strength) found.push(strength);
  }}
  out.push(found);
}}
console.log(JSON.stringify(out));
"""
        file = Path(folder) / "run.mjs"
        file.write_text(program)
        done = subprocess.run(["node", str(file)], capture_output=True, check=True, text=True)
    return list(json.loads(done.stdout))


def placed(
    part: np.ndarray, rng: np.random.Generator, *, zeros: bool, before: np.ndarray | None = None
) -> np.ndarray:
    """Lay a sound into a room's noise, 3 s after its beginning."""
    whole = np.concatenate([np.zeros(3 * RATE), part, np.zeros(RATE)])
    if before is not None:
        whole[RATE : RATE + len(before)][: 2 * RATE] += before[: 2 * RATE]
    whole += rng.normal(size=len(whole)) * 10 ** (-65 / 20)
    return np.concatenate([np.zeros(round(0.3 * RATE)), whole]) if zeros else whole


def count(parts: list[np.ndarray], loudness: float, rng: np.random.Generator, *ways: bool) -> int:
    """Return how many sounds startle it at an RMS, with or without zeros before them."""
    cases = [
        placed(part * 10 ** ((loudness - level(part)) / 20), rng, zeros=zeros)
        for part in parts
        for zeros in ways
    ]
    return sum(len(one) > 0 for one in heard(cases))


def count_claps(peak: float, rng: np.random.Generator, talk: np.ndarray) -> tuple[int, int]:
    """Return how many claps startle it at a peak, and of how many."""
    cases = []
    for path in CLAPS:
        for effects in ((), REVERB):
            part = sound(path, *effects)[: 2 * RATE]
            part *= 10 ** (peak / 20) / np.abs(part).max()
            for zeros in (False, True):
                cases += [placed(part, rng, zeros=zeros, before=one) for one in (None, talk)]
    return sum(len(one) > 0 for one in heard(cases)), len(cases)


def table(title: str, rows: dict[float, tuple[int, int]]) -> None:
    """Print a table, and its sum."""
    print(f"## {title}: how many startle it\n")
    for loudness, (found, n) in rows.items():
        print(f"{loudness:4.0f} dBFS: {share(found, n)}")
    print(f"all: {share(*np.sum(list(rows.values()), axis=0).tolist())}\n")


def main() -> None:
    """Measure and print."""
    rng = np.random.default_rng(11)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = [spoken(text, voice, folder) for text in SENTENCES for voice in VOICES]
        talk = sound(files[0])
        talk *= 10 ** ((-30 - level(talk)) / 20)
        table("claps", {peak: count_claps(peak, rng, talk) for peak in (-18, -12, -6, 0)})
        said = [sound(path, *way) for path in (*files, *SPOKEN) for way in ((), REVERB)]
        n = 2 * len(said)
        levels = (-40, -32, -26, -20, -17)
        table("sentences", {at: (count(said, at, rng, False, True), n) for at in levels})
        music = [sound(path)[: 10 * RATE] for path in MUSIC]
        levels = (-40, -30, -20)
        table("music", {at: (count(music, at, rng, False), len(music)) for at in levels})
        signals = [sound(path) for path in SIGNALS]
        table("a computer's signals", {-30: (count(signals, -30, rng, False), len(signals))})


if __name__ == "__main__":
    main()
