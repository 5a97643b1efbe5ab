"""Read a language model's reply in any form.

It turns the text that a model wrote into the words to say, a feeling and its strength. Servers that
know the schema return one JSON object. Small local models often add reasoning, code fences or a
second object, quote a number, invent a feeling, forget a brace, or answer in plain text. All of
these are understood; only a text without words is not.
"""

import ast
import json
import math
import re
import unicodedata
from dataclasses import dataclass

from miburi.feelings import FEELINGS

#: The longest reply, in characters; a longer text is cut at a sentence's end.
LONGEST_REPLY = 300

#: How many characters are read, and how many braces are tried as the beginning of an object (our
#: choice).
_READ, _TRIES = 8000, 64
#: The strength of a feeling for which the model gives no usable one (our choice).
_USUAL = 0.5
#: Names that models use for the eight feelings; any other name counts as no feeling.
_SYNONYMS = {
    "happiness": "happy joy joyful joyous glad gladness delight delighted content contentment love "
                 "affection gratitude grateful pleased cheerful amused pride proud relief",
    "sadness": "sad sorrow sorrowful grief melancholy lonely loneliness disappointment empathy "
               "disappointed unhappy compassion sympathy",
    "fright": "frightened shock shocked startled startle panic terror",
    "fear": "afraid fearful scared anxiety anxious worry worried nervous concern concerned",
    "thrill": "thrilled excitement excited enthusiasm enthusiastic anticipation eager",
    "disgust": "disgusted revulsion repulsed contempt",
    "anger": "angry mad annoyance annoyed irritation irritated frustration frustrated rage furious",
    "surprise": "surprised astonishment astonished amazement amazed wonder",
}  # fmt: skip
_CALLED = {name: name for name in FEELINGS} | {
    synonym: name for name, synonyms in _SYNONYMS.items() for synonym in synonyms.split()
}
_THOUGHT = re.compile(r"<(think|thinking|reasoning)>.*?(</\1>|$)", re.DOTALL | re.IGNORECASE)
_BROKEN = re.compile(
    r"""["']?reply["']?\s*:\s*(["'])((?:\\.|(?!\1)[^\\]|(?<=\w)'(?=\w))*)""", re.DOTALL
)
_FENCE = re.compile(r"^\s*```\w*|```\s*$", re.MULTILINE)
_SENTENCE_END = re.compile(r"[.!?…。！？](?=\s|$)|[。！？]")
_MARKUP = re.compile(r"[*_`#]{1,3}(?=\S)|(?<=\S)[*_`]{1,3}")


@dataclass(frozen=True)
class Content:
    """The words of a model's reply, and the feeling behind them, if any."""

    text: str
    feeling: str | None
    strength: float


def read_reply(written: str) -> Content | None:
    """Return the content of a model's text; None if it has no words to say.

    >>> read_reply('Sure! {"reply": "Hello.", "feeling": "joy", "strength": "0.5"}')
    Content(text='Hello.', feeling='happiness', strength=0.5)
    >>> read_reply("Hello, Anna.")
    Content(text='Hello, Anna.', feeling=None, strength=0.0)
    """
    written = _FENCE.sub(" ", _THOUGHT.sub(" ", written[-_READ:] if "{" in written else written))
    objects = _objects(written)
    for fields in objects:
        text = tidy(str(fields["reply"]))
        if _has_words(text):
            feeling = _feeling(fields.get("feeling"))
            return Content(text, feeling, _strength(fields.get("strength")) if feeling else 0.0)
    if objects:
        return None
    if broken := _BROKEN.search(written):
        text = tidy(broken.group(2).replace("\\n", " ").replace('\\"', '"'))
    else:
        text = "" if "{" in written or "</" in written else tidy(_MARKUP.sub("", written))
    return Content(text, None, 0.0) if _has_words(text) else None


def tidy(text: str) -> str:
    """Return a text as one line without control characters, cut to ``LONGEST_REPLY``."""
    shown = "".join(" " if unicodedata.category(one)[0] in "CZ" else one for one in text)
    line = " ".join(shown.split())
    if len(line) <= LONGEST_REPLY:
        return line
    ends = [found.end() for found in _SENTENCE_END.finditer(line, 0, LONGEST_REPLY)]
    return line[: ends[-1]] if ends else line[: LONGEST_REPLY - 1].rstrip() + "…"


def _has_words(text: str) -> bool:
    return any(map(str.isalnum, text))


def _objects(written: str) -> list[dict[str, object]]:
    """Return the objects in a text whose ``reply`` is a string, the last one first."""
    found, decoder, start = [], json.JSONDecoder(), len(written)
    for _ in range(_TRIES):
        start = written.rfind("{", 0, start)
        if start < 0:
            break
        try:
            fields = decoder.raw_decode(written, start)[0]
        except (ValueError, RecursionError):
            end = written.find("}", start) + 1
            try:  # single quotes, or a comma too many
                fields = ast.literal_eval(written[start:end])
            except (ValueError, SyntaxError, MemoryError, RecursionError, TypeError):
                continue
        if isinstance(fields, dict) and isinstance(fields.get("reply"), str):
            found.append(fields)
    return found


def _feeling(named: object) -> str | None:
    words = re.findall(r"[a-z]+", named.lower()) if isinstance(named, str) else []
    return next((_CALLED[word] for word in words if word in _CALLED), None)


def _strength(given: object) -> float:
    """Return a strength from 0 to 1; above 1 it is read as out of 10, above 10 as out of 100."""
    try:
        value = float(given) if isinstance(given, int | float | str) else _USUAL
    except (ValueError, OverflowError):
        return _USUAL
    if not math.isfinite(value) or value < 0:
        return _USUAL
    return value if value <= 1 else min(value / (10 if value <= 10 else 100), 1.0)
