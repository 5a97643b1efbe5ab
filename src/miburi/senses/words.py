"""Words: turn a sentence into an impression, with each word's contribution.

A sentence is judged by lists and a model. If the words of a list occur in the sentence, the list
decides, or that part of the sentence is removed; otherwise the model decides. Model and lists are:

- for English, a linear model of the eight feelings and "no feeling" (``words.npz``, trained by
  ``tools/train_words.py``): a weight for each word, each pair of words, each group of letters and
  each word's meaning (a word vector, folded into nine numbers);
- distress: what people say when they need help now (:mod:`miburi.senses.distress`);
- sentences about somebody else's feelings or about past feelings, which are left out (a language's
  ``elsewhere``);
- questions about the partner's own feelings, which do not show the speaker's (``asked.toml``);
- what people shout when startled or as a warning (``alarms.toml``), which no data set covers;
- word stems for Japanese (``stems-ja.toml``), for which there is no model.

Smileys (``smileys.toml``) count alongside the model and the stems.

The strength is the model's probability, calibrated on sentences that it was not trained on.
A likelihood below ``SILENT`` shows no feeling: the sentence says too little about feelings.
"""

from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import Any
from unicodedata import category

import numpy as np
from numpy.typing import NDArray

from miburi.languages import (
    FALLBACK,
    Language,
    common_words,
    known_share,
    language_of,
    own_letters,
    plain,
    words_of,
)
from miburi.languages.abroad import calls_for_help, is_foreign_order
from miburi.senses.distress import Doubt, judge_distress
from miburi.senses.impression import Brought, Impression
from miburi.senses.linear import find, softmax
from miburi.senses.phrases import (
    alarm_in,
    cut_elsewhere,
    cut_questions,
    cut_smileys,
    smiley_weight,
    smileys_alone,
    stems_in,
)
from miburi.senses.text import letters, numbers_of, tokens

#: The columns of the model: the paper's eight feelings in the paper's order, and "no feeling".
LABELS = (
    "happiness", "sadness", "fright", "fear", "thrill", "disgust", "anger", "surprise", "neutral",
)  # fmt: skip
#: Below this probability a sentence shows nothing.
SILENT = 0.4
#: This many characters of a text are read; more would add nothing.
LONGEST = 1000

_NEUTRAL = LABELS.index("neutral")
_GLAD = [LABELS.index(name) for name in ("happiness", "thrill")]
_SAD = LABELS.index("sadness")

# Negation: after one of these words, the evidence of the clearest of the next few words is removed.
_DENIALS = frozenset({"not", "never", "no", "nor", "nobody", "hardly"})
_NO_DENIAL = frozenset(
    {"only", "just", "wait", "so", "been", "forget", "idea", "way", "wonder", "expect", "believe"}
)
_TURNS = frozenset({"but", ",", ".", "!", "?", ";", "just"})
_WINDOW = 4
_CLEAR = 2.0  # evidence for a feeling over none, in log-odds
_TAKEN_BACK = 1.6

_TOLD = 4  # the most words that are named as the reason
_TELLING = 0.25  # the least evidence of a word that is named, as a share of the strongest word's

#: English is unknown if less than the first share of its letters is in words that the model has
#: learnt, and less than the second in words whose meaning it has (our choice). Of 61 remarks in
#: five other languages 51 are; of 64,000 by strangers in English 55 are, and many of those are not
#: in English.
_LEARNT, _MEANT = 0.38, 0.6

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WordTable:
    """The weights of k sorted keys.

    ``weights``, (k, 9), are int8 and share one ``scale``. ``idf``, (k,), is each key's inverse
    document frequency, in 1/16.
    """

    keys: NDArray[np.uint32]
    weights: NDArray[np.int8]
    scale: float
    idf: NDArray[np.uint8]

    def look_up(self, numbers: list[int]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the indices of the numbers that are known, and their places in the table."""
        return find(self.keys, np.array(numbers, dtype=np.uint32))

    def row(self, place: NDArray[np.intp]) -> Array:
        """Return the weights, (…, 9), at some places; they are stored as signed square roots."""
        root = self.weights[place] / 127.0
        return root * np.abs(root) * self.scale

    def evidence(self, numbers: list[int]) -> tuple[NDArray[np.intp], Array]:
        """Return the indices of the ids that are known, and the contribution of each, (known, 9).

        The weighting is TF-IDF with sublinear counts, normalised for the sentence's length.
        """
        known, place = self.look_up(numbers)
        distinct, back, count = np.unique(place, return_inverse=True, return_counts=True)
        size = (1 + np.log(count)) * self.idf[distinct] / 16.0
        length = np.sqrt(size @ size) if len(size) else 1.0
        return known, (size / count / length)[back, None] * self.row(place)


@dataclass(frozen=True)
class Model:
    """The linear model: three tables and nine biases."""

    words: WordTable
    letters: WordTable
    meanings: WordTable
    bias: Array

    def evidence(self, words: list[str]) -> Array:
        """Return the contribution of each word to each label, (words, 9) in log-odds."""
        brought = np.zeros((len(words), len(LABELS)))
        numbers = numbers_of(words)
        known, each = self.words.evidence(numbers)
        single = known < len(words)
        np.add.at(brought, known[single], each[single])
        for word in (0, 1):  # each word gets half of a pair's evidence
            np.add.at(brought, known[~single] - len(words) + word, each[~single] / 2)
        groups = [letters(word) for word in words]
        owner = np.repeat(np.arange(len(words)), [len(group) for group in groups])
        known, each = self.letters.evidence([number for group in groups for number in group])
        np.add.at(brought, owner[known], each)
        known, place = self.meanings.look_up(numbers[: len(words)])
        brought[known] += self.meanings.row(place) / max(len(known), 1)
        return brought

    def probabilities(self, evidence: Array) -> Array:
        """Return the likelihood of each label, (9,)."""
        return softmax(self.bias + evidence.sum(axis=0))


_UNKNOWN = Impression(None, 0.0, "speech", topic="unknown")


@cache
def load_model() -> Model:
    """Return the model that ships with Miburi; it is read when the first sentence is heard."""
    with (resources.files(__package__) / "words.npz").open("rb") as file:
        stored: dict[str, Any] = dict(np.load(file))
    tables = [
        WordTable(
            stored[f"{name}_keys"],
            stored[f"{name}_weights"],
            float(stored[f"{name}_scale"]),
            stored[f"{name}_idf"],
        )
        for name in ("words", "letters", "meanings")
    ]
    return Model(tables[0], tables[1], tables[2], stored["bias"])


def hear(text: str, usual: Language = FALLBACK) -> Impression:
    """Return the impression that somebody's words make.

    Only the first ``LONGEST`` characters of ``text`` count. ``usual`` is the language that is
    assumed for a text that could be in any language.
    """
    text = text[:LONGEST].encode(errors="ignore").decode()  # drop lone surrogates
    # In English, the words of a foreign order may mean something else ("Finger weg").
    stops = language_of(text, usual) == FALLBACK and is_foreign_order(text)
    distress = None if stops else judge_distress(text, usual)
    if distress is None:
        felt = _UNKNOWN if stops else _felt(text, usual)
        call = calls_for_help(text, unknown=felt.topic == "unknown")
        return felt if call is None else _called(sure=call == "surely")
    if distress.doubt is Doubt.SLIGHT_SIGN:
        return replace(_felt(text, usual), hint=distress.kind)
    if distress.doubt is Doubt.WORTH_A_QUESTION:
        return Impression(None, 0.0, "speech", worry=distress.kind)
    why = (Brought(distress.words, 0.0),) if distress.words else ()
    return Impression(None, 0.0, "speech", why, distress=distress.kind)


def _called(*, sure: bool) -> Impression:
    return Impression(
        None, 0.0, "speech", distress="help" if sure else None, worry=None if sure else "help"
    )


def _felt(text: str, usual: Language) -> Impression:
    language = language_of(text, usual)
    if is_unknown(text, language):
        return smileys_alone(text) or _UNKNOWN
    rest = cut_questions(text, language)
    if rest is None:
        return _shown(text, language)
    beside = _shown(rest, language)
    return beside if beside.feeling else replace(beside, topic="asked")


def is_unknown(text: str, language: Language) -> bool:
    """Return whether a text is probably in no language that the partner knows.

    ``language`` is the one that :func:`miburi.languages.language_of` supposes. English has the
    model's words besides those of its files; in other languages, two words without a known one
    are unknown.

    >>> is_unknown("Guten Morgen", "en"), is_unknown("Spiders terrify me", "en")
    (True, False)
    """
    words, known = plain(text, language).split(), words_of(language)
    if language != FALLBACK:
        some = own_letters(text, language) or known_share(words, known)
        return len(text.split()) > 1 and not some
    model, numbers = load_model(), numbers_of(words)[: len(words)]
    shares = []
    for table in (model.words, model.meanings):
        places, _ = table.look_up(numbers)
        shares.append(known_share(words, known.union(words[place] for place in places)))
    return bool(words) and shares[0] < _LEARNT and shares[1] < _MEANT


def _shown(text: str, language: Language) -> Impression:
    if language == "ja":
        return stems_in(text)
    listed = smileys_alone(text)
    if language != "en":  # the model does not know its words
        return listed or Impression(None, 0.0, "speech")
    listed = listed or alarm_in(text)
    if listed is not None:
        return listed
    words, evidence, likely = judge(cut_elsewhere(text, language))
    best = int(np.argmax(likely[:_NEUTRAL]))
    strength = float(likely[best])
    spoken = strength >= SILENT and strength > likely[_NEUTRAL]
    return Impression(
        LABELS[best] if spoken else None,
        strength if spoken else 0.0,
        "speech",
        _name_reasons(words, evidence[:, best] - evidence[:, _NEUTRAL]) if spoken else (),
    )


def judge(text: str) -> tuple[list[str], Array, Array]:
    """Return a text's n words, signs and smileys, their contributions and the likelihoods.

    The contributions, (n, 9), and the likelihoods, (9,), are in the order of ``LABELS``.

    The evidence of denied words is removed. Speech recognisers, and people who type in haste, leave
    out punctuation, so its absence is no evidence: a sentence without punctuation is read twice, as
    it is and with "!" after it, and the mean of both is used.
    """
    model = load_model()
    text, smileys = cut_smileys(text)
    words = tokens(text)
    drawn = np.zeros((len(smileys), len(LABELS)))
    for row, feeling in zip(drawn, smileys.values(), strict=True):
        row[LABELS.index(feeling)] = smiley_weight()
    signed = any(not word[0].isalnum() for word in words)
    readings = [words] if signed or not words else [words, [*words, "!"]]
    each = [deny(reading, model.evidence(reading)) for reading in readings]
    likely = np.mean([model.probabilities(np.concatenate([one, drawn])) for one in each], axis=0)
    evidence = np.concatenate([np.mean([one[: len(words)] for one in each], axis=0), drawn])
    return [*words, *smileys], evidence, likely


def deny(words: list[str], evidence: Array) -> Array:
    """Remove the evidence of denied words: "I am not happy" is no sign of happiness.

    The negation itself counts half, because quarrels are full of negations. The next words are
    searched up to a punctuation mark, a "but" or a "just". The clearest of them, if it is clear
    enough, loses 1.6 times its evidence. Half of the loss is added to ``neutral`` and, if the
    denied feeling was a glad one, the other half to sadness.
    """
    evidence = evidence.copy()
    for place, word in enumerate(words):
        if word not in _DENIALS:
            continue
        evidence[place] -= np.maximum(evidence[place] - evidence[place, _NEUTRAL], 0) / 2
        if _NO_DENIAL.intersection(words[place + 1 : place + 2]):
            continue
        end = place + 1
        while end < min(place + 1 + _WINDOW, len(words)) and words[end] not in _TURNS:
            end += 1
        over = evidence[place + 1 : end, :_NEUTRAL] - evidence[place + 1 : end, _NEUTRAL:]
        if over.size and over.max() > _CLEAR:
            ahead, feeling = np.unravel_index(int(over.argmax()), over.shape)
            denied, back = place + 1 + int(ahead), _TAKEN_BACK * over.max()
            evidence[denied, feeling] -= back
            evidence[denied, _NEUTRAL] += back / 2
            if feeling in _GLAD:
                evidence[denied, _SAD] += back / 2
    return evidence


def _name_reasons(words: list[str], brought: Array) -> tuple[Brought, ...]:
    """Return the words and smileys with the most evidence for a feeling, each once."""
    most: dict[str, float] = {}
    for word, weight in zip(words, brought.tolist(), strict=True):
        if len(word) > 1 or word in "!?" or category(word)[0] != "P":  # commas are not evidence
            most[word] = most.get(word, 0.0) + weight
    # Common words explain nothing to a reader, so they are named only if there are no other words.
    clear = {word: weight for word, weight in most.items() if word not in common_words("en")}
    ordered = sorted((clear or most).items(), key=lambda item: -item[1])[:_TOLD]
    return tuple(
        Brought(word, round(weight, 2))
        for word, weight in ordered
        if weight > max(0.0, _TELLING * ordered[0][1])
    )
