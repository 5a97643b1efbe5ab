"""The door for laboratories, heard over DDS by a process that shares no line with ours."""

import json
import math
import time
from collections.abc import Callable, Iterator
from functools import cache

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore
from tests.fixtures.gate import Clock
from tests.fixtures.live import block_the_right_arm, stays_stopped
from tests.fixtures.ros import DOMAIN, PATIENCE, TAG, Peer, Told, in_ros
from tests.fixtures.ros_peer import EXPRESSION
from tests.fixtures.waiting import until

from miburi.client.remote import RemotePartner, connect
from miburi.doors import ros_types
from miburi.doors.ros import BURST
from miburi.doors.ros_messages import PLACES, diagnose
from miburi.doors.ros_network import RosNetwork, find_ros
from miburi.errors import InputError
from miburi.feelings import FEELINGS, Expression, Stimulus
from miburi.live.runner import STEP, Runner
from miburi.live.stamps import LATE, Stamps
from miburi.live.wishes import Release
from miburi.robot import JOINTS, Robot, forward
from miburi.robot.urdf import to_urdf

JOINT_STATE = "sensor_msgs/msg/JointState"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
DIAGNOSES = "diagnostic_msgs/msg/DiagnosticArray"
STRING = "std_msgs/msg/String"
EMPTY = "std_msgs/msg/Empty"
NODES = "rmw_dds_common/msg/ParticipantEntitiesInfo"
EXPRESSED = "hri_msgs/msg/Expression"
OK, WARNING, ERROR, STALE = range(4)


@pytest.fixture
def door(live: Runner) -> Iterator[RemotePartner]:
    """The partner over HTTP, once its door is open."""
    with in_ros(live) as server, connect(server.url) as partner:
        yield partner


def stamp(header: Told) -> int:
    return int(header["stamp"]["sec"]) * 10**9 + int(header["stamp"]["nanosec"])


def hear_stop(peer: Peer, wanted: Callable[[dict[str, str]], object]) -> Told:
    """The next diagnosis of the contact stop whose values are as wanted."""

    def fits(message: Told) -> object:
        return wanted(values(message["status"][0]))

    first: Told = peer.hear("/diagnostics", fits)["status"][0]
    return first


def values(status: Told) -> dict[str, str]:
    return {one["key"]: one["value"] for one in status["values"]}


def hear_refusal(peer: Peer, topic: str = "") -> tuple[str, str]:
    """Return topic and reason of the next refusal, or of the next on a topic."""
    heard = peer.hear("/refused", lambda one: topic in json.loads(one["data"])["topic"])
    told = json.loads(heard["data"])
    return told["topic"], told["why"]


@cache
def roses() -> Typestore:
    """ROS's own definitions."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(EXPRESSION, EXPRESSED))
    return store


def test_each_message_is_defined_as_ros_defines_it() -> None:
    ours = get_typestore(Stores.EMPTY)
    kinds = [kind for name, kind in vars(ros_types).items() if name.endswith("Msg")]
    assert len(kinds) > 10
    for kind in kinds:
        ours.register(get_types_from_msg(ros_types.definition(kind), ros_types.ros_name(kind)))
    for message, (_, fields) in ours.fielddefs.items():
        assert roses().fielddefs[message][1] == fields
        assert ours.hash_rihs01(message) == roses().hash_rihs01(message)


@pytest.mark.proof("test_each_step_publishes_joints_and_the_frames_that_place_the_hands")
def test_ros_lists_it_as_a_node_with_its_topics_and_their_types(
    door: RemotePartner, peer: Peer
) -> None:
    """What `ros2 node list`, `node info` and `topic info -v` are made of."""
    peer.listen("ros_discovery_info", NODES, kept=True)
    told = peer.hear("ros_discovery_info", lambda one: one["node_entities_info_seq"])
    (node,) = told["node_entities_info_seq"]
    assert (node["node_namespace"], node["node_name"]) == ("/", "miburi")
    for name, kind, sort in (
        ("joint_states", JOINT_STATE, "writer"), ("tf", TRANSFORMS, "writer"),
        ("stop", EMPTY, "reader"), ("robot_face/expression", EXPRESSED, "reader"),
    ):  # fmt: skip
        found = peer.look(f"rt/{name}")
        assert found["data"] == f"typehash={roses().hash_rihs01(kind)};"
        assert {"data": found["gid"]} in node[f"{sort}_gid_seq"]
        assert found["gid"][:12] == told["gid"]["data"][:12]


def test_each_step_publishes_joints_and_the_frames_that_place_the_hands(
    door: RemotePartner, peer: Peer, robot: Robot
) -> None:
    peer.listen("/joint_states", JOINT_STATE)
    heard = [peer.hear("/joint_states") for _ in range(60)]
    stamps = np.array([stamp(message["header"]) for message in heard])
    assert all(message["name"] == list(JOINTS) for message in heard)
    assert all(len(message["position"]) == len(message["velocity"]) == 8 for message in heard)
    assert not any(message["effort"] for message in heard)
    ways = np.diff(stamps)
    assert np.median(ways) == round(STEP * 1e9)  # 50 Hz, by the body's clock
    assert ways.min() > 0
    assert stamps[-1] <= Stamps().now() < stamps[-1] + 60e9
    peer.listen("/robot_description", STRING, kept=True)  # it comes late
    assert peer.hear("/robot_description")["data"] == to_urdf(robot)
    peer.listen("/tf_static", TRANSFORMS, kept=True)
    fixed = peer.hear("/tf_static")["transforms"]
    peer.listen("/tf", TRANSFORMS)
    peer.hear("/tf")
    door.stimulate(Stimulus("happiness", 1.0, "speech"))
    # On a busy computer either topic may lose messages: take any moment of which both tell.
    places, frames = dict[int, Told](), dict[int, Told]()
    end = time.monotonic() + PATIENCE
    while not (both := places.keys() & frames.keys()):
        assert time.monotonic() < end, f"{len(places)} and {len(frames)} with no time in common"
        topic, message = peer.next()
        if topic == "/tf":
            frames[stamp(message["transforms"][0]["header"])] = message
        elif topic == "/joint_states" and abs(message["position"][1]) > 0.5:
            places[stamp(message["header"])] = message
    moved, moving = (told[min(both)] for told in (places, frames))
    parents = {
        one["child_frame_id"]: (one["header"]["frame_id"], one["transform"])
        for one in [*fixed, *moving["transforms"]]
    }
    expected = forward(robot, np.array(moved["position"])).reshape(3, 3)
    for name, place in zip(("right", "left", "head_centre"), expected, strict=True):
        assert where(parents, name) == pytest.approx(place, abs=1e-6)


def where(parents: dict[str, tuple[str, Told]], frame: str) -> np.ndarray:
    """Where a frame is on the base, m."""
    place = np.zeros(3)
    while frame != "base_link":
        frame, transform = parents[frame]
        x, y, z, w = (transform["rotation"][axis] for axis in "xyzw")
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        place = turn @ place + [transform["translation"][axis] for axis in "xyz"]
    return place


def test_a_contact_is_told_with_its_motor_and_its_force(door: RemotePartner, peer: Peer) -> None:
    peer.listen("/diagnostics", DIAGNOSES)
    calm = peer.hear("/diagnostics")
    assert calm["status"][0] | {"values": []} == {
        "level": OK,
        "name": "miburi: contact stop",
        "message": "not stopped",
        "hardware_id": "simulated",
        "values": [],
    }
    assert [one["name"] for one in calm["status"][1:]] == [f"miburi: {j}" for j in JOINTS]
    block_the_right_arm(door)
    door.stimulate(Stimulus("happiness", 1.0, "speech"))
    told = hear_stop(peer, lambda values: float(values.get("force_N", 0)) > 0)
    stop = values(told)
    assert stop["reason"] == "contact"
    assert stop["motor"] in JOINTS
    assert (told["level"], told["message"]) == (
        WARNING, f"stopped: contact at {stop['motor']}"
    )  # fmt: skip


def test_a_wish_is_felt_said_and_shown(door: RemotePartner, peer: Peer) -> None:
    peer.listen("/expression", EXPRESSED, kept=True)
    peer.say("/feel", STRING, {"data": '{"feeling": "anger", "strength": 1.0}'})
    told = peer.hear("/expression", lambda message: message["expression"] == "angry")
    length = math.hypot(told["valence"], told["arousal"])
    _, valence, arousal = PLACES["anger"]
    assert told["valence"] / length == pytest.approx(valence / math.hypot(valence, arousal))
    assert 0.3 < length < math.hypot(valence, arousal)
    peer.say("/say", STRING, {"data": "Welcome! お帰りなさい。"})
    spoken = until(lambda: door.state.spoken)
    assert spoken is not None
    assert spoken.text == "Welcome! お帰りなさい。"
    peer.say("/robot_face/expression", EXPRESSED, {"expression": "surprised"})
    peer.hear("/expression", lambda message: message["expression"] == "surprised")
    peer.say("/robot_face/expression", EXPRESSED, {"valence": -0.3, "arousal": -0.2})
    told = peer.hear("/expression", lambda message: message["expression"] == "sad")
    (sad,) = [
        entry
        for entry in door.log()
        if entry.kind == "gesture_begun" and entry.feeling == "sadness"
    ]
    assert sad.mood == pytest.approx(math.hypot(0.3, 0.2))
    for strength in (0.1, 0.2, 0.3):  # of several wishes at once, the latest is taken
        peer.say("/feel", STRING, {"data": f'{{"feeling": "fear", "strength": {strength}}}'})
    until(
        lambda: [one.strength for one in door.log() if one.feeling == "fear" and one.strength],
        lambda felt: felt and felt[-1] == 0.3,
    )


def test_ros_may_stop_it_and_cannot_release_it(
    door: RemotePartner, live: Runner, peer: Peer
) -> None:
    peer.listen("/diagnostics", DIAGNOSES)
    peer.say("/stop", EMPTY)
    told = hear_stop(peer, lambda values: values.get("reason") == "asked")
    assert values(told)["held"] == "True"
    peer.say("/stop", EMPTY)
    for data in ('{"do": "release"}', '{"feeling": "happiness"}'):
        peer.say("/feel", STRING, {"data": data})
    peer.listen("/refused", STRING)
    peer.say("/robot_face/expression", EXPRESSED, {"expression": "disgusted"})
    assert "until a person releases it" in hear_refusal(peer, "/robot_face/expression")[1]
    stays_stopped(door)
    live.ask(Release(by_person=True)).result(60)
    hear_stop(peer, lambda values: "reason" not in values)
    assert "disgust" not in {entry.feeling for entry in door.log()}


@pytest.mark.proof("test_a_wish_is_felt_said_and_shown")
def test_neutral_ends_what_it_performs(door: RemotePartner, live: Runner, peer: Peer) -> None:
    def told(kind: str) -> bool:
        events = live.history.after(0)
        return any((one.kind, one.feeling) == (kind, "sadness") for one in events)

    neutral = {"expression": "neutral"}
    peer.say("/robot_face/expression", EXPRESSED, neutral)  # it has found the topic now
    until(lambda: any(one.kind == "performance_ended" for one in live.history.after(0)))
    door.express(Expression("sadness", 0.9))
    until(lambda: told("gesture_begun"))
    peer.say("/robot_face/expression", EXPRESSED, neutral)
    until(lambda: told("gesture_broken_off"))


def test_wishes_that_make_no_sense_or_are_too_many_are_refused_in_words(
    live: Runner, peer: Peer
) -> None:
    cases: list[tuple[str, str, Told, str]] = [
        ("/feel", STRING, {"data": '{"feeling": "boredom"}'}, "feeling: Input should be 'happi"),
        ("/feel", STRING, {"data": "happiness"}, "Invalid JSON"),
        ("/feel", STRING, {"data": '{"feeling": "fear", "strength": 7}'}, "less than or equal"),
        ("/feel", STRING, {"data": '{"feeling": "fear"' + " " * 9000 + "}"}, "Invalid JSON"),
        ("/say", STRING, {"data": ""}, "at least 1"),
        ("/say", STRING, {"data": "x" * 5000}, "at most 300"),
        (
            "/robot_face/expression",
            EXPRESSED,
            {"expression": "bored"},
            "it can show neutral, happy",
        ),
        ("/robot_face/expression", EXPRESSED, {}, "it can show neutral, happy"),
        ("/robot_face/expression", EXPRESSED, {"valence": math.nan}, "from -1 to 1"),
        ("/robot_face/expression", EXPRESSED, {"expression": "sad", "arousal": 9.0}, "-1 to 1"),
    ]
    clock = Clock()
    with in_ros(live, clock=clock):
        peer.listen("/refused", STRING)
        for topic, kind, message, words in cases:
            clock.now += 1.0
            peer.say(topic, kind, message)
            said_of, why = hear_refusal(peer)
            assert (said_of, words in why) == (topic, True), (message, why)
        assert {entry.kind for entry in live.history.after(0)} <= {
            "started",
            "gesture_begun",
            "gesture_ended",
        }

        def wish() -> bool:
            peer.say("/feel", STRING, {"data": '{"feeling": "fear", "strength": 0.1}'})
            return peer.has_heard()

        clock.now += 60.0
        until(wish)
        assert hear_refusal(peer) == ("/feel", "too many wishes at once.")
        assert sum(entry.kind == "stimulus" for entry in live.history.after(0)) == BURST
        peer.listen("/diagnostics", DIAGNOSES)
        peer.say("/stop", EMPTY)  # no limit holds it up
        hear_stop(peer, lambda values: values.get("reason") == "asked")


@pytest.mark.proof("test_wishes_that_make_no_sense_or_are_too_many_are_refused_in_words")
def test_bytes_that_are_no_message_are_refused_and_change_nothing(
    door: RemotePartner, peer: Peer
) -> None:
    peer.listen("/refused", STRING)
    for data in (b"\xff\xfe\0", b"\xc3\0"):
        peer.garble("/feel", data)
        assert "cannot be read" in hear_refusal(peer)[1]
    peer.garble("/feel", b'{"feeling": "fear"}\0')  # the next that makes sense is taken
    until(lambda: any(entry.kind == "stimulus" for entry in door.log()))


@pytest.mark.proof("test_ros_may_stop_it_and_cannot_release_it")
def test_a_peer_that_takes_nothing_holds_up_nobody(live: Runner, peer: Peer) -> None:
    """With room for few messages, a write would wait for its reader; none may."""
    marks = "<WhcLow>1 kB</WhcLow><WhcHigh>2 kB</WhcHigh><WhcHighInit>2 kB</WhcHighInit>"
    small = f"<Internal><Watermarks>{marks}</Watermarks></Internal>"
    more = f"{TAG},<CycloneDDS><Domain>{small}</Domain></CycloneDDS>"
    with in_ros(live, RosNetwork(DOMAIN, more=more)) as server, connect(server.url) as partner:
        peer.listen("/joint_states", JOINT_STATE)
        peer.listen("/tf", TRANSFORMS)
        peer.hear("/joint_states")
        peer.hear("/tf")
        then = last = partner.state.time
        peer.freeze()
        for state in partner.watch(10):
            assert (
                state.time < last + 3
            )  # a write that waits takes 10 s, until it gives the peer up
            if (last := state.time) > then + 4:
                break


@pytest.mark.proof("test_each_step_publishes_joints_and_the_frames_that_place_the_hands")
def test_partners_in_one_network_have_names_of_their_own(live: Runner, peer: Peer) -> None:
    with in_ros(live, RosNetwork(DOMAIN, name="kitchen_1", more=TAG)) as server:
        peer.listen("/kitchen_1/joint_states", JOINT_STATE)
        peer.hear("/kitchen_1/joint_states")
        peer.listen("/tf", TRANSFORMS)
        first = peer.hear("/tf")["transforms"][0]
        assert (first["header"]["frame_id"], first["child_frame_id"]) == (
            "kitchen_1/base_link", "kitchen_1/torso"
        )  # fmt: skip
        peer.listen("/diagnostics", DIAGNOSES)
        assert peer.hear("/diagnostics")["status"][0]["name"] == "kitchen_1: contact stop"
        peer.say("/kitchen_1/stop", EMPTY)
        with connect(server.url) as partner:
            until(lambda: partner.state.stop)


def test_a_partner_that_cannot_be_reached_is_said_to_be_stale(runner: Runner) -> None:
    assert len({PLACES[feeling].word for feeling in FEELINGS}) == len(PLACES) == len(FEELINGS)
    runner.tick()
    (stop, *motors) = diagnose(RosNetwork(), 0, None, runner.motors).status
    assert (stop.level, stop.message) == (STALE, "the robot cannot be reached")
    assert len(motors) == len(JOINTS)


def test_stamps_follow_the_body_and_never_go_back_nor_ahead() -> None:
    now = 1_000_000_000_000
    stamps = Stamps(lambda: now)
    assert stamps.of(5.0) == now
    now += 25_000_000  # it was seen a little late
    assert stamps.of(5.02) == now - 5_000_000
    now += 10_000_000  # and the next a little early
    assert stamps.of(5.04) == now
    now += 20_000_000 + LATE + 1  # the body's time has waited
    assert stamps.of(5.06) == now
    now += 20_000_000
    assert stamps.of(0.02) == now  # another body


RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"


@pytest.mark.parametrize(
    ("variables", "domain", "everywhere"),
    [
        ({}, 0, False),
        ({"ROS_DOMAIN_ID": "7"}, 7, False),
        ({RANGE: "SUBNET"}, 0, True),
        ({RANGE: "LOCALHOST"}, 0, False),
        ({RANGE: "SUBNET", "ROS_LOCALHOST_ONLY": "1"}, 0, False),
    ],
)
def test_where_ros_is_stands_in_its_own_variables(
    variables: dict[str, str], domain: int, everywhere: bool
) -> None:
    network = find_ros(None, variables)
    assert (network.domain, network.everywhere) == (domain, everywhere)
    assert ("127.0.0.1" in network.config) is not everywhere


@pytest.mark.parametrize(
    ("name", "variables", "words"),
    [
        (None, {"ROS_DOMAIN_ID": "233"}, "0 to 232, got '233'"),
        (None, {"ROS_DOMAIN_ID": "-1"}, "0 to 232, got '-1'"),
        (None, {RANGE: "OFF"}, "LOCALHOST or SUBNET, got 'OFF'"),
        ("3cpo", {}, "begins with a letter, got '3cpo'"),
    ],
)
def test_what_ros_does_not_take_is_refused(
    name: str | None, variables: dict[str, str], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        find_ros(name, variables)
