"""When a partner asks about distress, and for how long it returns to that.

:class:`Comfort` weighs what was heard in each remark, and answers those that have to do with
distress; :mod:`miburi.talk.care` has the sentences.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from typing import TypeGuard

from miburi.languages import Language
from miburi.senses import Impression
from miburi.senses.kinds import Distress
from miburi.talk.answers import is_needless
from miburi.talk.care import Care, agrees, denies, takes_back
from miburi.talk.cue import Match
from miburi.talk.script import script

#: How long a "yes" or "no" still answers the question whether somebody needs help, or is all right
#: (our choice).
_ANSWERED = timedelta(minutes=2)
#: After explicit distress, the first three answers mention it again, and then every fifth answer.
#: If only the model heard it, just the first answer mentions it, and none once somebody has made a
#: request (our choice). In everyday conversations by strangers, such a false alarm comes once in
#: about 250 remarks.
_STAYS, _EVERY = 3, 5
#: The partner asks about a slight sign of distress if there was another at most this many remarks
#: earlier (our choice).
_SOON = 5

#: Kinds of distress that people deny even when they are true, and how long a denial is ignored
#: (our choice).
_HIDDEN, _LONG = frozenset({"suicide", "abuse"}), timedelta(minutes=10)

_Question = tuple[Distress, datetime]  # what it was about, and when it was asked


class Comfort:
    """Answers remarks that have to do with distress.

    Parameters
    ----------
    care
        The sentences.
    clock
        Returns the local time.
    """

    def __init__(self, care: Care, clock: Callable[[], datetime]) -> None:
        self._care, self._clock = care, clock
        self._turns: Counter[str] = Counter()  # of help and questions, by kind
        self._since = 0  # remarks since words of distress, except orders and unrelated questions
        self._hidden: datetime | None = None  # when there was last a sign of suicide or abuse
        self._plain = False  # whether the latest words of distress were plain
        self._over = False  # whether somebody has wanted something else, after words that were not
        self._asked: _Question | None = None  # whether somebody needs help
        self._before: _Question | None = None  # the same, as it was before this remark
        self._wondered: _Question | None = None  # whether somebody is all right
        self._signs = _SOON  # remarks since the latest sign of distress

    def confirm(self, heard: Impression, said: str, language: Language) -> Impression:
        """Return what was heard; a "yes" to the question about distress counts as distress."""
        self._before, self._asked = self._asked, None
        if self._is_open(self._before) and agrees(said, language):
            return Impression(None, 0.0, "speech", distress=self._before[0])
        return heard

    def weigh(
        self, heard: Impression, said: str, language: Language, wanted: list[Match], *, after: bool
    ) -> Impression:
        """Return what was heard, with a suspicion of distress only if that is worth a question.

        A second slight sign is worth a question, and so is a "no" to the question whether somebody
        is all right. If distress was heard before (``after``), it is known that they need help.
        """
        wondered, self._wondered = self._wondered, None
        if not _HIDDEN.isdisjoint((heard.distress, heard.worry, heard.hint)):
            self._hidden = self._clock()
        sign = heard.worry or heard.hint
        self._signs += 1
        if sign is not None and ((after and sign == "help") or is_needless(sign, wanted)):
            heard = replace(heard, worry=None, hint=None)
        elif sign is not None:
            before, self._signs = self._signs, 0
            if heard.hint is not None and before <= _SOON:
                heard = Impression(None, 0.0, "speech", worry=heard.hint)
        if heard.distress is None and self._is_open(wondered) and denies(said, language):
            heard = Impression(None, 0.0, "speech", worry=wondered[0])
        return heard

    def answer(
        self, heard: Impression, said: str, language: Language, wanted: list[Match], *, after: bool
    ) -> str | None:
        """Return the answer to words of distress, or to a remark ``after`` them.

        None: the remark has nothing to do with distress, or has a better answer.
        """
        if heard.worry is not None:
            self._asked = heard.worry, self._clock()
            return self._care.ask(heard.worry, language, self._turn(f"ask {heard.worry}"))
        if heard.distress is not None:
            self._since, self._over = 0, False
            self._plain = bool(heard.why) or self._is_open(self._before)
            return self._care.help(heard.distress, language, self._turn(heard.distress))
        if after and not self._over and not self._hides() and takes_back(said, language):
            self._over = True
            return self._care.give_way(language, self._turn("misheard"))
        if after and self._stays(said, language, wanted):
            return self._care.stay(language, self._turn(""))
        return None

    def wonder(self, hint: Distress, language: Language) -> str:
        """Return the question whether somebody is all right, after a slight sign of distress."""
        self._wondered = hint, self._clock()
        return self._care.wonder(language, self._turn("wonder"))

    def keep_open(self) -> None:
        """Let the question that was open before this remark stay open."""
        self._asked = self._before

    def _turn(self, name: str) -> int:
        self._turns[name] += 1
        return self._turns[name] - 1

    def _is_open(self, asked: _Question | None) -> TypeGuard[_Question]:
        """Return whether a question was asked so recently that this can be the reply."""
        return asked is not None and self._clock() - asked[1] < _ANSWERED

    def _hides(self) -> bool:
        """Return whether somebody may be denying what is true."""
        return self._hidden is not None and self._clock() - self._hidden < _LONG

    def _stays(self, said: str, language: Language, wanted: list[Match]) -> bool:
        """Return whether the partner's answer still mentions distress that was heard earlier."""
        words = script(language)
        known = any(not (match.cue.broad or match.cue.aside) for match in wanted)
        asks = words.asks(said)
        stays, people = self._since < _STAYS, words.fits("people", said)
        other = asks and ((known and not stays) or (not people and (known or not stays)))
        acts = any(match.cue.acts for match in wanted)
        # Whoever asks "Do you know any jokes?" was misheard, or the distress is over.
        fun = not stays and any(match.cue.light and match.cue.stays for match in wanted)
        self._over = self._over or fun or (not self._plain and (known or acts))
        if self._over or other or acts:
            return False
        self._since += 1
        if not self._plain:
            return self._since == 1
        return asks or self._since <= _STAYS or self._since % _EVERY == 0
