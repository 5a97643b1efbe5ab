"""The servo's outline, what holds its case, and the fork that it turns.

All solids are in the servo's own frame, in mm: the axle is y through the origin, the horn at +y,
the case's long side at +z. ``fit`` is the gap on each side of what is pushed into a pocket.
"""

from collections.abc import Sequence
from math import cos, pi, sin

import numpy as np

from miburi.hardware.dimensions import dimensions
from miburi.hardware.solids import (
    CrossSection,
    JoinType,
    Manifold,
    around,
    box,
    cut,
    disc,
    hull,
    join,
    rod,
)
from miburi.robot.description import Array

#: How much wider the fork is than horn and idler together, in mm; its screws close this gap.
_PLAY = 0.2
#: The shoulder's stop, in mm: the radius of its pin, and the pin's distance from the axle.
_PIN, _PIN_CIRCLE = 2.2, 15.0
#: The z, in mm, at which a holder's back plate begins: the idler's cheek turns below it.
_BACK_PLATE = 14.5


def case(fit: float = 0.0) -> Manifold:
    """Return the case as a box, larger by ``fit`` except in front, where it meets a plate."""
    s = dimensions().servo
    return box(
        (-s.half_width - fit, s.half_width + fit), (s.back - fit, s.front),
        (s.short_end - fit, s.long_end + fit),
    )  # fmt: skip


def outline(*, idler_too: bool) -> Manifold:
    """Return the servo's true shape: case, horn and, with ``idler_too``, the idler behind."""
    s = dimensions().servo
    radius = s.horn_diameter / 2
    horn = disc("y", (0, 0), (s.front, s.horn_face), radius)
    behind = [disc("y", (0, 0), (s.idler_face, s.back), radius)] if idler_too else []
    return join([case(), horn, *behind])


def portrait() -> Manifold:
    """Return the servo as it is drawn in pictures: with the horn's holes and notch, and sockets.

    The notch is 1 mm deep here so that it can be seen; the real one is 0.2 mm deep.
    """
    s = dimensions().servo
    holes = [rod((x, s.front, z), (x, 20, z), 0.8) for x, z in circle()]
    rim = s.horn_diameter / 2
    notch = box((-0.7, 0.7), (s.front - 1, 20), (-rim - 1, -rim + 1.0))
    sockets = [
        box(sorted((side * s.socket_x[0], side * 20.0)), s.socket_y, s.socket_z) for side in (-1, 1)
    ]
    horn = disc("y", (0, 0), (s.front, s.horn_face), rim)
    return join([cut(case(), sockets), cut(horn, [*holes, notch])])


def idler(fit: float) -> Manifold:
    """Return the idler as a part to print; ``fit`` widens the hole that it turns on."""
    s, holes = dimensions().servo, dimensions().screws
    return cut(
        disc("y", (0, 0), (s.idler_face, s.back), s.horn_diameter / 2 + 0.3),
        [
            disc("y", (0, 0), (-30, 0), holes.idler_screw / 2 + fit / 2),
            *(rod((x, -30, z), (x, 0, z), holes.m2_pilot / 2) for x, z in circle()),
        ],
    )


def circle() -> list[tuple[float, float]]:
    """Return x and z of the horn's four screws."""
    radius = dimensions().servo.horn_circle / 2
    return [(radius * cos(turn), radius * sin(turn)) for turn in (0, pi / 2, pi, 3 * pi / 2)]


def horn_screws(face: float, away: float) -> list[Manifold]:
    """Return the cut-outs for the horn's centre and four screws in a plate at y = ``face``.

    ``away`` is +1 if the plate lies towards +y, -1 towards -y.
    """
    holes, plate = dimensions().screws, dimensions().wall.plate
    far = face + away * 40
    return [
        *(rod((x, face - away, z), (x, far, z), holes.m2_clearance / 2) for x, z in circle()),
        *(
            rod((x, face + away * plate, z), (x, far, z), holes.m2_head / 2)
            for x, z in circle()
        ),
        # A hole through which the screw in the middle can be reached.
        disc("y", (0, 0), sorted((face - away, far)), 2.7),
    ]  # fmt: skip


def driver_room(face: float, away: float, length: float) -> Manifold:
    """Return the clearance that screws, heads and a driver need in front of a plate."""
    plate = dimensions().wall.plate
    near = face + away * plate
    return disc("y", (0, 0), sorted((near, near + away * length)), 8.5)


def case_screws(rows: Sequence[float], face: float, away: float) -> list[Manifold]:
    """Return holes for screws into the case at each z in ``rows``, with countersinks for heads.

    ``face`` is the y of the side of the case on which the plate lies; 1.3 mm of plate remain under
    a head.
    """
    holes, x = dimensions().screws, dimensions().servo.case_holes_x
    under = 1.3
    tools = []
    for z in rows:
        for side in (-x, x):
            far = face + away * 30
            head = rod((side, face + away * under, z), (side, far, z), holes.m2_head / 2)
            # The room for the screw's head opens into the horn's window; a wall between them would
            # be too thin.
            inner = head.translate((-3.0 * side / x, 0, 3.0)) if z < 0 else head
            tools.append(rod((side, face - away, z), (side, far, z), holes.m2_clearance / 2))
            tools.append(hull(head, inner))
    return tools


def plugs(length: float) -> Manifold:
    """Return the pockets for both plugs, with the channels that they pass through from behind."""
    s = dimensions().servo
    x, y, z = s.socket_x, s.socket_y, s.socket_z
    outside = dimensions().wall.knuckle + 1.0  # no sliver of the round end is left beside them
    return join(
        [
            box(sorted((side * (x[0] - 0.5), side * outside)), (y[0] - length, y[1]), z)
            for side in (-1, 1)
        ]
    )


def pocket(fit: float) -> Manifold:
    """Return the cavity for a case, slid in from the horn's side, and for its plugs."""
    s = dimensions().servo
    open_end = box(
        (-s.half_width - fit, s.half_width + fit), (s.front, s.front + 20),
        (s.short_end - fit, s.long_end + fit),
    )  # fmt: skip
    return join([case(fit), open_end, plugs(20.0)])


def holder(fit: float) -> Manifold:
    """Return a sleeve for a case that is pushed in from its horn's side.

    The sleeve has a round end about the axle, so that the gap to a fork's bridge is the same in all
    poses, and a back plate with two screws at the case's long end. The sleeve ends a wall's
    thickness past the case.
    """
    s, w = dimensions().servo, dimensions().wall
    wide = s.half_width + fit + w.shell
    end = s.long_end + fit + w.shell
    knuckle = disc("y", (0, 0), (s.back, s.front), w.knuckle)
    sleeve = box((-wide, wide), (s.back, s.front), (0, end))
    plate = box((-wide, wide), (s.back - 2.8, s.back), (_BACK_PLATE, end))
    back = s.back - fit
    return cut(
        join([knuckle, sleeve, plate]),
        [pocket(fit), *case_screws(s.case_holes_z[1:], back, -1)],
    )


def cheek_outline(turn: float, reach: float) -> CrossSection:
    """Return the outline of a fork's cheek in x and z; it points to +x if ``turn`` is 0."""
    radius = dimensions().wall.cheek
    beam = CrossSection.square((reach, 2 * radius)).translate((0, -radius))
    return (CrossSection.circle(radius, 64) + beam).rotate(turn * 180 / pi)


def cheeks(reach: float) -> Manifold:
    """Return a fork's two cheeks with their screw holes; they point to +x and end at ``reach``.

    Each part adds its own bridge to join them.
    """
    s, w = dimensions().servo, dimensions().wall
    flat = cheek_outline(0.0, reach)
    sides = [
        _along_y(flat, s.horn_face, s.horn_face + w.plate),
        _along_y(flat, s.idler_face - _PLAY - w.plate, s.idler_face - _PLAY),
    ]
    # The axle's screw comes last, through the rear cheek.
    axle = disc("y", (0, 0), (s.idler_face - 20.0, s.idler_face), 3.1)
    horn, idler_too = horn_screws(s.horn_face, 1), horn_screws(s.idler_face - _PLAY, -1)
    return cut(join(sides), [*horn, *idler_too, axle])


def fork_half_width() -> float:
    """Return half the width of a fork over both cheeks, mm."""
    s, w = dimensions().servo, dimensions().wall
    return (s.horn_face - s.idler_face) / 2 + w.plate


def cheek_span(
    frame: Array, axis: Array, direction: Array, limits: tuple[float, float]
) -> tuple[float, float]:
    """Return the angles of a fork's cheek at a joint's limits, as for :func:`cheek_outline`.

    ``frame`` is the servo's frame on its link. In that link's coordinates, ``axis`` is the joint's
    axis, and ``direction`` is where the cheek points at a joint angle of 0. ``limits`` are in rad.
    """
    aside = np.cross(axis, direction)
    angles = [
        float(np.arctan2(way @ frame[:, 2], way @ frame[:, 0]))
        for turn in np.linspace(*limits, 16)
        for way in [cos(turn) * direction + sin(turn) * aside]
    ]
    ends = np.unwrap(angles)[[0, -1]]
    return float(ends.min()), float(ends.max())


def stops(low: float, high: float, fit: float) -> Manifold:
    """Return the blocks on a holder's front that a fork's cheek meets beyond its range.

    ``low`` and ``high`` are the limits of the cheek's angle in rad; at 0 the cheek points to +x, as
    in :func:`cheek_outline`. The cheek moves freely from ``stop`` degrees below ``low`` to ``stop``
    degrees above ``high``; ``stop`` is a dimension in ``dimensions.toml``.
    """
    s, w = dimensions().servo, dimensions().wall
    wide = s.half_width + fit + w.shell
    rim = CrossSection.circle(w.knuckle, 64) + CrossSection.square((2 * wide, 17)).translate(
        (-wide, 0)
    )
    room = CrossSection.square(
        (2 * (s.half_width + fit), s.long_end - s.short_end + 2 * fit)
    ).translate((-s.half_width - fit, s.short_end - fit))
    beyond = w.stop * pi / 180
    swept = around(low - beyond, high + beyond, lambda turn: cheek_outline(turn, 40.0))
    return _along_y(_blunt(rim - room - swept), s.front - 0.01, s.horn_face + w.plate)


def shoulder_pin(length: float) -> Manifold:
    """Return the pin under a shoulder's axle that stops the yoke; y is along the axle, z is up."""
    return disc("y", (0, -_PIN_CIRCLE), (0, length), _PIN)


def shoulder_tab(low: float, high: float, thick: float) -> Manifold:
    """Return the rim of a yoke's plate that hits the pin beyond the shoulder's range, given in rad.

    The shoulder turns about -y; seen from the yoke the pin goes the other way.
    """
    beyond = dimensions().wall.stop * pi / 180
    pin = CrossSection.circle(_PIN + 0.4, 24).translate((0, -_PIN_CIRCLE))
    # A turn about -y takes x to z.
    swept = around(-high - beyond, -low + beyond, lambda turn: pin.rotate(turn * 180 / pi))
    return _along_y(_blunt(CrossSection.circle(_PIN_CIRCLE + _PIN, 96) - swept), 0.0, thick)


def _blunt(flat: CrossSection) -> CrossSection:
    """Return an outline without any features that are thinner than a wall may be."""
    half = dimensions().wall.least / 2 + 0.1
    return flat.offset(-half, JoinType.Round, 2.0, 32).offset(half, JoinType.Round, 2.0, 32)


def _along_y(flat: CrossSection, low: float, high: float) -> Manifold:
    """Return an outline in x and z as a plate between two values of y."""
    # Extruded along z, then turned so that the outline's second axis becomes z.
    return flat.extrude(high - low).rotate((90, 0, 0)).translate((0, high, 0))
