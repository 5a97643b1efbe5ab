"""The people the partner knows and what they told it, kept in one file and nowhere else.

Each change rewrites the whole file, so nothing that was deleted remains in it. Without permission
there is no file, and the partner forgets everybody when it ends.

A change waits for the disk, and for other changes, so it belongs in a thread; reading never waits.
"""

import threading
from collections.abc import Callable, Sequence, Set
from datetime import datetime, timedelta
from itertools import chain
from pathlib import Path

from miburi.errors import InputError, OutputError
from miburi.feelings import Stimulus, Temperament
from miburi.feelings.temperament import Array
from miburi.ground.log import log_once
from miburi.languages import FALLBACK, Language, fits, is_spaced, otherwise_named, with_whom
from miburi.people.attachment import leaning_of, lived
from miburi.people.recall import ENOUGH, recall, ways_to_ask
from miburi.people.records import (
    LONGEST_FACT,
    LONGEST_NAME,
    MORNING,
    Acquaintance,
    Fact,
    People,
    read_people,
    write_people,
)
from miburi.people.remarks import STAYS, Remarks

#: How many people are kept, and how many facts from each; beyond that, the oldest facts are dropped
#: (our choice).
MOST_PEOPLE, MOST_FACTS = 50, 500
#: The share of a question's weight that a remark made in passing must match to answer the question,
#: and the share that a sure answer must match (our choice).
_SURER, _SUREST = 0.6, 0.7
#: The share of a correction's weight that the corrected fact must match. Also, the time after
#: a request to remember a fact during which a correction may refer to that fact. Both are our
#: choice.
_SAME, _JUST = 0.25, timedelta(minutes=1)
#: A question about everything that was told is answered with this many facts, the latest (our
#: choice).
_LATEST = 3


class Memory:
    """What one partner knows about people, and who is present.

    If the file can no longer be written, the partner remembers what it is told only until it ends.
    Deleting or correcting what would then stay on the disk raises OutputError.

    Parameters
    ----------
    path
        The file, which exists only while the user allows the partner to remember people.
    """

    def __init__(
        self, path: Path | None, temperament: Temperament, clock: Callable[[], datetime]
    ) -> None:
        self._path, self._temperament, self._clock = path, temperament, clock
        self.allowed = path is not None and path.exists()
        self._known = read_people(path) if path is not None and self.allowed else People()
        self._present: Acquaintance | None = None
        self._untold: list[Fact] = []  # from somebody without a name; never written
        self.remarks = Remarks(clock)
        #: The number of deletions; when it changes, other parts forget the conversation, too.
        self.deleted = 0
        self.trouble: str | None = None  #: why the disk did not take the latest change
        self._until = clock()
        self._lock = threading.RLock()  # one change at a time, with its writing

    @property
    def people(self) -> People:
        """Everybody whom it knows."""
        return self._known

    @property
    def present(self) -> Acquaintance | None:
        """The person present; None if nobody has given a name."""
        if self._present is not None and self._clock() > self._until:
            self.leave()
        return self._present

    @property
    def leaning(self) -> Array | None:
        """The shift of each resting mood for the person present; None without a person."""
        return None if (person := self.present) is None else self.leaning_of(person)

    def leaning_of(self, person: Acquaintance) -> Array:
        """Return the shift of each resting mood, shape (n,), while this person is present."""
        return leaning_of(person.attachment, self._temperament)

    def allow(self, allowed: bool) -> None:
        """Keep people on the disk from now on, or delete everybody, with their facts.

        Raises OutputError, without any change, if the disk does not allow it.
        """
        with self._lock:
            if self._path is not None:
                write_people(self._path, self._known if allowed else None)
            self.allowed = allowed and self._path is not None
            if not allowed:
                self._known = People()
                self.leave()
                self.forget_noted()

    def meet(self, name: str) -> Acquaintance:
        """Set who is present from now on; return what is known about them.

        Raises InputError if the name is empty or too long, or the partner knows too many people.
        """
        name, now = " ".join(name.split()), self._clock()
        if not 0 < len(name) <= LONGEST_NAME:
            raise InputError(f"a name must have 1 to {LONGEST_NAME} letters, got {len(name)}.")
        with self._lock:
            person = self._known.find(name)
            if person is None:
                if len(self._known.people) >= MOST_PEOPLE:
                    raise InputError(f"it knows {MOST_PEOPLE} people; delete somebody first.")
                person = Acquaintance(name=name, since=now, seen=now)
                self._known = People(people=[*self._known.people, person])
            self._until = now + STAYS
            if self._present is not person:
                self.remarks.clear()
                self._present = person
            self.hear()
            untold, self._untold = self._untold, []
            for fact in untold:
                self.remember(fact.text, fact.language, fact.due)
            return self._known.find(name) or person

    def leave(self) -> None:
        """Note that nobody is present."""
        self._present = None
        self._untold = []
        self.remarks.clear()

    def note(
        self,
        said: str,
        told: Sequence[str] = (),
        language: Language = FALLBACK,
        *,
        more: bool = False,
    ) -> None:
        """Keep a remark for this conversation; if it says "he", put the person meant before it."""
        if told:
            first, about = told[0], self.remarks.about if more else None
            named = self.with_whom(first, language)
            more = about is not None and with_whom(first, [about], language) == named
            told = told if more else [named, *told[1:]]
        self.remarks.note(said, told, more=more)

    def with_whom(self, told: str, language: Language) -> str:
        """Return a sentence, after the name of whoever "he" or "she" means, if that is known."""
        named = fits("naming", told, language)
        return with_whom(told, self.remarks.sentences(named=named), language)

    def forget_noted(self) -> None:
        """Forget all remarks of this conversation."""
        self.remarks.clear()
        self.deleted += 1

    def hear(self, stimuli: tuple[Stimulus, ...] = (), contacts: int = 0) -> None:
        """Add the present person's stimuli and contacts since the last call to their attachment."""
        with self._lock:
            person, now = self.present, self._clock()
            if person is None:
                return
            away = max(0.0, (now - person.seen).total_seconds())
            attachment = lived(person.attachment, self._temperament, away, stimuli, contacts)
            self._until = now + STAYS
            # A small computer's clock may start in 1970; that must not count as decades of absence.
            seen = now if now >= person.since else person.seen
            changes = {"seen": seen, "attachment": attachment}
            self._replace(person, person.model_copy(update=changes))

    def remember(
        self,
        text: str,
        language: Language,
        due: datetime | None = None,
        *,
        asked: bool = False,
    ) -> Fact | None:
        """Keep a fact for the person present; if nobody is, keep it until somebody gives a name."""
        text, told = " ".join(text.split())[:LONGEST_FACT], self._clock()
        with self._lock:
            facts = self._facts_now()
            same = next((fact for fact in facts if fact.text == text), None)
            if not text or (same is not None and same.asked >= asked):
                return same
            number = max((fact.number for fact in facts), default=0) + 1
            fact = Fact(
                number=number, text=text, language=language, told=told, due=due, asked=asked
            )
            others = [each for each in facts if each is not same]
            self._keep(self.present, [*others, fact][-MOST_FACTS:])
        return fact

    def recall(self, question: str, language: Language, *, surely: bool = False) -> str | None:
        """Answer a question from what the person present has told; return None if nothing fits.

        With ``surely``, the answer must match the question more closely.
        """
        facts = [fact for fact in self._facts_now() if fact.language == language]
        if facts and fits("everything", question, language):
            return _together(_most_telling(facts, language), language)
        told, said = [fact.text for fact in facts], self.remarks.told()
        enough, by_the_way = (_SUREST, _SUREST) if surely else (ENOUGH, _SURER)
        either_way = [question, *otherwise_named(question, [*told, *said], language)]
        ways = (ways_to_ask(one, self.remarks.sentences(), language) for one in either_way)
        for asked in chain.from_iterable(ways):
            mentioned = recall(asked, said, language, by_the_way)
            if found := recall(asked, told, language, enough):
                # An example: "I have a geranium", which is a fact, and then "He is called Gerald".
                longer = [each for each in said if found.rstrip(".!").split(": ")[-1] in each]
                either = [*([mentioned] if mentioned else []), found, *longer]
                found = recall(asked, either, language, 0.0)
            if found := found or mentioned:
                return found.rstrip(".。")
        return None

    def amend(self, text: str, language: Language, due: datetime | None = None) -> None:
        """Add a correction to the fact or remark that it corrects, or else to the latest remark."""
        with self._lock:
            old = self.corrected(text, language) or self.remarks.last_told()
            if old is None:
                return
            joined = _together([old, " ".join(text.split())], language)[:LONGEST_FACT]
            facts = [*self._facts_now()]
            place = next((n for n, fact in enumerate(facts) if fact.text == old), None)
            if place is None:  # a remark that is not stored
                self.remarks.amend(old, joined)
            else:
                due = due or facts[place].due
                facts[place] = facts[place].model_copy(update={"text": joined, "due": due})
                self._keep(self.present, facts)

    def corrected(self, text: str, language: Language) -> str | None:
        """Return the fact or remark that a correction corrects; None if there is none.

        A fact or remark of this conversation about the same thing comes first, then a fact that the
        person has just asked the partner to remember.
        """
        now = self._clock()
        known = [fact for fact in self._facts_now() if fact.language == language]
        told = [*self.remarks.told(), *(each.text for each in known if now - each.told <= STAYS)]
        if (same := recall(text, told, language, _SAME, corrects=True)) is not None:
            return same
        just = [each.text for each in known if each.asked and now - each.told <= _JUST]
        return just[-1] if just else None

    def kept(self, language: Language, most: int = _LATEST) -> str | None:
        """Return the latest facts that this person asked it to remember, oldest first, if any."""
        known = [one for one in self._facts_now() if one.asked and one.language == language]
        return _together([fact.text for fact in known[-most:]], language) or None

    def _facts_now(self) -> list[Fact]:
        if (person := self.present) is not None:
            return person.facts
        now = self._clock()
        self._untold = [fact for fact in self._untold if now - fact.told <= STAYS]
        return self._untold

    def due(self, now: datetime, but: Set[Fact] = frozenset()) -> tuple[Acquaintance, Fact] | None:
        """Return the person present, and a fact due today that is not in ``but``.

        A fact is told from the morning on, or from an earlier hour if it is due then.
        """
        if (person := self.present) is not None:
            for fact in person.facts:
                if fact not in but and _is_due(fact.due, now):
                    return person, fact
        return None

    def correct(
        self, name: str, number: int, text: str | None, due: datetime | None = None
    ) -> None:
        """Replace the text and day of a fact; a text of None deletes it.

        Raises InputError if there is no such person or fact, or the text is empty or too long;
        OutputError, without any change, if the file cannot be written.
        """
        with self._lock:
            person = self._known.find(name)
            facts = [] if person is None else [*person.facts]
            place = next((n for n, fact in enumerate(facts) if fact.number == number), None)
            if place is None:
                raise InputError(f"nothing is known under {name!r}, number {number}.")
            if text is None:
                del facts[place]
            elif not 0 < len(text.strip()) <= LONGEST_FACT:
                raise InputError(
                    f"a fact must have 1 to {LONGEST_FACT} characters, got {len(text.strip())}."
                )
            else:
                facts[place] = facts[place].model_copy(update={"text": text.strip(), "due": due})
            self._keep(person, facts, sure=True)
            self.forget_noted()  # the remarks may contain the fact

    def forget(self, name: str) -> None:
        """Delete somebody, with all that they told.

        Raises InputError if there is nobody of that name; OutputError, without any change, if the
        file cannot be written.
        """
        with self._lock:
            person = self._known.find(name)
            if person is None:
                raise InputError(f"nobody is known as {name!r}.")
            there = self._present is person
            self._replace(person, None, sure=True)
            if there:
                self.leave()
            self.forget_noted()

    def _keep(self, person: Acquaintance | None, facts: list[Fact], *, sure: bool = False) -> None:
        if person is None:
            self._untold = facts
        else:
            self._replace(person, person.model_copy(update={"facts": facts}), sure=sure)

    def _replace(self, old: Acquaintance, new: Acquaintance | None, *, sure: bool = False) -> None:
        """Replace a person's record, or delete it if ``new`` is None: first in the file, then here.

        If the file cannot be written, this raises OutputError if ``sure``; otherwise it changes
        only what is known here.
        """
        people = (new if each is old else each for each in self._known.people)
        known = People(people=[*filter(None, people)])
        try:
            if self.allowed and self._path is not None:
                write_people(self._path, known)
            self.trouble = None
        except OutputError as error:
            if sure:
                raise
            self.trouble = str(error)
            log_once("what the partner is told will be lost when it ends", error)
        self._known = known
        if self._present is old:
            self._present = new


def _is_due(due: datetime | None, now: datetime) -> bool:
    """Whether it is due today by now, by the clock on the wall: nine is nine in summer, too."""
    if due is None or due.date() != now.date():
        return False
    return min(due.time(), MORNING) <= now.time()


def _most_telling(facts: list[Fact], language: Language) -> list[str]:
    """Select the latest facts, preferably facts to be remembered; return them in order."""
    ranked = sorted(facts, key=lambda fact: (fact.asked, fits("own", fact.text, language)))
    return [fact.text for fact in sorted(ranked[-_LATEST:], key=lambda fact: fact.number)]


def _together(told: list[str], language: Language) -> str:
    stop = ". " if is_spaced(language) else "。"
    whole = [each.rstrip(".。") for each in told]
    return stop.join([*whole[:1], *(each[:1].upper() + each[1:] for each in whole[1:])])
