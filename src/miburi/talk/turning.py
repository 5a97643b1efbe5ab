"""Put words into the partner's mouth: "my son" becomes "your son", and a question is echoed."""

import re
from collections.abc import Mapping

from miburi.languages import Language, is_spaced

__all__ = ["Turner"]


class Turner:
    """Turns somebody's words into those of the partner.

    Parameters
    ----------
    turned
        Regular expressions of words that change with the speaker, of which the first that fits
        counts, and what they become: ``my`` becomes ``your``.
    echoed
        Regular expression of a written question that the partner can repeat; its group is the part
        to repeat. An empty one matches nothing.
    echo
        The form of the repeated question, with the slot ``it``.
    language
        In a language without spaces, a pattern must itself mark where words begin and end.
    """

    def __init__(
        self, turned: Mapping[str, str], echoed: str, echo: str, language: Language
    ) -> None:
        edge = r"(?<!\w)(?:{})(?!\w)" if is_spaced(language) else "(?:{})"
        written = [(edge.format(pattern), to) for pattern, to in turned.items()]
        self._each = [(re.compile(pattern, re.IGNORECASE), to) for pattern, to in written]
        self._any = re.compile("|".join(pattern for pattern, _ in written), re.IGNORECASE)
        self._echo = echo
        self._echoed = re.compile(echoed or "(?!)", re.IGNORECASE)

    def turn_round(self, words: str) -> str:
        """Return somebody's words from the partner's point of view: "my son" becomes "your son"."""
        return self._any.sub(self._turn, words)

    def _turn(self, found: re.Match[str]) -> str:
        # Patterns may look at the text around the words.
        for pattern, to in self._each:
            if one := pattern.match(found.string, found.start()):
                return one.expand(to)
        return found.group()

    def echo(self, said: str) -> str | None:
        """Return the last question of a remark as the partner says it back; None if it cannot."""
        asked = [found.group(1) for found in self._echoed.finditer(said)]
        if not asked:
            return None
        words = self.turn_round(asked[-1])
        return self._echo.format(it=f"{words[:1].upper()}{words[1:]}")
