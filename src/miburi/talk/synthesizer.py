"""A voice on the partner's own computer: it turns a sentence into sound.

A synthesizer runs as a separate process: it does not delay the partner, it is killed if it takes
too long, and its licence does not extend to Miburi.
"""

import asyncio
import os
import re
import shutil
import tempfile
import unicodedata
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from miburi.errors import InputError
from miburi.feelings.catalogue import Voice
from miburi.languages.rhythm import Rhythm, rhythm_of_sound

#: The languages of flite.
LANGUAGES = ("en",)
#: Pattern of flite's names of vowels, and its name of silence.
_VOWEL = re.compile(r"a[aehowxy]|axr|e[hry]|i[hy]|o[wy]|u[hw]")
_SILENCE = "pau"
#: The voice of flite; its pitch, in Hz, which a feeling raises or lowers; and the lowest pitch, in
#: Hz (our choice).
_VOICE, _PITCH, _LOWEST = "slt", 172.0, 60.0
_PHONE = re.compile(r"([a-z]+):(\d+\.\d+)")
#: Plain characters for typographic ones, which flite cannot read.
_PLAIN = str.maketrans({"‘": "'", "’": "'", "“": '"', "”": '"', "–": ",", "—": ",", "…": "..."})


@dataclass(frozen=True)
class Sound:
    """A sentence as sound.

    Attributes
    ----------
    wave
        A WAV file.
    rhythm
        The times of its prominent syllables.
    """

    wave: bytes
    rhythm: Rhythm


@dataclass(frozen=True)
class Synthesizer:
    """flite, Carnegie Mellon's small synthesizer.

    Attributes
    ----------
    program
        The path of its executable.
    patience
        The longest time that a sentence may take to compute, in s (our choice); 25 s of speech take
        0.5 s.
    """

    program: str
    patience: float = 5.0

    async def sound(self, text: str, voice: Voice) -> Sound | None:
        """Return the sound of an English sentence; None if it took too long, or has no words."""
        words = unicodedata.normalize("NFKD", text.translate(_PLAIN))
        words = words.encode("ascii", "ignore").decode()
        if not any(letter.isalnum() for letter in words):
            return None
        with tempfile.TemporaryDirectory() as folder:
            said, heard = Path(folder) / "said.txt", Path(folder) / "heard.wav"
            said.write_text(words, encoding="ascii")  # others could read a command line
            process = await asyncio.create_subprocess_exec(
                self.program,
                "-voice", _VOICE,
                "--setf", f"duration_stretch={1 / voice.rate:.3f}",
                "--setf", f"int_f0_target_mean={max(_LOWEST, _PITCH * voice.pitch):.1f}",
                "-psdur", "-f", str(said), "-o", str(heard),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.DEVNULL,
            )  # fmt: skip
            try:
                with suppress(
                    OSError, AttributeError
                ):  # it has ended already, or the system is not Unix
                    os.setpriority(os.PRIO_PROCESS, process.pid, 0)  # no priority over others
                async with asyncio.timeout(self.patience):
                    phones, _ = await process.communicate()
                if process.returncode:
                    return None
                return Sound(heard.read_bytes(), _rhythm(words, phones.decode(errors="replace")))
            except (TimeoutError, OSError):
                return None
            finally:
                with suppress(ProcessLookupError):
                    process.kill()
                # When the server ends, this task is cancelled twice. So after a cancellation, it
                # waits again for the killed process, which ends soon.
                while process.returncode is None:
                    with suppress(asyncio.CancelledError):
                        await process.wait()


def _rhythm(words: str, phones: str) -> Rhythm:
    """Return the rhythm of a sound from its phones: a name and its end in s, as ``ay:0.392``.

    flite prints one line per sentence, with times since that sentence's start.
    """
    vowels: list[list[float]] = []
    at = 0.0
    for line in phones.splitlines():
        begin, silent = 0.0, True
        for name, end in _PHONE.findall(line):
            vowel = _VOWEL.fullmatch(name) is not None
            if vowel and silent:
                vowels.append([])
            if vowel:
                vowels[-1].append(at + (begin + float(end)) / 2)
            begin, silent = float(end), name == _SILENCE or (silent and not vowel)
        at += begin
    return rhythm_of_sound(words, LANGUAGES[0], vowels, at)


def find_synthesizer(name: str) -> Synthesizer:
    """Return the synthesizer of the given name.

    Raises InputError if there is no such synthesizer, or it is not installed.
    """
    if name != "flite":
        raise InputError(f"--voice must be flite, got {name!r}.")
    program = shutil.which(name)
    if program is None:
        raise InputError("--voice needs flite, which is not installed: sudo apt install flite.")
    return Synthesizer(program)
