"""The content security policy of our pages.

The studio is NiceGUI's page, which needs inline scripts and ``eval`` (Vue compiles its templates in
the browser). Every other page may run only its inline scripts, known by their hashes, and those in
our folder.
"""

import re
from base64 import b64encode
from hashlib import sha256
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the reception needs no web library
    from fastapi.responses import HTMLResponse


POLICY = b"content-security-policy"
_SHARED = (
    "default-src 'self'; object-src 'none'; {scripts}; {styles}; img-src 'self' data: blob:; "
    "font-src 'self' data:; connect-src 'self'; frame-ancestors 'none'; base-uri 'self'; "
    "form-action 'self'"
)
#: The default policy.
NICEGUI = _SHARED.format(
    scripts="script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:",
    styles="style-src 'self' 'unsafe-inline'",
).encode()
_INLINE = re.compile(r"<(script|style)(?: type=\"module\")?>(.*?)</\1>", re.DOTALL)


def own_page(html: str, status: int = 200) -> "HTMLResponse":
    """Return one of our pages with a policy that allows its inline scripts and styles."""
    from fastapi.responses import HTMLResponse

    known: dict[str, list[str]] = {"script": [], "style": []}
    for kind, text in _INLINE.findall(html):
        digest = b64encode(sha256(text.encode()).digest()).decode()
        known[kind].append(f"'sha256-{digest}'")
    policy = _SHARED.format(
        # The camera's neural networks are WebAssembly, in a worker that their library creates.
        scripts=" ".join(["script-src 'self' 'wasm-unsafe-eval' blob:", *known["script"]]),
        styles=" ".join(["style-src 'self'", *known["style"]]),
    )
    return HTMLResponse(html, status, {POLICY.decode(): policy})
