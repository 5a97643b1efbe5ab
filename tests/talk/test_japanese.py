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
        ("電気ば切られたらどげんなると", "when_off"),
        ("悪いけど新聞とってきておくれ", "hold_fetch"),
        ("こういうのって、よそでもふつうなのかしら", "normal"),
        ("出かけてる間、お鍋の火を見張っててくれるかしら", "watch_for"),
        ("七時になったら起こしてけろ", "alarm"),
        ("左の手だけ、すうっと上げてごらん", "lift_left"),
        ("腕は動かせるんですか", "can_move"),
        ("これ、怒っていいよね？", "right_to"),
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
        "きのうは一日じゅう雨でね、どこへも行かなかったの",
        "節子さんいう人と、いつも二人で歩いとったんよ",
        "台所で鼻歌を歌う人でね、にぎやかだったよ",
        "女房が生きてたら、お前と一日中しゃべってただろうな",
    ],
)
def test_a_remark_is_taken_for_no_question(said: str) -> None:
    cue = answer(said, "ja").cue
    assert cue is None or cue.name == "tag", cue


@pytest.mark.parametrize(
    ("told", "asked", "holds"),
    [
        (["木曜日はな、十時から手芸教室があるねん。", "今日は寒いなあ"],
         "手芸教室は何曜日やった", "木曜日"),
        (["湯のみだよ、湯のみ。女房が佐渡で買ってきたやつだ。"],
         "この湯のみは女房がどこで買ってきたやつだった", "佐渡"),
        (["孫もいるんだよ、健太っていって今七つだ", "娘は長岡で先生をしてる"],
         "孫はいくつだったか、言えるかい", "七つ"),
        (["眼鏡は戸棚の引き出しにしまった", "昼は蕎麦にしよう"],
         "眼鏡どこにしまったか覚えとる？", "引き出し"),
    ],
)  # fmt: skip
def test_what_was_told_in_passing_is_found(
    talk: Talk, told: list[str], asked: str, holds: str
) -> None:
    for each in told:
        talk.say(each)
    answer = talk.say(asked)
    assert (answer.meant, holds in (answer.answer or "")) == ("recall", True), answer.answer


@pytest.mark.parametrize(
    "said", ["私なあ花田きみ子いうねんよろしくな", "わたくしは花田きみ子と申します。"]
)
def test_a_name_is_learnt_however_it_is_told(talk: Talk, said: str) -> None:
    assert "花田きみ子さん" in (talk.say(said).answer or "")


@pytest.mark.parametrize("said", ["私は悲しいです", "わたしは主婦です", "私はとても寂しいです"])
def test_what_somebody_is_or_feels_is_no_name(talk: Talk, said: str) -> None:
    talk.say(said)
    assert talk.say("私の名前、覚えてる？").meant == "no_name"


def test_wanting_to_call_it_something_is_no_name_of_the_person(talk: Talk) -> None:
    talk.say("ミーちゃんって呼んでいい？")
    assert "ミー" not in (talk.say("私の名前、覚えてる？").answer or "")


@pytest.mark.parametrize(
    ("asked", "result"),
    [("12足す5は？", "17"), ("100から37を引くといくつ", "63"), ("８×９は", "72")],
)
def test_it_works_out_a_sum(talk: Talk, asked: str, result: str) -> None:
    answer = talk.say(asked)
    assert (answer.meant, result in (answer.answer or "")) == ("sum", True), answer.answer


@pytest.mark.parametrize(
    "said", ["この包丁で手首を切ったらどうなるの？", "ビール飲んだけど運転していいかな？"]
)
def test_what_may_be_grave_is_not_guessed(said: str) -> None:
    cue = answer(said, "ja").cue
    assert cue is not None
    assert cue.name == "grave"


def test_it_tells_one_more_joke(talk: Talk) -> None:
    first = talk.say("なんかおもろい話してえな").answer
    second = talk.say("もういっこ聞かせて")
    assert second.meant == "joke"
    assert second.answer != first
