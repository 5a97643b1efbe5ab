"""Miburi (身振り, "gesture"): feelings that show in a small robot's whole body.

The rooms, in the order in which a feeling travels through them::

    feelings → gestures → ik (bma) → bodies → contact → feelings

Importing this package loads none of them; import the room that you need, such as
``miburi.robot`` or ``miburi.ik``.
"""

from typing import TYPE_CHECKING

from miburi.version import __version__

if TYPE_CHECKING:
    from miburi.client import RemotePartner

__all__ = ["__version__", "connect"]


def connect(url: str, token: str | None = None) -> "RemotePartner":
    """Return a live partner at ``url``, such as ``http://127.0.0.1:8080``.

    The token is needed where the partner was started with another ``--host``.

    Raises
    ------
    InputError
        The address is not one.
    """
    from miburi.client import RemotePartner

    return RemotePartner(url, token)
