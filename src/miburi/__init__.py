"""Miburi (身振り, "gesture"): feelings that show in a small robot's whole body.

The rooms, in the order in which a feeling travels through them::

    feelings → gestures → ik (bma) → bodies → contact → feelings

Importing this package loads none of them; import the room that you need, such as
``miburi.robot`` or ``miburi.ik``.
"""

__version__ = "0.1.0"
