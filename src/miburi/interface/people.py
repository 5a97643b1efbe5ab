"""The people the partner knows: here a person can see, correct, export and delete everything."""

from collections.abc import Callable
from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Path
from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from miburi.feelings import FEELINGS
from miburi.feelings.catalogue import TheirFeeling
from miburi.interface.refusing import NO_ROOM, NOTHING, Refusals
from miburi.languages import language_of
from miburi.people import Acquaintance, Memory
from miburi.talk.beginning import Beginning
from miburi.talk.dates import due_of
from miburi.talk.initiative import Manners
from miburi.wire.messages import Message

_REFUSED: Refusals = {
    400: {"description": "There is no such person or fact, or the value is not allowed."},
    **NO_ROOM,
}
_Name = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=40)]
_NamePath = Annotated[str, Path(min_length=1, max_length=40, description="The person's name.")]
_NumberPath = Annotated[int, Path(ge=1, description="The fact's number.")]


class FactOut(BaseModel):
    """A fact that a person told the partner."""

    number: int = Field(description="Its number among this person's facts.")
    text: str = Field(description="What was told.")
    told: datetime = Field(description="When.")
    due: datetime | None = Field(description="The future day that it is about, if any.")


class PersonOut(BaseModel):
    """Somebody whom the partner knows."""

    name: str = Field(description="The name.")
    since: datetime = Field(description="When they met.")
    seen: datetime = Field(description="When they last spoke.")
    facts: list[FactOut] = Field(description="The facts that they told the partner, oldest first.")
    leaning: dict[TheirFeeling, float] = Field(
        description="What this person's presence adds to each resting (baseline) mood."
    )


class PeopleOut(BaseModel):
    """Everything that is known about people."""

    allowed: bool = Field(
        description="Whether what is known about people is kept on the partner's own disk."
    )
    trouble: str | None = Field(
        description="Why the disk did not take the latest of it, which is lost when the partner "
        "ends; null if it did."
    )
    present: str | None = Field(description="Who is present, if anybody has said so.")
    people: list[PersonOut] = Field(description="Everybody whom it knows.")


class AllowPeopleIn(Message):
    """Whether people are remembered; `false` deletes all that is known of them."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"allowed": True}]})

    allowed: bool = Field(description="Keep them on the partner's own disk from now on.")


class PresentIn(Message):
    """The person who is with the partner now."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"name": "Anna"}]})

    name: _Name | None = Field(description="The name; null: nobody.")


class FactIn(Message):
    """The new text of a fact."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"text": "My daughter is coming on Monday."}]}
    )

    text: Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200)] = (
        Field(description="The text.")
    )


def add_people(
    router: APIRouter, memory: Memory, beginning: Beginning, clock: Callable[[], datetime]
) -> None:
    """Add the routes for the people a partner knows, and for when it may speak unasked."""

    @router.get("/people/manners")
    async def manners() -> Manners:
        """Return when the partner may speak unasked."""
        return beginning.manners

    @router.post("/people/manners", status_code=NOTHING, responses=_REFUSED)
    def behave(wish: Manners) -> None:
        """Set when the partner may begin to speak by itself; what is not sent stays as it is."""
        sent = wish.model_dump(exclude_unset=True)
        beginning.behave(beginning.manners.model_copy(update=sent))

    @router.get("/people")
    async def people() -> PeopleOut:
        """Return everything that is known of people, to look at or to keep elsewhere."""
        present = memory.present
        return PeopleOut(
            allowed=memory.allowed,
            trouble=memory.trouble,
            present=None if present is None else present.name,
            people=[_describe(memory, one) for one in memory.people.people],
        )

    @router.post("/people/allowed", status_code=NOTHING, responses=_REFUSED)
    def allow_people(wish: AllowPeopleIn) -> None:
        """Remember people from now on, or delete all that is known of them."""
        memory.allow(wish.allowed)

    @router.post("/people/present", status_code=NOTHING, responses=_REFUSED)
    def set_present(wish: PresentIn) -> None:
        """Set which person is present."""
        if wish.name is None:
            memory.leave()
        else:
            memory.meet(wish.name)

    @router.post("/people/{name}/facts/{number}", status_code=NOTHING, responses=_REFUSED)
    def correct_fact(name: _NamePath, number: _NumberPath, wish: FactIn) -> None:
        """Correct a fact."""
        memory.correct(name, number, wish.text, due_of(wish.text, language_of(wish.text), clock()))

    @router.delete("/people/{name}/facts/{number}", status_code=NOTHING, responses=_REFUSED)
    def delete_fact(name: _NamePath, number: _NumberPath) -> None:
        """Delete a fact."""
        memory.correct(name, number, None)

    @router.delete("/people/{name}", status_code=NOTHING, responses=_REFUSED)
    def delete_person(name: _NamePath) -> None:
        """Delete what the partner knows about a person."""
        memory.forget(name)


def _describe(memory: Memory, person: Acquaintance) -> PersonOut:
    leaning = [round(float(value), 3) for value in memory.leaning_of(person)]
    return PersonOut.model_validate(
        person.model_dump() | {"leaning": dict(zip(FEELINGS, leaning, strict=True))}
    )
