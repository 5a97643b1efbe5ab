"""Languages in a user's own folder, such as that of the examples."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from miburi.errors import DescriptionError
from miburi.languages import VARIABLE, common_words, folders, language_of, words_of
from miburi.languages.rules import rules_of
from miburi.senses.distress import hear_distress
from miburi.studio.words import own_name, page_languages, untranslated, words
from miburi.talk.answers import stops_in, wants_stop
from miburi.talk.care import Care
from miburi.talk.own_languages import check_languages
from miburi.talk.script import script

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_language"
ENGLISH = Path(str(folders()["en"]))


def forget() -> None:
    """Forget what was read of languages."""
    for each in (folders, rules_of, words_of, page_languages, script, own_name, words):
        each.cache_clear()


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the example, which the partner knows."""
    shutil.copytree(EXAMPLE, tmp_path, dirs_exist_ok=True)
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    forget()
    yield tmp_path
    monkeypatch.undo()
    forget()


def test_the_example_is_recognised_answered_and_cared_for(own: Path) -> None:
    assert check_languages(own) == []
    assert language_of("Buongiorno, come sta?") == "it"
    assert [match.cue.move for match in script("it").intents_of("Alza le braccia")] == ["lift"]
    assert [match.cue.do for match in script("it").intents_of("Fermati!")] == ["stop"]
    heard = hear_distress("Sono caduta e non riesco ad alzarmi.")
    assert heard is not None
    assert heard.kind == "fall"
    assert "Chiami" in Care().help(heard.kind, "it", 0)
    assert language_of("Je suis triste") == "fr"  # those that ship are still there


def test_a_pattern_is_written_as_people_write(own: Path) -> None:
    shutil.copytree(own / "it", own / "de")
    rules, talk = own / "de" / "language.toml", own / "de" / "talk.toml"
    rules.write_text('common = "ich bin für"\naccents = false\n', encoding="utf-8")
    stop = "['^(Hör auf|Schluß|gib[’]s auf|l[aä]ss \\\\S+ los)$']"
    text = talk.read_text(encoding="utf-8")
    talk.write_text(re.sub(r"(do = \"stop\"\nwhen = ).*", rf"\1{stop}", text), encoding="utf-8")
    forget()
    for said in ("hör auf!", "Hoer auf", "hor auf", "Schluss!", "Lass mich los", "Läss mich los"):
        assert wants_stop(said, "de"), said
    assert not wants_stop("Hohr auf", "de")
    assert "fur" in common_words("de")


@pytest.mark.parametrize("said", ["Alza!", "Fermo!", "Mah, boh!", "Marghera"])
def test_short_words_are_in_the_language_of_the_talk(own: Path, said: str) -> None:
    assert language_of(said, "it") == "it"


def test_stop_in_any_language_stops(own: Path) -> None:
    assert stops_in("Basta!", "en") == "it"
    assert stops_in("止まって！", "it") == "ja"
    assert stops_in("That hurts!", "it", moving=True) == "en"
    assert stops_in("Ciao!", "it") is None


def test_pages_are_shown_in_a_language_that_has_words_for_them(own: Path) -> None:
    assert "it" not in page_languages()
    pages = (ENGLISH / "pages.toml").read_text(encoding="utf-8")
    pages = pages.replace('language = "English"', 'language = "Italiano"')
    (own / "it" / "pages.toml").write_text(pages, encoding="utf-8")
    page_languages.cache_clear()
    assert own_name("it") == "Italiano"
    assert words("it").keys() == words("en").keys()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("{motor} met something", "{moter} met something", r"contact.met: .* has \{moter\}"),
        ('stop = "Stop"', "stop = 1", "studio.stop: 1 is no text"),
        ('stop = "Stop"', "stop = Stop", "this is not TOML"),
        ('stop = "Stop"', 'stopp = "Stop"', "studio.stopp: not a known key here"),
        ("[studio]", "[studium]", "studium: not a known key here"),
        ('stop = "Stop"', "", ""),
    ],
)
def test_a_page_lacks_no_word_and_fills_in_what_it_knows(
    own: Path, old: str, new: str, said: str
) -> None:
    pages = (ENGLISH / "pages.toml").read_text(encoding="utf-8")
    assert old in pages
    (own / "it" / "pages.toml").write_text(pages.replace(old, new, 1), encoding="utf-8")
    for each in (page_languages, own_name, words):
        each.cache_clear()
    if said:
        with pytest.raises(DescriptionError, match=said):
            words("it")
    else:
        assert words("it")["studio"]["stop"] == "Stop"
        assert untranslated("it") == 1


def test_english_of_ones_own_needs_all_files(own: Path) -> None:
    shutil.copytree(ENGLISH, own / "en")
    folders.cache_clear()
    assert check_languages(own) == []
    (own / "en" / "care.toml").unlink()
    with pytest.raises(DescriptionError, match=r"care\.toml is missing"):
        check_languages(own)


def test_a_language_without_words_of_distress_is_named(own: Path) -> None:
    shutil.copytree(own / "it", own / "xx")
    (own / "xx" / "distress.toml").unlink()
    folders.cache_clear()
    (own / "xx" / "care.toml").unlink()
    distress, care = check_languages(own)
    assert distress.startswith(f"{own / 'xx'}: distress.toml is missing")
    assert care.startswith(f"{own / 'xx'}: care.toml is missing")


@pytest.mark.parametrize(
    ("name", "file", "old", "new", "said"),
    [
        ("ya", "talk", "clock =", "klock =", "talk.toml"),
        ("yb", "talk", "'^(no )?(stop|", "'^(no )?((stop|", "is no regular expression"),
        ("yc", "language", 'apostrophes = "split"', 'apostrophes = "cut"', "apostrophes"),
        ("yd", "distress", "gas = [", "gasp = [", "kinds.gasp"),
        ("ye", "distress", "gas = [", "# gas = [", "distress.toml: kinds: 'gas' is missing"),
        ("yf", "distress", "idioms = [", "sayings = [", "excuses: 'idioms' is missing"),
        ("yg", "distress", "{they} e", "{tehy} e", r"distress.toml: kinds.fall.0 has \{tehy\}"),
        ("yh", "care", "fall = [", "# fall = [", "care.toml: help: 'fall' is missing"),
        ("yi", "care", "Chiami {medical}, o", "Chiami {medcal}, o", r"help.fall.0: .* \{medcal\}"),
        ("yj", "care", "Chiami {medical}, o", "Chiami {medical, o", "help.fall.0: .* be filled in"),
        ("yk", "talk", "Ecco, in alto!", "Ecco, in alto}!", "Single '}' encountered"),
        ("yl", "talk", "{hour} e {minute}", "{hour} e {minuto}", r"talk.toml: clock: .*\{minuto\}"),
        ("ym", "talk", "{day} {month}", "{giorno} {month}", r"talk.toml: date: .*\{giorno\}"),
        ("yn", "talk", "Ecco, in alto!", "{nome}!", r"intent.2.say.0: .* has \{nome\}; allowed"),
        ("yo", "talk", "Ecco, in alto!", "{it}!", r"no pattern in `when` has a group"),
        (
            "yp",
            "talk",
            "Sono in pausa.",
            "{name}!",
            r"paused.0: .* has \{name\}; .* none",
        ),
        (
            "yq",
            "talk",
            "fermo|ferma|fermati|basta)(",
            "fermo|(ferma)(",
            "intent.0.when.0 = .*fermo",
        ),
    ],
)
def test_a_mistake_in_a_file_is_named(
    own: Path, name: str, file: str, old: str, new: str, said: str
) -> None:
    wrong = own / name
    shutil.copytree(own / "it", wrong)
    text = (wrong / f"{file}.toml").read_text(encoding="utf-8")
    assert old in text
    (wrong / f"{file}.toml").write_text(text.replace(old, new), encoding="utf-8")
    folders.cache_clear()
    with pytest.raises(DescriptionError, match=said) as refused:
        check_languages(own)
    assert str(wrong) in str(refused.value)


@pytest.mark.parametrize(
    ("name", "file", "said"),
    [
        ("Deutsch", "language.toml", "is named by its code"),
        ("x", "talk.toml", "is named by its code"),
        ("de", "talk.toml", "language.toml is missing"),
        ("de", None, "language.toml is missing"),
        ("notes", "plan.txt", None),
        ("pt-BR", "language.toml", None),
    ],
)
def test_a_folder_of_a_language_is_named_by_its_code(
    own: Path, name: str, file: str | None, said: str | None
) -> None:
    (own / name).mkdir()
    if file:
        (own / name / file).touch()
    folders.cache_clear()
    if said is None:
        assert (name in folders()) == (file == "language.toml")
    else:
        with pytest.raises(DescriptionError, match=said):
            folders()


def test_a_folder_without_a_language_is_refused(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.rmtree(own / "it")
    folders.cache_clear()
    with pytest.raises(DescriptionError, match="no language is in this folder"):
        folders()
    monkeypatch.setenv(VARIABLE, str(own / "missing"))
    with pytest.raises(DescriptionError, match="missing: there is no such folder"):
        folders()
