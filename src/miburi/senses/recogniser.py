"""Spoken words: sound in, text out, on this computer alone.

:class:`Recogniser` is the interface. Miburi ships one recogniser, :class:`PhraseRecogniser`:
PocketSphinx with everyday phrases (``spoken-en.toml``, beside this module). A loop of phones
(single speech sounds) listens as well: if it fits a sound clearly better than any phrase does, the
sound is rejected. So an unknown sentence is ignored instead of being taken for a phrase.

This module needs the extra ``ears``; it is loaded only when needed.
"""

import re
from importlib import resources
from pathlib import Path
from typing import Annotated, Protocol, Self

from pydantic import Field, StringConstraints, model_validator

from miburi.errors import InputError, needs_extra
from miburi.ground.tables import Table, load_table

try:
    from pocketsphinx import Decoder, get_model_path
except ModuleNotFoundError as error:
    raise needs_extra("ears", error) from error


#: A phrase is accepted only if its log-likelihood minus the phone loop's, divided by the number of
#: 10 ms frames, is above this. We chose the value with synthetic voices: of 150 phrases, 136 were
#: accepted correctly and 5 wrongly; of 40 other sentences, 1 was accepted.
_CLEAR = -8.0
#: The weight of the order of phones, relative to their sound, in the phone loop (as PocketSphinx
#: advises).
_LOOP_WEIGHT = 2.0
#: The lowest level of message that PocketSphinx logs to the terminal. Lower levels are left out: an
#: utterance without a phrase is normal and not worth a line.
_LOUD = "FATAL"
_SLOT = re.compile(r"\{(\w+)\}")

_Words = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z' ]{0,79}$")]
_Name = Annotated[str, StringConstraints(pattern=r"^[a-z_]{1,20}$")]
_Phrase = Annotated[str, StringConstraints(pattern=r"^[a-z{][a-z'_{} ]{0,79}$")]


class Phrases(Table):
    """The known phrases and their slots; ``spoken-en.toml`` explains them."""

    phrases: Annotated[list[_Phrase], Field(min_length=1, max_length=1000)]
    slots: dict[
        _Name,
        Annotated[
            list[_Words | Annotated[str, StringConstraints(max_length=0)]],
            Field(min_length=1, max_length=200),
        ],
    ] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_slots(self) -> Self:
        for phrase in self.phrases:
            unknown = [name for name in _SLOT.findall(phrase) if name not in self.slots]
            if unknown or "{" in (rest := _SLOT.sub("", phrase)) or "}" in rest:
                raise ValueError(f"{phrase!r} names a slot that is not there; add it to [slots]")
        if wordless := [name for name, words in self.slots.items() if not any(words)]:
            raise ValueError(f"the slot {wordless[0]} has no words; give it some")
        return self

    @property
    def words(self) -> list[str]:
        """All words in the phrases and slots, sorted."""
        texts = [_SLOT.sub(" ", text) for text in self.phrases]
        texts += [text for words in self.slots.values() for text in words]
        return sorted({word for text in texts for word in text.split()})

    @property
    def grammar(self) -> str:
        """The phrases and slots in the JSpeech Grammar Format."""

        def slot(match: re.Match[str]) -> str:
            return f" [<{match[1]}>] " if "" in self.slots[match[1]] else f" <{match[1]}> "

        rules = [
            f"<{name}> = {' | '.join(text for text in words if text)};"
            for name, words in self.slots.items()
        ]
        rules.append(f"public <phrase> = {' | '.join(_SLOT.sub(slot, p) for p in self.phrases)};")
        return "\n".join(["#JSGF V1.0;", "grammar phrases;", *rules, ""])


def load_phrases(path: Path | None = None) -> Phrases:
    """Return the phrases in a file; by default everyday ones.

    Raises
    ------
    DescriptionError
        The file cannot be read or is not a valid phrase file; the message says what is wrong.
    """
    with resources.as_file(resources.files(__package__) / "spoken-en.toml") as shipped:
        return load_table(Phrases, path or shipped)


class Recogniser(Protocol):
    """Turns the sound of an utterance into words."""

    def recognise(self, sound: bytes) -> str | None:
        """Return what was said, or None if that is not clear.

        ``sound`` holds 16-bit samples, 16 kHz, mono, with a short pause before and after the words.
        """


class PhraseRecogniser:
    """A :class:`Recogniser` that knows some phrases, in English.

    Raises
    ------
    InputError
        A word is not in the CMU dictionary.
    """

    def __init__(self, phrases: Phrases) -> None:
        self._phrases = Decoder(lm=None, loglevel=_LOUD)
        unknown = [word for word in phrases.words if self._phrases.lookup_word(word) is None]
        if unknown:
            raise InputError(
                f"not in the CMU dictionary of English: {', '.join(unknown)}. Use words that are "
                "in it."
            )
        self._phrases.add_jsgf_string("phrases", phrases.grammar)
        self._phrases.activate_search("phrases")
        phones = get_model_path("en-us/en-us-phone.lm.bin")
        self._loop = Decoder(lm=None, allphone=phones, lw=_LOOP_WEIGHT, loglevel=_LOUD)

    def recognise(self, sound: bytes) -> str | None:
        """Return the phrase, or None if no known phrase was clearly said."""
        text, score = _decode(self._phrases, sound) if sound else ("", 0.0)
        if not text:
            return None
        clear = (score - _decode(self._loop, sound)[1]) / max(self._phrases.n_frames(), 1)
        return text if clear > _CLEAR else None


def _decode(decoder: Decoder, sound: bytes) -> tuple[str, float]:
    """Return the text that a decoder hears in a sound, and its log-likelihood."""
    decoder.start_utt()
    decoder.process_raw(sound, full_utt=True)
    decoder.end_utt()
    best = decoder.hyp()
    return (best.hypstr, decoder.get_logmath().log(best.score)) if best else ("", 0.0)
