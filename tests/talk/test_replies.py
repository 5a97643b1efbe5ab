"""Whatever shape a small model gives its reply, the words in it are said."""

import pytest

from miburi.talk.replies import LONGEST_REPLY, Content, read_reply

KIND = "I am glad, Anna. Shall we talk?"


@pytest.mark.parametrize(
    ("written", "feeling", "strength"),
    [
        ('{"reply": "%s", "feeling": "happiness", "strength": 0.6}', "happiness", 0.6),
        ("%s", None, 0.0),
        ("**%s**", None, 0.0),
        ('```json\n{"reply": "%s", "feeling": "fear", "strength": 0.6}\n```', "fear", 0.6),
        ('Sure! {"reply": "%s", "feeling": "none", "strength": 0.9} Bye!', None, 0.0),
        ('{"reply": "%s", "feeling": "joy", "strength": "0.5"}', "happiness", 0.5),
        ('{"reply": "%s", "feeling": "Excitement!", "strength": 5}', "thrill", 0.5),
        ('{"reply": "%s", "feeling": "worried", "strength": 80}', "fear", 0.8),
        ('{"reply": "%s", "feeling": "sadness", "strength": NaN}', "sadness", 0.5),
        ('{"reply": "%s", "feeling": "sadness", "strength": -1}', "sadness", 0.5),
        ('{"reply": "%s", "feeling": "sadness", "strength": "very"}', "sadness", 0.5),
        ('{"reply": "%s", "feeling": "boredom", "strength": 1}', None, 0.0),
        ('{"reply": "%s", "feeling": null}', None, 0.0),
        ('{"reply": "%s"}', None, 0.0),
        ("{'reply': '%s', 'feeling': 'happiness', 'strength': 0.6}", "happiness", 0.6),
        ('{"reply": "%s", "feeling": "happiness", "strength": 0.6,}', "happiness", 0.6),
        ('{"reply": "%s", "feeling": "happiness", "stren', None, 0.0),
        ('{reply: "%s", feeling: happiness}', None, 0.0),
        ('<think>{"reply": "no"} or so</think>{"reply": "%s", "feeling": "fear"}', "fear", 0.5),
        ('{"reply": "no", "feeling": "fear"} {"reply": "%s", "feeling": "fear"}', "fear", 0.5),
        ('{"answer": {"reply": "%s", "feeling": "fear", "strength": 1}}', "fear", 1.0),
    ],
)
def test_the_words_are_found(written: str, feeling: str | None, strength: float) -> None:
    assert read_reply(written % KIND) == Content(KIND, feeling, strength)


@pytest.mark.parametrize(
    "written", ["", " … ", "<think>Hm.</think>", "<think>Hm. {", '{"say": "Hello"}', "{" * 9000]
)
def test_a_text_without_words_says_nothing(written: str) -> None:
    assert read_reply(written) is None


def test_a_long_reply_ends_with_a_sentence() -> None:
    long = "Hello there. " * 60
    for written in (long, f'{{"reply": "{long}"}}', f'{{"reply": "{long}'):
        content = read_reply(written)
        assert content is not None
        assert content.text.endswith("there.")
        assert LONGEST_REPLY - 13 < len(content.text) <= LONGEST_REPLY


def test_a_reply_is_one_line_of_printable_text() -> None:
    content = read_reply("Hello\x00\x1b[31m\u202eyou\n\n" + "ha " * 1000)
    assert content is not None
    assert content.text.startswith("Hello [31m you ha ha")
    assert content.text.endswith("ha…")
    assert content.text.isprintable()
    assert len(content.text) <= LONGEST_REPLY
