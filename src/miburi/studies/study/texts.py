"""The words of a study's pages: the fixed ones, and all that one participant reads."""

import tomllib
from functools import cache
from pathlib import Path

from miburi.studies.study.plan import Question, Study, pick

_WORDS = Path(__file__).parent / "pages" / "words.toml"


@cache
def page_words() -> dict[str, dict[str, str]]:
    """Return the fixed words of all pages, by language and key."""
    return tomllib.loads(_WORDS.read_text(encoding="utf-8"))


def preferred(study: Study, wishes: str) -> str:
    """Return the study's language that a visitor prefers most; by default the study's first."""
    for part in wishes[:200].split(","):
        wish = part.split(";")[0].strip().lower().split("-")[0]
        if wish in study.languages:
            return wish
    return study.languages[0]


def paragraphs(text: str) -> list[str]:
    """Return a text's paragraphs; an empty line begins one."""
    return text.strip().split("\n\n")


def participant_text(study: Study, language: str) -> str:
    """Return what a participant reads from the first page to the last, to show to an ethics board.

    Each question appears once, however often it is asked; questions about the person come first.
    Buttons, error messages, and the notices of a study with the robot in the room are left out.
    """
    words = page_words()[language]
    parts = [
        f"# {pick(study.title, language)}",
        pick(study.information, language).strip(),
        words["privacy"] + (f" {words['times']}" if study.times else ""),
        f"[ ] {words['agree']}    [{words['begin']}]",
    ]
    for after in ("start", "film", "all"):
        asked = [question for question in study.question if question.after == after]
        parts += [_question(study, question, language, words) for question in asked]
    code = f"K7QM-2XHD · {words['withdraw_title']}"
    debriefing = [pick(study.debriefing, language)] if study.debriefing else []
    parts += [
        f"{words['code']} {code} · {words['stop']} · {words['information']}",
        f"# {words['thanks']}",
        words["finished"],
        *debriefing,
        *([f"{words['completion']}: {study.completion}"] if study.completion else []),
        f"{words['write_down']} {code}",
        f"# {words['stop']}",
        words["stopping"],
        f"# {words['left_title']}",
        f"{words['left']} {code}",
        *debriefing,
        f"# {words['withdraw_title']}",
        words["withdraw_words"],
        f"# {words['withdrawn_title']}",
        words["withdrawn"],
        *debriefing,
    ]
    return "\n\n".join(parts) + "\n"


def _question(study: Study, question: Question, language: str, words: dict[str, str]) -> str:
    lines = [f"## {pick(question.ask, language)}"]
    if question.kind in ("choice", "check"):
        lines += [f"( ) {study.words(question, o, language)}" for o in study.options(question)]
    lines += [f"( ) {pick(option.words, language)}" for option in question.answers]
    lines += [
        f"{pick(item.low, language)} 1 – {question.points} {pick(item.high, language)}"
        for item in question.items
    ]
    if question.optional:
        lines += [f"( ) {words['no_answer']}" if question.answers else words["may_be_empty"]]
    return "\n".join(lines)
