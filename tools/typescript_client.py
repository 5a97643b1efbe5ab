#!/usr/bin/env python3
"""Make the types of the TypeScript client anew from the interface's description.

It needs npm; `npm run build` in clients/typescript then makes the JavaScript. A test compares the
first line of api.ts with the description of today.
"""

import hashlib
import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from miburi.feelings import EmotionalModel
from miburi.interface.api import make_api
from miburi.live.recording.archive import Archive
from miburi.live.runner import Runner
from miburi.robot import iphonoid

CLIENT = Path(__file__).parents[1] / "clients" / "typescript"


def digest(description: dict[str, Any]) -> str:
    """Return a hash of all paths, fields, types and texts of the interface."""
    told = {key: description[key] for key in ("paths", "components")}
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        runner = Runner(iphonoid(), EmotionalModel(), Archive(Path(folder)))
        description = make_api(runner).openapi()
    file = CLIENT / "openapi.json"
    file.write_text(json.dumps(description), encoding="utf-8")
    try:
        for command in (["install", "--no-save"], ["run", "generate"]):
            subprocess.run(["npm", *command], cwd=CLIENT, check=True)
    finally:
        file.unlink()
    types = CLIENT / "api.ts"
    generated = types.read_text(encoding="utf-8")
    types.write_text(f"// {digest(description)}\n{generated}", encoding="utf-8")


if __name__ == "__main__":
    main()
