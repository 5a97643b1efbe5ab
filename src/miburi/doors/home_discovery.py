"""The MQTT discovery message with a partner's buttons and events for Home Assistant."""

from dataclasses import dataclass
from typing import Any

from miburi.doors.topics import NEUTRAL, Topics
from miburi.errors import InputError
from miburi.feelings import FEELINGS
from miburi.feelings.catalogue import CATALOGUE
from miburi.safety.stop import StopReason
from miburi.senses.kinds import KINDS
from miburi.version import __version__
from miburi.wire.messages import StimulusIn

#: The greatest length of an incoming command, in bytes.
_LONGEST = 4_000

_WHY_STOPPED = (
    "{{ {'reason': value_json.stopped, 'motor': value_json.motor, 'held': value_json.held} "
    "| tojson }}"
)


@dataclass(frozen=True)
class About:
    """A partner's identity for Home Assistant."""

    name: str  # ``GROUP/NAME`` if it is in a group
    model: str  # the robot's name
    studio: str | None = None  # its studio's address, if other devices can reach it

    @property
    def key(self) -> str:
        """The name with ``.`` for ``/``, as identifiers need."""
        return self.name.replace("/", ".")


def text_of(payload: object) -> str:
    """Return a payload's text, cut to the greatest length so that no more than that is parsed.

    Raises InputError if it is not UTF-8.
    """
    raw = payload if isinstance(payload, bytes) else b""
    if len(raw) > _LONGEST:  # the cut may fall within a character
        return raw[:_LONGEST].decode(errors="replace")
    try:
        return raw.decode()
    except UnicodeDecodeError as error:
        raise InputError("the text must be UTF-8.") from error


def discovery_topic(about: About) -> str:
    """Return the topic of a partner's discovery message."""
    group, _, name = about.name.rpartition("/")
    return f"homeassistant/device/{group + '/' if group else ''}miburi-{name}/config"


def discovery(about: About, joints: list[str]) -> dict[str, Any]:
    """Return the message that describes a partner to Home Assistant.

    The motors of ``joints`` report a temperature. The keys are those of Home Assistant's MQTT
    device discovery (2024.11 and later).
    """
    topics, key = Topics(about.name), f"miburi_{about.key}"

    def part(what: str, platform: str, label: str, **more: Any) -> dict[str, Any]:
        return {"platform": platform, "name": label, "unique_id": f"{key}_{what}", **more}

    def read(what: str) -> dict[str, str]:
        template = f"{{{{ value_json.{what} }}}}"
        return {"state_topic": topics.report, "value_template": template}

    stopped = "{{ 'ON' if value_json.stopped else 'OFF' }}"
    parts = {
        "feeling": part(
            "feeling", "sensor", "Feeling", **read("feeling"),
            device_class="enum", options=[*FEELINGS, NEUTRAL],
        ),
        "mood": part(
            "mood", "sensor", "Mood", **read("mood"),
            unit_of_measurement="%", state_class="measurement",
        ),
        "stopped": part(
            "stopped", "binary_sensor", "Stopped",
            state_topic=topics.report, value_template=stopped, device_class="problem",
            json_attributes_topic=topics.report, json_attributes_template=_WHY_STOPPED,
        ),
        "stops": part(
            "stops", "event", "Stop", state_topic=topics.stops, event_types=[*StopReason],
        ),
        "distress": part(
            "distress", "event", "Distress", state_topic=topics.distress, event_types=[*KINDS],
        ),
        "stops_today": part(
            "stops_today", "sensor", "Stops today", **read("stops_today"),
            state_class="total_increasing",
        ),
        "say": part("say", "text", "Say", command_topic=topics.say, min=1, max=255),
        "stop": part("stop", "button", "Stop", command_topic=topics.stop),
    }  # fmt: skip
    for feeling in CATALOGUE.feeling:
        wish = StimulusIn(feeling=feeling.name).model_dump_json()
        label = f"Feel {feeling.words['en']}"
        parts[f"feel_{feeling.name}"] = part(
            f"feel_{feeling.name}", "button", label, command_topic=topics.feel, payload_press=wish
        )
    for joint in joints:
        what = f"temperature_{joint}"
        parts[what] = part(
            what, "sensor", f"Temperature of {joint.replace('_', ' ')}",
            **read(f"temperatures.{joint}"), device_class="temperature",
            unit_of_measurement="°C", state_class="measurement", entity_category="diagnostic",
        )  # fmt: skip
    device = {
        "identifiers": [key],
        "name": f"Miburi {about.name}",
        "manufacturer": "Miburi",
        "model": about.model,
        "sw_version": __version__,
    }
    if about.studio is not None:
        device["configuration_url"] = about.studio
    return {
        "device": device,
        "origin": {"name": "miburi", "sw_version": __version__},
        "availability_topic": topics.available,
        "qos": 1,
        "components": parts,
    }
