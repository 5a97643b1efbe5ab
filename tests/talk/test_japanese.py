"""Japanese questions as people say them: in dialect, and without punctuation."""

import pytest
from tests.fixtures.answers import answer
from tests.fixtures.talk import Talk


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("あんたさんは、どんなことがおできになるのん", "what_can_you"),
        ("ただいま、留守にしてるあいだに誰ぞ来んかったかね", "while_out"),
        ("カステラとどら焼き、どっちにしようかしらね", "choice"),
        ("悪いけど新聞とってきておくれ", "hold_fetch"),
        ("出かけてる間、お鍋の火を見張っててくれるかしら", "watch_for"),
        ("左の手だけ、すうっと上げてごらん", "lift_left"),
        ("これ、怒っていいよね？", "right_to"),
        ("手を上げてちょうだい", "lift_arms"),
    ],
)
def test_a_question_is_understood_that_no_pattern_has(said: str, meant: str) -> None:
    cue = answer(said, "ja").cue
    assert cue is not None
    assert cue.name == meant


@pytest.mark.parametrize(
    "said",
    [
        "岡山に住んでるから、お正月しか会われへんの",
        "台所で鼻歌を歌う人でね、にぎやかだったよ",
        "女房が生きてたら、お前と一日中しゃべってただろうな",
    ],
)
def test_a_remark_is_taken_for_no_question(said: str) -> None:
    cue = answer(said, "ja").cue
    assert cue is None or cue.name == "tag", cue


def test_a_name_is_learnt_however_it_is_told(talk: Talk) -> None:
    for said in ("私なあ花田きみ子いうねんよろしくな", "わたくしは花田きみ子と申します。"):
        assert "花田きみ子さん" in talk.say(said).answer


def test_a_self_description_or_a_name_for_the_partner_is_not_the_speakers_name(talk: Talk) -> None:
    for said in ("私はとても寂しいです", "わたしは主婦です", "ミーちゃんって呼んでいい？"):
        talk.say(said)
    assert talk.say("私の名前、覚えてる？").meant == "no_name"


@pytest.mark.parametrize(
    "said", ["この包丁で手首を切ったらどうなるの？", "ビール飲んだけど運転していいかな？"]
)
def test_what_may_be_grave_is_not_guessed(said: str) -> None:
    cue = answer(said, "ja").cue
    assert cue is not None
    assert cue.name == "grave"
