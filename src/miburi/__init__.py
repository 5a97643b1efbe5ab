"""Miburi (身振り, "gesture"): feelings that show in a small robot's whole body.

The subpackages, in the order in which a feeling travels through them::

    feelings → gestures → ik (bma) → bodies → contact → feelings

This package offers the names that most programs begin with. Each is loaded when it is first
used, so ``import miburi`` alone is quick; import everything else from its subpackage, such as
``miburi.ik``.

>>> import miburi
>>> robot = miburi.iphonoid()
>>> miburi.solve(robot, miburi.forward(robot, robot.neutral)).status
'converged'
"""

from miburi.version import __version__

TYPE_CHECKING = False  # True for type checkers; importing typing would take most of the import time

if TYPE_CHECKING:
    from miburi.bodies.simulated import Simulated
    from miburi.client.asynchronous import AsyncPartner, connect_async
    from miburi.client.connection import ConnectionLostError
    from miburi.client.remote import RemotePartner, connect
    from miburi.errors import BodyError, InputError, MiburiError, OutputError
    from miburi.feelings import EmotionalModel, Expression, Stimulus, load_temperament
    from miburi.gestures import key_poses
    from miburi.gestures import load as load_gesture
    from miburi.ik import solve
    from miburi.live.events.event import LiveEvent
    from miburi.partner import Partner
    from miburi.robot import Robot, forward, iphonoid, load_robot

__all__ = [
    "AsyncPartner",
    "BodyError",
    "ConnectionLostError",
    "EmotionalModel",
    "Expression",
    "InputError",
    "LiveEvent",
    "MiburiError",
    "OutputError",
    "Partner",
    "RemotePartner",
    "Robot",
    "Simulated",
    "Stimulus",
    "__version__",
    "connect",
    "connect_async",
    "forward",
    "iphonoid",
    "key_poses",
    "load_gesture",
    "load_robot",
    "load_temperament",
    "solve",
]

#: Where each name comes from, module:name; the imports above say the same to type checkers.
_ORIGINS = {
    "AsyncPartner": "miburi.client.asynchronous:AsyncPartner",
    "BodyError": "miburi.errors:BodyError",
    "ConnectionLostError": "miburi.client.connection:ConnectionLostError",
    "EmotionalModel": "miburi.feelings:EmotionalModel",
    "Expression": "miburi.feelings:Expression",
    "InputError": "miburi.errors:InputError",
    "LiveEvent": "miburi.live.events.event:LiveEvent",
    "MiburiError": "miburi.errors:MiburiError",
    "OutputError": "miburi.errors:OutputError",
    "Partner": "miburi.partner:Partner",
    "RemotePartner": "miburi.client.remote:RemotePartner",
    "Robot": "miburi.robot:Robot",
    "Simulated": "miburi.bodies.simulated:Simulated",
    "Stimulus": "miburi.feelings:Stimulus",
    "connect": "miburi.client.remote:connect",
    "connect_async": "miburi.client.asynchronous:connect_async",
    "forward": "miburi.robot:forward",
    "iphonoid": "miburi.robot:iphonoid",
    "key_poses": "miburi.gestures:key_poses",
    "load_gesture": "miburi.gestures:load",
    "load_robot": "miburi.robot:load_robot",
    "load_temperament": "miburi.feelings:load_temperament",
    "solve": "miburi.ik:solve",
}

if not TYPE_CHECKING:  # a type checker that saw __getattr__ would accept any name

    def __getattr__(name: str) -> object:
        if name not in _ORIGINS:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from importlib import import_module

        module, _, attribute = _ORIGINS[name].partition(":")
        value = globals()[name] = getattr(import_module(module), attribute)
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
