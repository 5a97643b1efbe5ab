"""The answer to a remark, as a pydantic model that OpenAPI describes."""

from pydantic import BaseModel, Field

from miburi.feelings.catalogue import TheirFeeling
from miburi.feelings.temperament import Source
from miburi.live.state import Share
from miburi.senses.kinds import Distress


class WhyOut(BaseModel):
    """A word, and the evidence in it for the feeling (log-odds relative to no feeling)."""

    what: str = Field(description="The word.")
    weight: float = Field(description="How strongly it indicated the feeling.")


class FeltOut(BaseModel):
    """What moved the partner's feelings."""

    feeling: TheirFeeling = Field(description="The feeling that was moved.")
    strength: Share = Field(description="By how much, before the temperament scales it.")
    source: Source = Field(description="What it came from.")


class SayOut(BaseModel):
    """The feeling heard in a remark, the evidence for it, and the partner's own feeling."""

    feeling: TheirFeeling | None = Field(description="The feeling that was heard; null: none.")
    strength: Share = Field(description="How likely it is; 0 without a feeling.")
    why: list[WhyOut] = Field(description="What spoke for it.")
    felt: list[FeltOut] = Field(description="What the partner then felt.")
    asked: bool = Field(default=False, description="Whether it was asked how it feels.")
    meant: str | None = Field(
        default=None, description="The intent of what was said, such as `time`, `wave` or `thanks`."
    )
    distress: Distress | None = Field(
        default=None,
        description="What somebody needs help with now. The partner does not call for help.",
    )
    worry: Distress | None = Field(
        default=None, description="What somebody may need help with; the answer asks about it."
    )
    answer: str = Field(
        description="The partner's answer; it is spoken on pages whose voice is on."
    )
    trouble: str | None = Field(
        default=None, description="Why the language model of `--talk` did not answer this."
    )
