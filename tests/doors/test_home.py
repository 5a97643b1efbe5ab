"""The door for homes, at a real Mosquitto, heard by Paho's client."""

import asyncio
import itertools
import json
import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import aiomqtt
import pytest
from tests.fixtures.broker import Listener, Mosquitto, at_home, start_broker
from tests.fixtures.gate import Clock
from tests.fixtures.live import PATIENT, block_the_right_arm, stays_stopped
from tests.fixtures.waiting import until

from miburi.client.remote import RemotePartner, connect
from miburi.doors.broker import find_broker
from miburi.doors.home import BIRTH, BURST, check_free
from miburi.doors.home_discovery import About, discovery, discovery_topic
from miburi.doors.topics import ALL, DistressNews, HomeReport, StopNews, Topics
from miburi.errors import InputError
from miburi.feelings import FEELINGS, EmotionalModel
from miburi.live.events.store import kept_events
from miburi.live.held import KeptHold
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.live.wishes import Release
from miburi.robot import JOINTS, Robot
from miburi.safety.stop import StopReason
from miburi.senses.kinds import KINDS

TOPICS, ABOUT = Topics("kitchen"), About("kitchen", "iphonoid")
#: What Home Assistant documents for the components of a device: needed and further keys.
SHARED = {"platform", "name", "unique_id", "availability_topic", "qos", "device_class", "icon",
          "entity_category", "value_template", "json_attributes_topic",
          "json_attributes_template"}  # fmt: skip
DOCUMENTED: dict[str, tuple[set[str], set[str]]] = {
    "sensor": ({"state_topic"}, {"options", "state_class", "unit_of_measurement"}),
    "binary_sensor": ({"state_topic"}, {"payload_on", "payload_off"}),
    "event": ({"state_topic", "event_types"}, set()),
    "text": ({"command_topic"}, {"min", "max", "mode", "pattern", "state_topic"}),
    "button": ({"command_topic"}, {"payload_press"}),
}


@pytest.fixture
def home(live: Runner, broker: Mosquitto, listener: Listener) -> Iterator[RemotePartner]:
    """The partner in the kitchen, over HTTP, once its home knows it."""
    ticks = itertools.count()  # so fast that no limit holds a report up
    clock = lambda: 1000.0 * next(ticks)  # noqa: E731
    with at_home(live, find_broker(f"127.0.0.1:{broker.port}"), clock) as server:
        listener.hear(TOPICS.available, lambda text: text == "online")
        with connect(server.url) as partner:
            yield partner


def hear_report(listener: Listener, wanted: Callable[[HomeReport], object]) -> HomeReport:
    def fits(text: str) -> object:
        return wanted(HomeReport.model_validate_json(text))

    return HomeReport.model_validate_json(listener.hear(TOPICS.report, fits))


def hear_refused(listener: Listener) -> dict[str, object]:
    refused = json.loads(listener.hear(TOPICS.refused))
    assert isinstance(refused, dict)
    return refused


def hear_refusal(listener: Listener) -> str:
    return str(hear_refused(listener)["why"])


@pytest.mark.parametrize("joints", [[], list(JOINTS)], ids=["simulated", "card"])
def test_what_it_says_of_itself_is_what_home_assistant_documents(joints: list[str]) -> None:
    message = discovery(ABOUT, joints)
    assert set(message) == {"device", "origin", "availability_topic", "qos", "components"}
    assert message["device"]["identifiers"]
    assert message["origin"]["name"]
    parts: dict[str, dict[str, Any]] = message["components"]
    for part in parts.values():
        needed, further = DOCUMENTED[part["platform"]]
        assert needed | {"platform", "unique_id"} <= set(part) <= SHARED | needed | further
    assert len({part["unique_id"] for part in parts.values()}) == len(parts)
    assert parts["feeling"]["options"] == [*FEELINGS, "neutral"]
    assert parts["stops"]["event_types"] == [*StopReason]
    assert parts["distress"]["event_types"] == [*KINDS]
    assert parts["say"]["max"] <= 255  # Home Assistant's own limit
    assert sum(part["platform"] == "button" for part in parts.values()) == len(FEELINGS) + 1
    templates = [part.get("value_template", "") for part in parts.values()]
    keys = re.findall(r"value_json\.([\w.]+)", " ".join(templates))
    known = {*HomeReport.model_fields, *(f"temperatures.{joint}" for joint in joints)}
    assert set(keys) <= known
    assert sum(key.startswith("temperatures.") for key in keys) == len(joints)


def test_a_home_finds_it_and_hears_what_it_feels(home: RemotePartner, listener: Listener) -> None:
    late = Listener(listener.port)  # retained messages reach later subscribers, too
    assert json.loads(late.hear(discovery_topic(ABOUT))) == discovery(ABOUT, [])
    late.close()
    listener.say(TOPICS.feel, '{"feeling": "anger", "strength": 1.0}')
    report = hear_report(listener, lambda report: report.feeling == "anger")
    assert 60 <= report.mood <= 100
    assert report.stopped is None
    listener.say(BIRTH, "online")  # Home Assistant has been started anew
    listener.hear(discovery_topic(ABOUT))
    hear_report(listener, lambda report: report.feeling == "anger")
    listener.say(TOPICS.available, "offline", retain=True)  # it puts right what others say
    listener.hear(TOPICS.available, lambda text: text == "offline")
    listener.hear(TOPICS.available, lambda text: text == "online")
    home.say("I fell and can't get up")
    news = DistressNews.model_validate_json(listener.hear(TOPICS.distress))
    assert (news.event_type, news.words) == ("fall", None), "none of the words"
    assert [one.id for one in home.log() if one.kind == "distress"] == [news.id]


def test_a_contact_is_told_with_its_motor_and_its_force(
    home: RemotePartner, listener: Listener
) -> None:
    block_the_right_arm(home)
    listener.say(TOPICS.feel, '{"feeling": "happiness", "strength": 1.0}')
    news = StopNews.model_validate_json(listener.hear(TOPICS.stops))
    assert news.event_type is StopReason.CONTACT
    assert news.motor in JOINTS
    assert news.force is not None
    assert news.force > 0
    report = hear_report(listener, lambda report: report.stopped is StopReason.CONTACT)
    assert report.motor == news.motor
    assert report.stops_today >= 1


def test_a_home_may_say_something_and_stop_it_and_cannot_release_it(
    home: RemotePartner, live: Runner, listener: Listener
) -> None:
    listener.say(TOPICS.say, "Welcome home! お帰りなさい。")
    spoken = until(lambda: home.state.spoken)
    assert spoken is not None
    assert spoken.text == "Welcome home! お帰りなさい。"
    listener.say(TOPICS.stop, "PRESS")
    assert hear_report(listener, lambda report: report.stopped is not None).held
    for topic in ("release", "resume", "stop", "feel", "say"):
        listener.say(f"miburi/kitchen/{topic}", '{"do": "release"}')
    stays_stopped(home)
    live.ask(Release(by_person=True)).result(60)
    hear_report(listener, lambda report: report.stopped is None)
    listener.say(Topics(ALL).stop)  # one word stops all
    assert hear_report(listener, lambda report: report.stopped).stopped is StopReason.ASKED


def test_wishes_that_make_no_sense_are_refused_in_words(
    home: RemotePartner, listener: Listener
) -> None:
    cases: list[tuple[str, str | bytes, str]] = [
        (TOPICS.feel, '{"feeling": "boredom"}', "feeling: Input should be 'happiness'"),
        (TOPICS.feel, "happiness", "Invalid JSON"),
        (TOPICS.feel, b"\xff\xfe", "must be UTF-8"),
        (TOPICS.feel, '{"feeling": "fear", "strength": 7}', "less than or equal to 1"),
        (TOPICS.say, "", "at least 1"),
        (TOPICS.say, "x" * 5000, "at most 300"),
        (TOPICS.say, "お" * 5000, "at most 300"),
        (TOPICS.say, b"\xff\xfe", "must be UTF-8"),
        (TOPICS.say, "Kill yourself", "refuses to say this"),
    ]
    for topic, wish, words in cases:
        listener.say(topic, wish)
        assert words in hear_refusal(listener), wish


def test_too_many_wishes_are_refused_and_counted_and_no_other_kind_is(
    live: Runner, broker: Mosquitto, listener: Listener
) -> None:
    """Refusals are rate-limited, too, so that people can read them."""
    clock, flood = Clock(), 100
    with at_home(live, find_broker(f"127.0.0.1:{broker.port}"), clock):
        listener.hear(TOPICS.available, lambda text: text == "online")
        for _ in range(int(BURST)):
            listener.say(TOPICS.feel, '{"feeling": "fear", "strength": 0.1}')
        for _ in range(flood):
            listener.say(TOPICS.feel, "nonsense")
        listener.say(TOPICS.say, "Hello.")
        listener.say(TOPICS.stop)
        heard = [hear_refused(listener)]
        hear_report(listener, lambda report: report.stopped is StopReason.ASKED)
        clock.now = 1.0  # the rest is told without another refusal
        heard.append(hear_refused(listener))
        assert live.snapshot.state.spoken is not None
        assert live.snapshot.state.spoken.text == "Hello."
    about = {"topic": TOPICS.feel, "why": "too many wishes at once."}
    assert heard == [about | {"unsaid": 0}, about | {"unsaid": flood - 2}]
    assert sum(entry.kind == "stimulus" for entry in live.history.after(0)) == BURST


@pytest.mark.proof("test_a_home_finds_it_and_hears_what_it_feels")
def test_a_name_that_is_taken_is_refused_and_a_free_one_proposed(
    home: RemotePartner,
    broker: Mosquitto,
    listener: Listener,
    live: Runner,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Two with one name threw each other out for ever, and Stop reached one of them."""
    here = find_broker(f"127.0.0.1:{broker.port}")
    with pytest.raises(InputError, match="'kitchen' at .* such as --name kitchen-2"):
        asyncio.run(check_free(here, "kitchen"))
    asyncio.run(check_free(here, "hall"))
    asyncio.run(check_free(find_broker("127.0.0.1:9"), "kitchen"))  # nobody to ask is no hindrance
    with at_home(live, here):  # another door of the same name
        until(lambda: "has taken the name 'kitchen'" in capsys.readouterr().err)
        for _ in range(10):
            listener.say(TOPICS.stop)
            hear_report(listener, lambda report: report.stopped is StopReason.ASKED)
            live.ask(Release(by_person=True)).result(60)
            hear_report(listener, lambda report: report.stopped is None)


def test_a_wish_of_another_day_is_left_out(live: Runner, broker: Mosquitto) -> None:
    listener = Listener(broker.port)
    listener.say(TOPICS.stop, "PRESS", retain=True)
    with at_home(live, find_broker(f"127.0.0.1:{broker.port}")):
        listener.hear(TOPICS.available, lambda text: text == "online")
        report = hear_report(listener, lambda report: True)
        listener.say(TOPICS.feel, "wrong")  # what comes after it has been looked at
        hear_refusal(listener)
        assert report.stopped is None
        assert live.snapshot.state.stop is None
    listener.hear(TOPICS.available, lambda text: text == "offline")  # it has said good-bye
    listener.close()


def test_a_stop_while_the_broker_was_away_is_told_when_it_is_back(
    home: RemotePartner,
    broker: Mosquitto,
    listener: Listener,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    connect, failed = aiomqtt.Client.__aenter__, []

    async def counted(client: aiomqtt.Client) -> aiomqtt.Client:
        try:
            return await connect(client)
        except aiomqtt.MqttError as error:
            failed.append(error)
            raise

    monkeypatch.setattr(aiomqtt.Client, "__aenter__", counted)
    broker.kill()
    home.stop()
    until(lambda: home.state.stop)
    # The partner waits for 4 s after its second try, so that the listener is there before it.
    until(lambda: len(failed) >= 2)
    broker.start()  # it has forgotten everything
    heard = {}
    while len(heard) < 2:
        listener.hear(TOPICS.available, lambda text: text == "online")
        heard["stop"] = StopNews.model_validate_json(listener.hear(TOPICS.stops))
        heard["report"] = hear_report(listener, lambda report: report.stopped)
    assert heard["stop"].event_type is StopReason.ASKED
    assert heard["report"].stops_today == 1


def test_a_stop_that_outlasts_a_restart_is_told_once(
    robot: Robot, tmp_path: Path, broker: Mosquitto, listener: Listener
) -> None:
    def told() -> str:
        return StopNews.model_validate_json(listener.hear(TOPICS.stops)).id

    def woken() -> Runner:
        hold, events = KeptHold(tmp_path / "stopped.txt"), kept_events(tmp_path)
        feelings, archive = EmotionalModel(), Archive(tmp_path)
        runner = Runner(robot, feelings, archive, hold=hold, events=events, lateness=PATIENT)
        runner.start()
        return runner

    here = find_broker(f"127.0.0.1:{broker.port}")
    first = woken()
    with at_home(first, here):
        listener.hear(TOPICS.available, lambda text: text == "online")
        first.stop()
        assert told().startswith(first.history.boot)
    first.close(patience=0.0)
    second = woken()
    with at_home(second, here):
        listener.hear(TOPICS.available, lambda text: text == "online")
        assert hear_report(listener, lambda report: report.held).stops_today == 0
        second.ask(Release(by_person=True)).result(60)
        hear_report(listener, lambda report: not report.held)
        second.stop()
        heard = told()
        assert heard == [e.id for e in second.history.after(0) if e.kind == "stop"][-1]
    second.close(patience=0.0)


def test_a_stop_that_the_broker_takes_at_the_second_try_counts_once(
    home: RemotePartner, listener: Listener, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish, tries = aiomqtt.Client.publish, itertools.count()

    async def fail_once(client: aiomqtt.Client, topic: str, *content: Any, **how: Any) -> None:
        if topic == TOPICS.stops and next(tries) == 0:
            raise aiomqtt.MqttError("gone")
        await publish(client, topic, *content, **how)

    monkeypatch.setattr(aiomqtt.Client, "publish", fail_once)
    home.stop()
    listener.hear(TOPICS.stops)
    assert hear_report(listener, lambda report: report.stops_today).stops_today == 1


@pytest.mark.proof("test_a_home_finds_it_and_hears_what_it_feels")
def test_a_password_and_tls(live: Runner, tmp_path: Path) -> None:
    ca, key = tmp_path / "ca.pem", tmp_path / "key.pem"
    make_certificate(ca, key)
    users = tmp_path / "users"
    users.touch(mode=0o600)
    subprocess.run(["mosquitto_passwd", "-b", users, "robin", "secret"], check=True)
    options = f"cafile {ca}\ncertfile {ca}\nkeyfile {key}\npassword_file {users}\nuser root"
    broker = start_broker(tmp_path, options)

    def prepare(client: Any) -> None:
        client.tls_set(str(ca))
        client.username_pw_set("robin", "secret")

    secret = tmp_path / "secret"
    secret.write_text("secret\n")
    right = find_broker(
        f"mqtts://robin@127.0.0.1:{broker.port}", ca, {"MIBURI_BROKER_PASSWORD_FILE": str(secret)}
    )
    listener = Listener(broker.port, prepare)
    with at_home(live, right):
        listener.hear(TOPICS.available, lambda text: text == "online")
    listener.close()
    broker.kill()


def make_certificate(ca: Path, key: Path) -> None:
    """Write a certificate for this computer that signs itself, and its key."""
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", key, "-out", ca,
         "-days", "2", "-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"],
        check=True, capture_output=True,
    )  # fmt: skip
    key.chmod(0o644)
