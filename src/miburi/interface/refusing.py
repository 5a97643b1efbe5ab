"""How an application answers when Miburi refuses something: a status, and the reason in words."""

from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.routing import APIRoute, APIWebSocketRoute
from starlette.requests import HTTPConnection

from miburi.errors import BodyError, InputError, MiburiError, OutputError
from miburi.live.commands import BusyError
from miburi.live.view import UnreachableError

#: The status of an answer without content.
NOTHING = 204
#: How OpenAPI describes refusals: for each status a description.
Refusals = dict[int | str, dict[str, Any]]
REFUSED: Refusals = {
    400: {"description": "A value is not allowed."},
    409: {"description": "The body cannot do that now."},
    503: {"description": "Too much at once, or the robot cannot be reached."},
}
#: The refusal of a request that needs the disk.
NO_ROOM: Refusals = {507: {"description": "The disk is full, or cannot be written to."}}
_STATUSES = {
    BodyError: 409,
    InputError: 400,
    BusyError: 503,
    UnreachableError: 503,
    OutputError: 507,
}


def refuse_in_words(app: FastAPI) -> None:
    """Turn Miburi's errors into responses with a status and a message."""
    app.add_exception_handler(MiburiError, _say)
    app.add_exception_handler(RequestValidationError, _say_what_is_allowed)


def known_queries(asked: HTTPConnection) -> None:
    """Refuse a query parameter that a request does not have, such as a misspelt one.

    Raises
    ------
    InputError
        A parameter is unknown; the message lists the parameters that the request has.
    """
    route = asked.scope.get("route")
    if isinstance(route, APIRoute | APIWebSocketRoute):
        known = [each.alias for each in route.dependant.query_params]
        if unknown := sorted(set(asked.query_params) - set(known)):
            has = ", ".join(known) or "none"
            raise InputError(
                f"{', '.join(unknown)[:100]}: not a parameter of this request; it has {has}."
            )


async def _say(_request: Request, error: Exception) -> JSONResponse:
    status = next((_STATUSES[kind] for kind in _STATUSES if isinstance(error, kind)), 500)
    return JSONResponse({"detail": str(error)}, status)


async def _say_what_is_allowed(request: Request, error: Exception) -> JSONResponse:
    """Say which value is wrong, without sending it back."""
    errors = error.errors() if isinstance(error, RequestValidationError) else []
    words = "; ".join(map(_words, errors))[:1000]
    if any(item["loc"] == ("body",) for item in errors) and "json" not in request.headers.get(
        "content-type", ""
    ):
        words += ". Send JSON, with the header Content-Type: application/json."
    return JSONResponse({"detail": words}, 422)


def _words(item: dict[str, Any]) -> str:
    if item["type"] == "json_invalid":
        return f"the request is not JSON: {item['ctx']['error']} (character {item['loc'][-1]})"
    place = ".".join(map(str, item["loc"][1:])) or "the request"
    return f"{place}: {item['msg'].removeprefix('Value error, ')}"
