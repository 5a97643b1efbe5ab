"""Read TOML files into strict, immutable pydantic models.

A subclass of :class:`Table` reads a file into a checked object, or raises a
:class:`~miburi.errors.DescriptionError` that names every wrong key.
"""

import codecs
import tomllib
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Self, TypeVar, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError
from pydantic_core import PydanticCustomError

from miburi.errors import DescriptionError


class Table(BaseModel):
    """A table of a TOML file: immutable, no unknown keys, no NaN, no silent conversions.

    A subclass may derive values from its keys with ``functools.cached_property``. Only the keys
    are compared, hashed, copied and pickled; a copy derives the other values again.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Table) or type(self) is not type(other):
            return NotImplemented
        return _keys_and_values(self) == _keys_and_values(other)

    def __hash__(self) -> int:
        return hash(_hashable(_keys_and_values(self)))

    def __copy__(self) -> Self:
        return _drop_derived(super().__copy__())

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        return _drop_derived(super().__deepcopy__(memo))

    def __getstate__(self) -> dict[Any, Any]:
        return super().__getstate__() | {"__dict__": _keys_and_values(self)}


AnyTable = TypeVar("AnyTable", bound=Table)


def _keys_and_values(table: Table) -> dict[str, object]:
    return {name: table.__dict__[name] for name in type(table).model_fields}


def _drop_derived(copied: AnyTable) -> AnyTable:
    for name in copied.__dict__.keys() - type(copied).model_fields.keys():
        del copied.__dict__[name]
    return copied


def _hashable(value: object) -> object:
    match value:
        case list() | tuple():
            return tuple(map(_hashable, value))
        case dict():
            return frozenset((key, _hashable(inner)) for key, inner in value.items())
    if is_dataclass(value) and not isinstance(value, type):
        return _hashable(vars(value))
    return value


def between(low: float, high: float, what: str) -> AfterValidator:
    """Return a validator of a number's range; ``what`` tells the reader of the error its unit."""

    def check(value: float) -> float:
        if not low <= value <= high:
            raise PydanticCustomError("between", f"{what}, from {low:g} to {high:g}")
        return value

    return AfterValidator(check)


def load_table(model: type[AnyTable], path: Path | str) -> AnyTable:
    """Read a TOML file into ``model``.

    Raises
    ------
    DescriptionError
        The file cannot be read, is not TOML, or a key is missing, unknown or out of range; the
        message names the file, every wrong key, its value and what is allowed.
    """
    path = Path(path)
    try:
        return _load(model, path)
    except RecursionError as error:  # raised by the parser, or while a wrong value is formatted
        raise DescriptionError(f"{path}: its values are nested too deeply.") from error


def _load(model: type[AnyTable], path: Path) -> AnyTable:
    try:
        data = tomllib.loads(_text(path.read_bytes()))
    except OSError as error:
        raise DescriptionError(f"{path}: cannot be read: {error.strerror}.") from error
    except ValueError as error:  # TOML, UTF-8, or a number with thousands of digits
        raise DescriptionError(f"{path}: this is not TOML: {error}.") from error
    try:
        return model.model_validate(data, context={"folder": path.parent})
    except ValidationError as error:
        raise DescriptionError(f"{path}:{_in_words(error, model)}") from error


def _text(content: bytes) -> str:
    """Decode a file by its byte-order mark, if any: PowerShell 5 and Windows editors write one."""
    wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return content.decode("utf-16" if wide else "utf-8-sig")


def _in_words(error: ValidationError, model: type[Table]) -> str:
    lines = []
    for item in error.errors(include_url=False):
        # pydantic adds "[key]" where the key of a mapping is wrong, not its value.
        path = [part for part in item["loc"] if part != "[key]"]
        key = ".".join(str(part) for part in path) or "the file"
        got = repr(item["input"])
        got = got if len(got) <= 80 else got[:77] + "..."
        match item["type"]:
            case "too_short" if len(item["input"]) > item["ctx"]["actual_length"]:
                continue  # it counts only items that are right; each wrong one has its own line
            case "missing":
                lines.append(f"{key} is missing; add it.")
            case "extra_forbidden" | "unexpected_keyword_argument":
                allowed = ", ".join(_keys(model, path[:-1]))
                lines.append(f"{key} = {got}: not a known key here; the known ones are {allowed}.")
            case "value_error":
                what = item["msg"].removeprefix("Value error, ").rstrip(".")
                lines.append(f"{key}: {what}." if path else f"{what}.")
            case _:
                lines.append(f"{key} = {got}: {item['msg'][0].lower()}{item['msg'][1:]}.")
    return f" {lines[0]}" if len(lines) == 1 else "\n".join(["", *(f"  {line}" for line in lines)])


def _keys(model: type[BaseModel], path: Sequence[object]) -> list[str]:
    """Return the keys that are allowed in the table at ``path``; follows lists of tables too."""
    parts = iter(path)
    for part in parts:
        if isinstance(part, str):
            inner = model.model_fields[part].annotation
            if get_origin(inner) is dict:
                next(parts, None)  # the key, which is a name
            if is_dataclass(table := get_origin(inner)):
                return [field.name for field in fields(table)]
            models = [inner, *get_args(inner)]
            model = next(m for m in models if isinstance(m, type) and issubclass(m, BaseModel))
    return list(model.model_fields)
