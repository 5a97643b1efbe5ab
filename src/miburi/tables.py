"""TOML files at the door: read, checked once by a strict pydantic model, refused in words."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from miburi.errors import DescriptionError


class Table(BaseModel):
    """A table of a TOML file: immutable, no unknown keys, no NaN, no silent conversions."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


AnyTable = TypeVar("AnyTable", bound=Table)


def load_table(model: type[AnyTable], path: Path | str) -> AnyTable:
    """Read a TOML file into ``model``.

    Raises
    ------
    DescriptionError
        The file cannot be read, is not TOML, or a key is missing, unknown or out of range; the
        message names the file, every wrong key, what was got and what is allowed.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            data = tomllib.load(file)
    except OSError as error:
        raise DescriptionError(f"{path}: cannot be read: {error.strerror}.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DescriptionError(f"{path}: this is not TOML: {error}.") from error
    try:
        return model.model_validate(data, context={"folder": path.parent})
    except ValidationError as error:
        raise DescriptionError(f"{path}: {_in_words(error, model)}") from error


def _in_words(error: ValidationError, model: type[Table]) -> str:
    lines = []
    for item in error.errors(include_url=False):
        # pydantic marks a mistake in a mapping's key, rather than its value, with "[key]".
        path = [part for part in item["loc"] if part != "[key]"]
        key = ".".join(str(part) for part in path) or "the file"
        got = repr(item["input"])
        got = got if len(got) <= 80 else got[:77] + "..."
        match item["type"]:
            case "missing":
                lines.append(f"{key} is missing; add it.")
            case "extra_forbidden":
                known = ", ".join(_keys(model, path[:-1]))
                lines.append(f"{key} = {got}: not a known key here; allowed are {known}.")
            case "value_error":
                lines.append(f"{key}: {item['msg'].removeprefix('Value error, ')}.")
            case _:
                lines.append(f"{key} = {got}: {item['msg'][0].lower()}{item['msg'][1:]}.")
    return lines[0] if len(lines) == 1 else "\n".join(["", *(f"  {line}" for line in lines)])


def _keys(model: type[BaseModel], path: Sequence[object]) -> list[str]:
    """Return the keys that the table at ``path`` knows, through lists of tables too."""
    for part in path:
        if isinstance(part, str):
            inner = model.model_fields[part].annotation
            models = [inner, *get_args(inner)]
            model = next(m for m in models if isinstance(m, type) and issubclass(m, BaseModel))
    return list(model.model_fields)
