import json
import re
from importlib import resources
from pathlib import Path

import pytest
from fontTools.ttLib import TTFont

from miburi.errors import InputError
from miburi.feelings import FEELINGS, SOURCES, TEMPERAMENTS
from miburi.feelings.catalogue import SHIPPED
from miburi.live.bodies import KINDS
from miburi.live.state import EndReason
from miburi.robot import JOINTS
from miburi.safety.stop import StopReason
from miburi.senses.happenings import happenings
from miburi.senses.kinds import KINDS as DISTRESSES
from miburi.studio.words import own_name, page_languages, preferred, words
from miburi.talk.script import script


def places(text: str) -> set[str]:
    return set(re.findall(r"\{(\w+)\}", text))


@pytest.mark.parametrize("language", page_languages())
def test_every_language_says_all_that_english_says(language: str) -> None:
    english, other = words("en"), words(language)
    assert {s: sorted(keys) for s, keys in other.items()} == {
        s: sorted(keys) for s, keys in english.items()
    }
    for section, keys in english.items():
        for key, text in keys.items():
            assert places(other[section][key]) == places(text), (section, key)
            assert other[section][key].strip()


def test_every_name_has_a_word() -> None:
    english = words("en")
    assert set(english["feeling"]) == set(FEELINGS)
    for feeling in SHIPPED.feeling:
        assert set(feeling.words) == set(page_languages())
    assert set(english["joint"]) == set(JOINTS)
    assert set(KINDS) <= set(english["body"])
    assert set(english["distress"]) == set(DISTRESSES)
    assert set(english["reason"]) == set(StopReason)
    assert set(english["source"]) == set(SOURCES)
    assert set(english["happening"]) == set(happenings())
    assert set(english["recording"]) == set(EndReason)
    assert set(TEMPERAMENTS) <= set(english["body"])


def test_languages_call_themselves() -> None:
    assert {own_name(language) for language in page_languages()} >= {"English", "日本語"}


@pytest.mark.parametrize(
    ("wishes", "language"),
    [
        (("ja",), "ja"),
        ((None, "ja-JP,en;q=0.5"), "ja"),
        (("xx", None, "fr, ja;q=0.3"), "ja"),
        (("en;q=0.1,ja;q=0.9",), "ja"),
        (("ja;q=0, en;q=0.2",), "en"),
        ((None, None), "en"),
        (("../../etc/passwd",), "en"),
    ],
)
def test_a_visitors_wish_is_met_where_it_can_be(wishes: tuple[str], language: str) -> None:
    assert preferred(*wishes) == language


def test_an_unknown_language_is_refused() -> None:
    with pytest.raises(InputError, match="en, ja"):
        words("tlh")


def test_the_font_for_computers_without_one_has_every_character_of_the_pages() -> None:
    """``tools/subset-font`` makes it; Debian without Japanese fonts showed Stop as boxes."""
    house = Path(str(resources.files("miburi")))
    file = house / "studio/static/fonts/japanese.woff"
    assert file.stat().st_size < 400_000
    texts = [words("ja"), own_name("ja"), script("ja").model_dump()]
    said = json.dumps(texts, ensure_ascii=False) + "身振り"
    needed = {char for char in said if "\u2e80" <= char <= "\uffff"}
    assert needed - {*map(chr, TTFont(file).getBestCmap())} == set()
