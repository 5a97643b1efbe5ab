"""The interface's page in the reference, made from its own description (OpenAPI)."""

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

Part = dict[str, Any]
_TITLE = "HTTP"
_ABOUT = (
    "Made from the description that a running partner gives at `/api/openapi.json`. "
    "[The interface](../interface.md) explains it."
)


def http_page() -> str:
    """Return the page, in Markdown: each request with its fields and an example, then each type."""
    description = _describe()
    models: dict[str, Part] = description["components"]["schemas"]
    lines = [f"# {_TITLE}", "", _ABOUT, ""]
    for tag in description["tags"]:
        asked = list(_requests(description, tag["name"]))
        lines += [f"## {tag['name'].capitalize()}", "", tag["description"], ""] if asked else []
        for method, path, one in asked:
            lines += [f"### {method} {path}", "", one["description"], ""]
            lines += _fields(_parameters(one), models)
            if "requestBody" in one:
                schema = one["requestBody"]["content"]["application/json"]["schema"]
                model = models[_name(schema)]
                lines += _fields(_properties(model), models)
                example = json.dumps(model["examples"][0], ensure_ascii=False)
                lines += [f"    curl -X {method} http://127.0.0.1:8080{path} \\",
                          "         -H 'Content-Type: application/json' \\",
                          f"         -d '{example}'", ""]  # fmt: skip
            lines += [_answers(one), ""]
    lines += ["## Types", ""]
    for name, model in sorted(models.items()):
        lines += [
            f"### {name}",
            "",
            model.get("description", "").partition("\n\nAttributes")[0],
            "",
        ]
        if "enum" in model:
            lines += [", ".join(f"`{choice}`" for choice in model["enum"]), ""]
        lines += _fields(_properties(model), models)
    return "\n".join(lines)


def _describe() -> Part:
    from miburi.feelings import EmotionalModel
    from miburi.interface.api import make_api
    from miburi.live.recording.archive import Archive
    from miburi.live.runner import Runner
    from miburi.robot import iphonoid

    with tempfile.TemporaryDirectory() as folder:
        return make_api(Runner(iphonoid(), EmotionalModel(), Archive(Path(folder)))).openapi()


def _requests(description: Part, tag: str) -> Iterator[tuple[str, str, Part]]:
    for path, methods in description["paths"].items():
        for method, one in methods.items():
            if tag in one["tags"]:
                yield method.upper(), path, one


def _parameters(one: Part) -> dict[str, Part]:
    return {
        given["name"]: {**given["schema"], "description": given.get("description", "")}
        for given in one.get("parameters", [])
    }


def _properties(model: Part) -> dict[str, Part]:
    properties: dict[str, Part] = model.get("properties", {})
    return properties


def _fields(fields: dict[str, Part], models: dict[str, Part]) -> list[str]:
    if not fields:
        return []
    rows = [
        f"| `{name}` | {_kind(field, models)} | {_words(field)} |" for name, field in fields.items()
    ]
    return ["| field | type | |", "|---|---|---|", *rows, ""]


def _words(field: Part) -> str:
    words = " ".join(str(field.get("description", "")).split()).replace("|", "\\|")
    default = field.get("default")
    return words if default is None else f"{words} Default: `{json.dumps(default)}`."


def _kind(field: Part, models: dict[str, Part]) -> str:
    """Return a field's type in words, with its range."""
    if "$ref" in field:
        name = _name(field)
        return f"[{name}](#{name.lower()})" if name in models else name
    for several in ("anyOf", "oneOf"):
        if several in field:
            return " or ".join(dict.fromkeys(_kind(one, models) for one in field[several]))
    if "enum" in field or "const" in field:
        return ", ".join(f"`{choice}`" for choice in field.get("enum", [field.get("const")]))
    if field.get("type") == "array":
        return f"list of {_kind(field.get('items', {}), models)}"
    bounds = [
        f"{sign} {field[key]}"
        for key, sign in (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"),
                          ("maxLength", "length ≤"))
        if key in field
    ]  # fmt: skip
    return " ".join([str(field.get("type", "anything")), ", ".join(bounds)]).strip()


def _name(schema: Part) -> str:
    return str(schema["$ref"]).rsplit("/", 1)[1]


def _answers(one: Part) -> str:
    told = []
    for status, answer in one["responses"].items():
        schema = next(iter(answer.get("content", {}).values()), {}).get("schema", {})
        what = f": {_kind(schema, {_name(schema): {}})}" if "$ref" in schema else ""
        told.append(f"{status} {answer['description'].rstrip('.')}{what}")
    return f"Answers: {'; '.join(told)}."
