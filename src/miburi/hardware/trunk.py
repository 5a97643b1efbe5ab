"""The trunk's printed parts: foot with the Mega, lid, column, torso and chest.

Each part is in the frame of the link that carries it, base or torso, in mm: x points forward, y to
the robot's left, z up, and the waist's horn is at z = 0. ``fit`` is the gap on each side of a
pocket.
"""

from math import cos, pi, sin

from miburi.hardware import servo
from miburi.hardware.dimensions import dimensions
from miburi.hardware.places import SIDE_GAP, mount_of, neck_floor, range_of, shoulder_face
from miburi.hardware.solids import (
    CrossSection,
    Manifold,
    around,
    box,
    cut,
    disc,
    discs,
    hull,
    join,
    moved,
)
from miburi.robot import Robot

#: x and y of the four screws between torso and neck, mm.
NECK_SCREWS = [(x, y) for x in (-20.0, -3.0) for y in (-20.5, 20.5)]
#: The thickness of the foot's lid (the column's top is as thick), that of the torso's floor and
#: that of the torso's roof; and the gap at the waist, all in mm.
_LID, _FLOOR, _ROOF, _GAP = 3.0, 4.4, 5.7, 1.2
#: Radius of the hole in the roof, through which a slim driver reaches the waist's horn.
_DRIVER = 9.5
#: The heads of the chest's screws lie this far in front of the chest's edge, in mm, so that the
#: tips stop short of the servos.
CHEST_SEAT = 5.5
#: The radius at which the hub's wires (power and DATA) pass the waist, and half the width of their
#: slot, both in mm.
_CABLE_CIRCLE, _CABLE = 14.9, 2.6
#: The radius of the circle on which the waist's stops stand, and the stops' own radius, in mm.
_STOP_CIRCLE, _STOP_RADIUS = 22.0, 2.2


def foot_floor(robot: Robot) -> float:
    """Return the height of the foot's floor, mm."""
    return dimensions().wall.shell - 1000 * robot.shape.pedestal_height


def hub_floor(robot: Robot) -> float:
    """Return the height at which the hub's board stands in the torso, below the servos, mm."""
    return 1000 * robot.lengths.L01 - dimensions().servo.long_end - 36.0


def lid_height(robot: Robot) -> float:
    """Return the height of the lid's top, in mm; the Mega lies below it."""
    m = dimensions().mega
    return foot_floor(robot) + m.post + 1.6 + m.height + _LID


def lid_screws(robot: Robot) -> list[tuple[float, float]]:
    """Return the places of the screws between lid and foot: beside the Mega."""
    far = 1000 * robot.shape.pedestal_radius - dimensions().wall.shell - 3.5
    return [(far * cos(turn), far * sin(turn)) for turn in (0.9, pi - 0.9, pi + 0.9, -0.9)]


def column_screws(robot: Robot) -> list[tuple[float, float]]:
    """Return the places of the screws between column and lid: on the diagonals."""
    far = 1000 * robot.shape.torso_radius + 6.5
    return [(far * cos(n * pi / 4), far * sin(n * pi / 4)) for n in (1, 3, -1, -3)]


def card_screws() -> list[tuple[float, float]]:
    """Return the places of the four screws of the Mega, whose USB socket faces backwards.

    With the components up and the USB socket at the back, the edge beside the socket is on the
    robot's left.
    """
    m = dimensions().mega
    return [(x - m.length / 2, m.width / 2 - y) for x, y in m.holes]


def foot(robot: Robot) -> Manifold:
    """Return the cup that stands on the table: posts for the Mega, and two chambers for ballast."""
    w, m, holes = dimensions().wall, dimensions().mega, dimensions().screws
    radius, table = 1000 * robot.shape.pedestal_radius, -1000 * robot.shape.pedestal_height
    top = lid_height(robot) - _LID
    inner = radius - w.shell
    outside = hull(
        disc("z", (0, 0), (table, table + 1), radius - 1.5),
        disc("z", (0, 0), (table + 1.5, top), radius),
    )
    floor = table + w.shell
    inside = disc("z", (0, 0), (floor, top + 1), inner)
    rib = m.width / 2 + 1.5
    ribs = join(
        [
            box((-inner, inner), (side * rib, side * (rib + w.shell)), (floor - 0.1, top - 4.0))
            for side in (-1, 1)
        ]
    ) ^ disc("z", (0, 0), (floor - 0.1, top), inner + 0.5)
    places = card_screws()
    posts = discs("z", places, (floor - 0.1, floor + m.post), 3.2)
    pilots = discs("z", places, (floor - 1.0, floor + 20), holes.m3_pilot / 2)
    screws = lid_screws(robot)
    # The buffer's board stands between the Mega and the front of the foot.
    seat = [
        groove ^ disc("z", (0, 0), (table, top), inner + 0.5)
        for groove in _grooves(m.length / 2 + 3.0, 18.9, floor, floor + 12.0)
    ]
    lid_posts = discs("z", screws, (floor - 0.1, top), 3.6)
    lid_pilots = discs("z", screws, (top - 12, top + 1), holes.m25_pilot / 2)
    y, wide, high = m.usb
    above = floor + m.post + 1.6
    y = m.width / 2 - y
    usb = (y - wide / 2, y + wide / 2)
    openings = [
        box((-radius - 1, -m.length / 2 + 1), usb, (above - 0.5, above + high)),
        # Clearance for the power wires, and gaps in the ribs for the wires to the Arduino card.
        disc("x", (-18.0, floor + 10.0), (-radius - 1, -m.length / 2 + 1), 4.1),
        box((-46.0, -36.0), (-rib - 5, rib + 5), (floor + 6.0, top)),
    ]
    return cut(
        join([cut(outside, [inside]), ribs, *posts, *lid_posts, *seat]),
        [*pilots, *lid_pilots, *openings],
    )


def _grooves(
    x: float, half: float, floor: float, high: float, behind: float = 0.0
) -> list[Manifold]:
    """Return two posts; a 1.6 mm board slides down between them, from y = -half to half.

    The posts reach ``behind`` mm further back, to a wall that carries them.
    """
    return [
        box(
            (x - 2.3 - behind, x + 2.3), (side * (half - 1.5), side * (half + 2.0)),
            (floor - 2.0, high),
        )
        - box(
            (x - 0.95, x + 0.95), (side * (half - 2.0), side * (half + 0.3)), (floor, high + 1)
        )
        for side in (-1, 1)
    ]  # fmt: skip


def lid(robot: Robot) -> Manifold:
    """Return the foot's lid, on which the column stands."""
    w, holes = dimensions().wall, dimensions().screws
    radius, top = 1000 * robot.shape.pedestal_radius, lid_height(robot)
    low = top - _LID
    plate = hull(
        disc("z", (0, 0), (low, top - 1.0), radius),
        disc("z", (0, 0), (top - 1.0, top), radius - 1.0),
    )
    screws, rib = lid_screws(robot), dimensions().mega.width / 2 + 5.0
    rim = cut(
        disc("z", (0, 0), (low - 3.0, low + 0.1), radius - w.shell - 0.4),
        [
            disc("z", (0, 0), (low - 4.0, low), radius - 2 * w.shell - 0.4),
            box((-radius, radius), (-rib, rib), (low - 4.0, low)),
            *discs("z", screws, (low - 4.0, low), 4.5),
        ],
    )
    tools = [
        disc("z", (0, 0), (low - 1, top + 1), 20.0),  # the cables from the waist
        *discs("z", screws, (low - 1, top + 1), holes.m25_clearance / 2),
        *discs("z", screws, (top - 1.6, top + 1), holes.m25_head / 2),
        *discs("z", column_screws(robot), (low - 1, top + 1), holes.m25_clearance / 2),
    ]
    return cut(join([plate, rim]), tools)


def column(robot: Robot, fit: float) -> Manifold:
    """Return the column on the lid; the waist's servo hangs from the column's top."""
    s, w, holes = dimensions().servo, dimensions().wall, dimensions().screws
    radius, low = 1000 * robot.shape.torso_radius, lid_height(robot)
    frame = mount_of(robot, "waist").frame
    flange = radius + 11.0

    def grown(by: float, top: float) -> Manifold:
        """Return the column's outline; its foot widens at 45 degrees, so that it prints well."""
        return join(
            [
                disc("z", (0, 0), (low, top), radius - by),
                hull(
                    disc("z", (0, 0), (low, low + 3.0), flange - by),
                    disc("z", (0, 0), (low, low + 3.0 + flange - radius), radius - by),
                ),
            ]
        )

    rim = hull(
        disc("z", (0, 0), (-2.0, -1.0), radius), disc("z", (0, 0), (-1.0, 0.0), radius - 1.0)
    )
    outside = join([grown(0.0, -1.0), rim])
    screws = column_screws(robot)
    bosses = [boss ^ outside for boss in discs("z", screws, (low, low + 14.0), 4.6)]
    inside = grown(w.shell, -_LID) ^ box((-99, 99), (-99, 99), (low - 1, -_LID))
    hollow = join([cut(outside, [inside.translate((0, 0, -0.01))]), *bosses])
    # Walls around the case, down to its sockets.
    wide, long = s.half_width + fit, s.long_end + fit
    sleeve = box(
        (-long - w.shell, -s.short_end + fit + w.shell), (-wide - w.shell, wide + w.shell),
        (-_LID - 9.0, -_LID + 0.1),
    ) ^ disc("z", (0, 0), (-30, 0), radius - 0.5)  # fmt: skip
    tools = [
        moved(servo.case(fit), frame),
        disc("z", (0, 0), (-_LID - 1, 1), s.horn_diameter / 2 + 0.5),
        *(moved(hole, frame) for hole in servo.case_screws(s.case_holes_z, s.front, 1)),
        # The column's screws come from below, through the lid.
        *discs("z", screws, (low - 1, low + 12), holes.m25_pilot / 2),
        # The hole for the hub's wires.
        hull(*discs("z", [(_CABLE_CIRCLE, y) for y in (-3.0, 3.0)], (-10, 1), _CABLE)),
    ]
    pin = disc("z", (_STOP_CIRCLE, 0), (-0.1, _GAP + 2.0), _STOP_RADIUS)
    return join([cut(join([hollow, sleeve]), tools), pin])


def _outline(radius: float, low: float, high: float, flat: float) -> Manifold:
    """Return a round column with a flat on each side."""
    column = disc("z", (0, 0), (low, high), radius)
    return column ^ box((-radius, radius), (-flat, flat), (low - 1, high + 1))


def _shell(robot: Robot) -> Manifold:
    """Return torso and chest as one: a hollow column with a floor, a roof and the side walls."""
    s, w = dimensions().servo, dimensions().wall
    radius = 1000 * robot.shape.torso_radius
    high, roof = 1000 * robot.lengths.L01, neck_floor(robot)
    side = shoulder_face() - SIDE_GAP
    begin = high - s.long_end - 6.0  # the flats for the shoulders begin here
    low = _GAP
    whole = join(
        [
            hull(
                disc("z", (0, 0), (low, low + 1.0), radius - 2.5),
                disc("z", (0, 0), (low + 3.0, begin), radius),
            ),
            _outline(radius, begin, roof, side),
        ]
    )
    inner = radius - w.shell
    bay = join(
        [
            disc("z", (0, 0), (low + _FLOOR, begin - 2.0), inner),
            _outline(inner, begin - 2.1, roof - _ROOF, side - (2.8 - SIDE_GAP + 0.2)),
        ]
    )
    return cut(whole, [bay])


def torso(robot: Robot, fit: float) -> Manifold:
    """Return the torso's back: it carries both shoulders' servos, the neck and the cables' hub."""
    s, holes = dimensions().servo, dimensions().screws
    high, roof = 1000 * robot.lengths.L01, neck_floor(robot)
    front = _split(robot)
    boss = disc("z", (0, 0), (0.0, _GAP + 0.1), 8.4)
    waist = mount_of(robot, "waist").frame
    radius, stands = 1000 * robot.shape.torso_radius, hub_floor(robot)
    within = disc("z", (0, 0), (_GAP + _FLOOR, high), radius - dimensions().wall.shell + 0.5)
    seat = [groove ^ within for groove in _grooves(-24.0, 17.4, stands, stands + 20.0, radius)]
    body = join([cut(_shell(robot), [front]), boss, *_ears(robot), *seat])
    tools = [moved(hole, waist) for hole in servo.horn_screws(s.horn_face, 1)]
    for side, sign in (("right", -1), ("left", 1)):
        frame = mount_of(robot, f"{side}_shoulder").frame
        tools += [moved(hole, frame) for hole in servo.case_screws(s.case_holes_z, s.front, 1)]
        tools.append(moved(servo.case(fit), frame))
        ends = sorted((sign * 20.0, sign * 40.0))
        tools.append(disc("y", (0, high), ends, s.horn_diameter / 2 + 0.5))
    tools += [
        *discs("z", NECK_SCREWS, (roof - 10, roof + 10), holes.m25_pilot / 2),
        # For a screwdriver, and later for the head's cable.
        disc("z", (0.0, 0.0), (roof - 10, roof + 10), _DRIVER),
        *discs("x", chest_screws(robot), (-40, 40), holes.m2_pilot / 2),
        # The shoulders' cables leave at the back of each shoulder.
        disc("y", (-22.0, high - 8.0), (-40.0, -15.0), 4.5),
        disc("y", (-22.0, high - 8.0), (15.0, 40.0), 4.5),
    ]
    out = shoulder_face() - SIDE_GAP - 0.1
    pins = [servo.shoulder_pin(sign * 3.4).translate((0, sign * out, high)) for sign in (-1, 1)]
    return join([cut(body, [*tools, _stop_track(robot), _cable_arc(robot)]), *pins])


def _split(robot: Robot) -> Manifold:
    """Return the space in front of the servos, where the torso's shell belongs to the chest."""
    radius, roof = 1000 * robot.shape.torso_radius, neck_floor(robot)
    return box((chest_face(), 60), (-radius - 1, radius + 1), (_GAP + _FLOOR + 3.0, roof - _ROOF))


def chest_face() -> float:
    """Return how far in front of the robot's middle the chest begins, mm."""
    return dimensions().servo.half_width + 3.0


def chest_screws(robot: Robot) -> list[tuple[float, float]]:
    """Return y and z of the screws that hold the chest."""
    roof = neck_floor(robot)
    return [(side * 20.0, z) for side in (-1, 1) for z in (_GAP + _FLOOR + 8.0, roof - _ROOF - 5.0)]


def _ears(robot: Robot) -> list[Manifold]:
    """Return the blocks in the torso that the chest's screws go into."""
    x = chest_face()
    low, high = _GAP + _FLOOR, neck_floor(robot) - _ROOF
    blocks = []
    for y, z in chest_screws(robot):
        down = z < (low + high) / 2
        ends = (low - 0.1, z + 4.0) if down else (z - 4.0, high + 0.1)
        blocks.append(box((x - 2.5, x - 0.2), (y - 4.0, y + 4.0), ends))
    return blocks


def chest(robot: Robot, fit: float) -> Manifold:
    """Return the torso's front, which covers the cables' hub; four screws hold it."""
    holes, screws, x = dimensions().screws, chest_screws(robot), chest_face()
    radius = 1000 * robot.shape.torso_radius
    low, high = _GAP + _FLOOR + 3.0, neck_floor(robot) - _ROOF
    # Lugs for the screws, and the gap all round.
    whole = disc("z", (0, 0), (low, high), radius)
    lugs = [box((x, radius), (y - 4.0, y + 4.0), (z - 4.0, z + 4.0)) ^ whole for y, z in screws]
    inside = box((x + fit, 60), (-60, 60), (low + fit, high - fit))
    tools = [
        *discs("x", screws, (0, 60), holes.m2_clearance / 2),
        *discs("x", screws, (x + CHEST_SEAT, 60), holes.m2_head / 2),
    ]
    return cut(join([_shell(robot) ^ _split(robot), *lugs]) ^ inside, tools)


def _cable_arc(robot: Robot) -> Manifold:
    """Return the opening in the torso's floor in which the hub's wires move as the waist turns."""
    hole = CrossSection.circle(_CABLE + 0.3, 32).translate((_CABLE_CIRCLE, 0))
    beyond = dimensions().wall.stop + 12.0
    return _past_the_waist(robot, hole, beyond).extrude(_GAP + _FLOOR + 1.5).translate((0, 0, -1.0))


def _stop_track(robot: Robot) -> Manifold:
    """Return the groove under the torso where the column's pin runs, as far as the waist turns."""
    pin = CrossSection.circle(_STOP_RADIUS + 0.4, 24).translate((_STOP_CIRCLE, 0))
    swept = _past_the_waist(robot, pin, dimensions().wall.stop)
    return swept.extrude(2.6 + 1.0).translate((0, 0, _GAP - 1.0))


def _past_the_waist(robot: Robot, flat: CrossSection, beyond: float) -> CrossSection:
    """Return the area that a part of the column sweeps in the torso as the waist turns.

    The waist turns through its range and ``beyond`` degrees further at both ends. In the torso's
    frame, the part of the column turns in the opposite direction.
    """
    low, high = range_of(robot, "waist")
    more = beyond * pi / 180
    return around(-high - more, -low + more, lambda turn: flat.rotate(turn * 180 / pi))
