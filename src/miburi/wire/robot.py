"""The robot's description as programs read it."""

from pydantic import BaseModel, Field

from miburi.live.events.event import Wall
from miburi.live.state import Eight


class LinkOut(BaseModel):
    """A rigid link: its parent, and the joint that turns it."""

    name: str = Field(description="Its name.")
    parent: str = Field(description="The link that carries it.")
    joint: str = Field(description="The joint that turns it.")
    position: list[float] = Field(description="The joint's place on the parent, m.")
    axis: list[float] = Field(description="The joint's axis.")


class PartOut(BaseModel):
    """A solid on a link."""

    link: str = Field(description="The link that it belongs to.")
    name: str = Field(description="Its name.")
    kind: str = Field(description="Its shape.")
    size: list[float] = Field(description="Its sizes, m.")
    position: list[float] = Field(description="Its place on the link, m.")
    end: list[float] | None = Field(description="A capsule's other end, m.")
    tilt: float = Field(description="Its rotation about the y axis, rad.")
    colour: list[float] = Field(description="Red, green, blue, 0 to 1.")


class RobotOut(BaseModel):
    """The robot's description, from which a viewer can draw it."""

    name: str = Field(description="Its name.")
    joints: list[str] = Field(description="The joints' names, in the order used in every array.")
    feelings: list[str] = Field(
        description="The feelings' names, in the order used in every list of levels."
    )
    sources: list[str] = Field(description="What a stimulus may come from.")
    temperaments: list[str] = Field(description="The temperaments to choose from.")
    neutral: Eight = Field(description="The neutral pose, rad.")
    lower: Eight = Field(description="The joints' lower limits, rad.")
    upper: Eight = Field(description="The joints' upper limits, rad.")
    floor: float = Field(description="Height of the table, m.")
    threshold: float = Field(
        description="The contact rule's limit on the ratio of measured to expected travel."
    )
    hand: list[float] = Field(description="The human hand: radius and half length, m.")
    hand_away: list[float] = Field(description="Where the human hand waits, m.")
    links: list[LinkOut] = Field(description="The links.")
    parts: list[PartOut] = Field(description="The solids on them.")
    version: str | None = Field(default=None, description="The version of Miburi that runs.")
    since: Wall | None = Field(default=None, description="When it began to run, UTC.")
