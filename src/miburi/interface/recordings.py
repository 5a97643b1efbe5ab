"""The recordings of a live partner: here a program can list, start, end, fetch and delete them."""

from typing import Annotated

from fastapi import APIRouter, HTTPException, Path
from fastapi.responses import FileResponse

from miburi.errors import InputError
from miburi.interface.refusing import NO_ROOM, NOTHING, REFUSED, Refusals
from miburi.live.view import LivePartner
from miburi.wire.messages import RecordingIn, RecordingOut

_NONE: Refusals = {404: {"description": "Nothing has that name."}}
_RecordingName = Annotated[str, Path(max_length=60, description="The name of its file.")]


def add_recordings(router: APIRouter, runner: LivePartner) -> None:
    """Add the routes for recordings."""
    kept = runner.recordings

    # A disk may be slow: these functions run in threads, so they delay only their own answers.

    @router.get("/recordings")
    def recordings() -> list[RecordingOut]:
        """Return all recordings, and the one that is being written."""
        return [RecordingOut.model_validate(one._asdict()) for one in kept.kept()]

    @router.post("/recordings", status_code=NOTHING, responses=REFUSED | NO_ROOM)
    def record(wish: RecordingIn) -> None:
        """Start or end a recording."""
        if wish.on:
            kept.start()
        else:
            kept.end()

    @router.get(
        "/recordings/{name}",
        response_class=FileResponse,
        responses=_NONE
        | {200: {"content": {"application/octet-stream": {}}, "description": "An MCAP file."}},
    )
    def recording(name: _RecordingName) -> FileResponse:
        """Download a recording (MCAP)."""
        try:
            path = kept.find(name)
        except InputError as error:
            raise HTTPException(404, str(error)) from error
        return FileResponse(path, filename=name, media_type="application/octet-stream")

    @router.delete("/recordings/{name}", status_code=NOTHING, responses=_NONE | NO_ROOM)
    def delete(name: _RecordingName) -> None:
        """Delete a recording."""
        try:
            kept.delete(name)
        except InputError as error:
            raise HTTPException(404, str(error)) from error
