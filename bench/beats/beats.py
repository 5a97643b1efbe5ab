"""How well beats meet the speech: hands that are farthest on a syllable that stands out.

Forty sentences in sentences.txt have their prominent syllables in capitals; a stranger wrote and
marked them, who had not seen Miburi. flite says when each vowel is heard. Beats are those of a
partner with a simulated body, once by the sound (`miburi run --voice flite`) and once by the
letters alone. Chance is the same beats beside the other sentences.

    python bench/beats/beats.py [SENTENCES]
"""

import asyncio
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from miburi.bodies.simulated import Simulated
from miburi.feelings import EmotionalModel
from miburi.feelings.catalogue import Voice
from miburi.languages.rhythm import rhythm_of
from miburi.partner import Partner
from miburi.robot import forward, iphonoid
from miburi.talk.synthesizer import find_synthesizer

#: s of the body's loop, and s between a hand at its farthest and a syllable's vowel that still fit.
STEP, NEAR = 0.02, 0.12
#: m that a hand must go for a beat, and s for which nothing beside it is farther.
FAR, ALONE = 0.006, 0.24
VOWEL = re.compile(r"\b(?:a[aeowxy]|axr|e[hry]|i[hy]|o[wy]|u[hw]):")
SHUFFLES = 200


@dataclass(frozen=True)
class Sentence:
    """A text, the middles of the vowels that the stranger marked, s, and its length, s."""

    text: str
    prominent: np.ndarray
    seconds: float


def vowels_of(text: str) -> tuple[list[list[tuple[float, float]]], float]:
    """Return the vowels of each of flite's sentences, (begin, end) s, and the end of all."""
    with tempfile.NamedTemporaryFile("w", encoding="ascii", suffix=".txt") as file:
        file.write(text)
        file.flush()
        options = ["-voice", "slt", "-psdur", "-f", file.name, "-o", "none"]
        said = subprocess.run(["flite", *options], capture_output=True, text=True, check=True)
    sentences, at = [], 0.0
    for line in said.stdout.splitlines():
        begin, vowels = 0.0, []
        for phone in line.split():
            end = float(phone.split(":")[1])
            if VOWEL.match(phone):
                vowels.append((at + begin, at + end))
            begin = end
        sentences.append(vowels)
        at += begin
    return sentences, at


def read(marked: str) -> Sentence | None:
    """Return a sentence with its marks; None where flite says other words than are written."""
    sentences, seconds = vowels_of(marked.lower())
    vowels = [sum(one) / 2 for sentence in sentences for one in sentence]
    words = re.findall(r"[A-Za-z']+", marked)
    alone, _ = vowels_of("".join(f"{word.lower()}.\n\n" for word in [*words, "end"]))
    counts = [len(sentence) for sentence in alone][: len(words)]
    if sum(counts) != len(vowels):
        return None
    prominent, first = [], 0
    for word, count in zip(words, counts, strict=True):
        for mark in re.finditer(r"[A-Z]+", word):
            before = len(re.findall(r"[aeiouy]+", word[: mark.start()].lower()))
            prominent.append(vowels[first + min(before, count - 1)])
        first += count
    return Sentence(marked.lower(), np.array(prominent), seconds)


def beats(strokes: tuple[float, ...], seconds: float, seed: int) -> list[float]:
    """Return when a hand is farthest, s from the beginning of the sentence."""
    robot = iphonoid()
    partner = Partner(Simulated(robot), EmotionalModel(), life=seed)
    rest = forward(robot, robot.neutral)[:6].reshape(2, 3)
    for _ in range(100):
        partner.step(STEP)
    began = partner.body.state.time
    partner.gesticulate(strokes)
    times, far = [], []
    for _ in range(round((seconds + 1) / STEP)):
        partner.step(STEP)
        hands = forward(robot, partner.body.state.angles)[:6].reshape(2, 3)
        far.append(np.linalg.norm(hands - rest, axis=1).max())
        times.append(partner.body.state.time - began)
    beside = round(ALONE / STEP)
    tops = [
        time
        for k, time in enumerate(times)
        if far[k] > FAR and far[k] >= max(far[max(0, k - beside) : k + beside + 1])
    ]
    return [time for k, time in enumerate(tops) if k == 0 or time > tops[k - 1] + ALONE]


def near(tops: list[float], sentence: Sentence) -> list[bool]:
    return [bool(np.abs(sentence.prominent - top).min() <= NEAR) for top in tops]


def main() -> None:
    path = Path(sys.argv[1] if sys.argv[1:] else Path(__file__).with_name("sentences.txt"))
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    sentences = [read for read in map(read, lines) if read is not None]
    flite = replace(find_synthesizer("flite"), patience=60)
    print(f"{len(sentences)} of {len(lines)} sentences; a beat within {NEAR} s of a marked vowel:")
    for name in ("by the sound", "by the letters"):
        tops = []
        for seed, sentence in enumerate(sentences):
            if name == "by the sound":
                sound = asyncio.run(flite.sound(sentence.text, Voice(pitch=1.0)))
                assert sound is not None
                rhythm = sound.rhythm
            else:
                rhythm = rhythm_of(sentence.text, "en")
            tops.append(beats(rhythm.prominent, sentence.seconds, seed))
        hits = [hit for top, one in zip(tops, sentences, strict=True) for hit in near(top, one)]
        pauses = np.concatenate([np.diff(top) for top in tops])
        chance, rng = [], np.random.default_rng(1)
        for _ in range(SHUFFLES):
            others = rng.permutation(len(sentences))
            pairs = [(tops[k], sentences[other]) for k, other in enumerate(others)]
            heard = [([t for t in top if t <= one.seconds], one) for top, one in pairs]
            met = [hit for top, one in heard for hit in near(top, one)]
            chance.append(np.mean(met))
        share, usual, spread = np.mean(hits), np.mean(chance), np.std(chance)
        print(
            f"{name:15s} {sum(hits)} of {len(hits)} ({100 * share:.0f} %); by chance "
            f"{100 * usual:.0f} ± {100 * spread:.1f} % ({(share - usual) / spread:.1f} SD); "
            f"{len(hits) / len(sentences):.1f} beats a sentence, {pauses.mean():.2f} s apart, CV "
            f"{pauses.std() / pauses.mean():.2f}"
        )


if __name__ == "__main__":
    main()
