"""``miburi words``, ``miburi say`` and ``miburi listen``: parse, call, print."""

import json
import os
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from miburi.cli.live import HERE, PartnerAddress, partner_at
from miburi.cli.options import AsJson
from miburi.errors import InputError

if TYPE_CHECKING:
    from miburi.client.remote import RemotePartner
    from miburi.senses.tone import Tone


def words(
    as_json: Annotated[
        bool,
        typer.Option(
            "--json",
            help="Answer as JSON: distress, worry, feeling (each may be null), strength, why.",
        ),
    ] = False,
) -> None:
    """Say which feeling each line on standard input shows, and which words showed it."""
    if sys.stdin.isatty():
        raise InputError("give sentences on standard input, one per line.")
    from miburi.senses.words import hear

    for line in sys.stdin.buffer:
        heard = hear(line.decode(errors="replace").strip())
        if as_json:
            why = [asdict(part) for part in heard.why]
            answer = {
                "distress": heard.distress,
                "worry": heard.worry,
                "feeling": heard.feeling,
                "strength": round(heard.strength, 4),
                "why": why,
            }
            print(json.dumps(answer, ensure_ascii=False), flush=True)
        else:
            print(heard.reason, flush=True)


def say(
    text: Annotated[str, typer.Argument(help="A sentence in one of the partner's languages.")],
    url: PartnerAddress = HERE,
    as_json: AsJson = False,
) -> None:
    """Say something to a live partner.

    For a partner on another computer it needs MIBURI_TOKEN, and over https also MIBURI_AUTHORITY.
    """
    with partner_at(url) as partner:
        if as_json:
            print(partner.say(text).model_dump_json())
        else:
            _say(partner, text)


def listen(
    file: Annotated[
        Path | None,
        typer.Argument(
            help="A WAV file (16 kHz, 16 bit, mono); default: standard input, raw or WAV."
        ),
    ] = None,
    phrases: Annotated[
        Path | None,
        typer.Option(help="A file of phrases to recognise; default: everyday ones."),
    ] = None,
    url: PartnerAddress = HERE,
) -> None:
    """Recognise spoken phrases and send their words to a running partner, but no sound."""
    from miburi.senses.utterances import frames, utterances, voice_detector

    likely = voice_detector()
    if file is not None:
        _check_sound(file)
    from miburi.senses.recogniser import PhraseRecogniser, load_phrases

    if file is None and sys.stdin.isatty():
        raise InputError(
            "pipe sound into the command, such as: arecord -f S16_LE -r 16000 -c 1 | miburi listen"
        )
    from miburi.senses.tone import ToneOfVoice

    recogniser = PhraseRecogniser(load_phrases(phrases))
    voice = ToneOfVoice()
    sound = os.fdopen(0, "rb", closefd=False) if file is None else file.open("rb")
    with sound, partner_at(url) as partner:
        for utterance in utterances(frames(sound), likely):
            text = recogniser.recognise(utterance)
            print(f"heard: {text or 'nothing that it knows'}", flush=True)
            tone = voice.take(utterance)
            if text is not None:
                _say(partner, text, tone)


def _check_sound(file: Path) -> None:
    if file.is_fifo() or file.suffix in (".raw", ".pcm"):
        return  # a pipe can be read only once
    try:
        with file.open("rb") as sound:
            begins = sound.read(4)
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}.") from error
    if begins != b"RIFF":
        raise InputError(
            f"{file} is not a WAV file; `ffmpeg -i {file} -ar 16000 -ac 1 -c:a pcm_s16le OUT.wav` "
            "makes one from most sound files. Give raw sound on standard input, or as .raw."
        )


def _say(partner: "RemotePartner", text: str, tone: "Tone" = "plain") -> None:
    from miburi.senses import Brought, Impression

    heard = partner.say(text, tone)
    why = tuple(Brought(part.what, part.weight) for part in heard.why)
    topic: Literal["asked"] | None = "asked" if heard.asked else None
    print(Impression(heard.feeling, heard.strength, "speech", why, topic, heard.distress).reason)
    for stimulus in heard.felt:
        print(f"it feels {stimulus.feeling} {stimulus.strength:.2f}")
    if heard.answer:
        print(f"it says: {heard.answer}", flush=True)
