"""Replies to a feeling, by the feeling that was heard and the partner's own."""

from typing import Annotated, Literal, Self

from pydantic import Field, RootModel, model_validator

from miburi.feelings.catalogue import FeelingName
from miburi.talk.cue import Line

__all__ = ["Answers", "Lines"]

Lines = Annotated[list[Line], Field(min_length=2)]


class Answers(
    RootModel[
        dict[
            FeelingName | Literal["none", "any", "asked"],
            dict[FeelingName | Literal["any"], Lines],
        ]
    ]
):
    """Sentences by the feeling that was heard, then by what the partner feels."""

    @model_validator(mode="after")
    def _check_complete(self) -> Self:
        missing = [name for name in ("none", "any", "asked") if name not in self.root]
        missing += [f"{heard}.any" for heard, row in self.root.items() if "any" not in row]
        if missing:
            raise ValueError(f"{', '.join(missing)} is missing; it answers what has no other row")
        for heard, row in self.root.items():
            for felt, lines in row.items():
                if len(set(lines)) < len(lines):
                    raise ValueError(f"{heard}.{felt} has a sentence twice; keep one")
        return self

    def lines(self, heard: str | None, felt: str | None) -> list[str]:
        """Return the sentences for the feeling heard and the one felt; either may be None."""
        row = self.root.get(heard or "none", self.root["any"])
        return row.get(felt or "any", row["any"])
