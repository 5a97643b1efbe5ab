"""When a partner asks about distress, and for how long its answers come back to it."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from typing import TypeGuard

from miburi.languages import Language
from miburi.languages.abroad import says_yes
from miburi.senses import Impression
from miburi.senses.kinds import Distress
from miburi.talk.answers import is_needless
from miburi.talk.care import Care, agrees, denies, find_follow, goes_on, takes_back
from miburi.talk.cue import Match
from miburi.talk.script import script

#: How long a "yes" or "no" counts as the answer to a question about distress (our choice).
_ANSWERED = timedelta(minutes=2)
#: After explicit distress, the first three answers mention it again, and then every fifth answer.
#: If only the model heard the distress, just the first answer mentions it again, and no answer does
#: so after a request (our choice): in strangers' everyday conversations, the model raises a false
#: alarm about once in 250 remarks.
_STAYS, _EVERY = 3, 5
#: The partner asks about a slight sign of distress if another sign came at most this many remarks
#: before (our choice).
_SOON = 5

#: Kinds of real distress that people may deny, and how long a denial is ignored (our choice).
_HIDDEN, _LONG = frozenset({"suicide", "abuse"}), timedelta(minutes=10)

_Question = tuple[Distress, datetime]  # what it was about, and when it was asked


class Comfort:
    """Answers remarks about distress, with the sentences of ``care``."""

    def __init__(self, care: Care, clock: Callable[[], datetime]) -> None:
        self._care, self._clock = care, clock
        self._turns: Counter[str] = Counter()  # of help and questions, by kind
        self._since = 0  # remarks since words of distress, except orders and unrelated questions
        self._hidden: datetime | None = None  # when there was last a sign of suicide or abuse
        self._kind: Distress | None = None  # of the latest words of distress
        self._untrue = False  # whether somebody has said that nothing has happened
        self._plain = False  # whether the latest words of distress were plain
        self._over = False  # whether somebody has wanted something else, after words that were not
        self._asked: _Question | None = None  # whether somebody needs help
        self._before: _Question | None = None  # the same question, as of before this remark
        self._wondered: _Question | None = None  # whether somebody is all right
        self._signs = _SOON  # remarks since the latest sign of distress

    def confirm(self, heard: Impression, said: str, language: Language) -> Impression:
        """Return the impression; a "yes" to the question about distress counts as distress."""
        self._before, self._asked = self._asked, None
        if self._is_open(self._before) and (agrees(said, language) or says_yes(said)):
            return Impression(None, 0.0, "speech", distress=self._before[0])
        return heard

    def weigh(
        self, heard: Impression, said: str, language: Language, wanted: list[Match], *, after: bool
    ) -> Impression:
        """Return the impression, with a suspicion of distress only if it is worth a question.

        A second slight sign is worth a question, and so is a "no" to the question whether somebody
        is all right. After distress (``after``), an unspecific suspicion is not.
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

        Return None if the remark has nothing to do with distress, or has a better answer.
        """
        back = not self._over and not self._hides() and takes_back(said, language)
        if after and back and heard.distress is None and heard.worry is None:
            self._over = self._untrue = True
            return self._care.give_way(language, self._turn("misheard"))
        follow = self._follow(heard, said, language, after=after)
        if heard.worry is not None and follow is None:
            self._asked = heard.worry, self._clock()
            return self._care.ask(heard.worry, language, self._turn(f"ask {heard.worry}"))
        if heard.distress is not None:
            self._since, self._over, self._untrue = 0, False, False
            self._plain = bool(heard.why) or self._is_open(self._before)
            if follow is None and not (after and self._kind and heard.distress == "help"):
                self._kind = heard.distress
            if follow is None:
                return self._care.help(heard.distress, language, self._turn(heard.distress))
        if follow is not None:
            return follow
        if after and self._stays(said, language, wanted):
            return self._care.stay(language, self._turn(""))
        return None

    def _follow(
        self, heard: Impression, said: str, language: Language, *, after: bool
    ) -> str | None:
        """Return the answer to what is asked next in the emergency that was heard or asked about.

        Return None if no answer is known, or if plain words tell of another emergency.
        """
        if after and not self._untrue and (self._plain or not self._over):
            kind = self._kind
        elif self._is_open(self._before):
            kind = self._before[0]
        else:
            return None
        if kind is None or (heard.why and heard.distress not in (None, kind, "help")):
            return None
        follow = find_follow(said, kind, language)
        if follow is None:
            return None
        self.keep_open()
        return self._care.follow(follow, language, self._turn(follow.when[0]))

    def wonder(self, hint: Distress, language: Language) -> str:
        """Return a question that asks whether somebody is all right, after a slight sign."""
        self._wondered = hint, self._clock()
        return self._care.wonder(language, self._turn("wonder"))

    def keep_open(self) -> None:
        """Keep open the question that was open before this remark."""
        self._asked = self._before

    def _turn(self, name: str) -> int:
        self._turns[name] += 1
        return self._turns[name] - 1

    def _is_open(self, asked: _Question | None) -> TypeGuard[_Question]:
        """Return whether a remark may still answer this question."""
        return asked is not None and self._clock() - asked[1] < _ANSWERED

    def _hides(self) -> bool:
        """Return whether somebody may be denying real distress."""
        return self._hidden is not None and self._clock() - self._hidden < _LONG

    def _stays(self, said: str, language: Language, wanted: list[Match]) -> bool:
        """Return whether the answer comes back to earlier distress."""
        words = script(language)
        acts = any(match.cue.acts for match in wanted)
        onward = goes_on(said, language) and not acts
        known = any(not (match.cue.broad or match.cue.aside) for match in wanted) and not onward
        asks = words.asks(said) or onward
        stays, people = self._since < _STAYS, onward or words.fits("people", said)
        other = asks and ((known and not stays) or (not people and (known or not stays)))
        # Whoever asks "Do you know any jokes?" was misheard, or the distress is over.
        fun = not stays and any(match.cue.light and match.cue.stays for match in wanted)
        self._over = self._over or fun or (not self._plain and (known or acts))
        if self._over or other or acts:
            return False
        self._since += 1
        if not self._plain:
            return self._since <= (_STAYS if onward else 1)
        return asks or self._since <= _STAYS or self._since % _EVERY == 0
