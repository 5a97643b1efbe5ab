"""Fixtures for tests of the partner."""

import pytest
from tests.fixtures.partner import PaperBody, happy, run

from miburi.partner import Partner
from miburi.robot import Robot

Moving = tuple[Partner, PaperBody]


@pytest.fixture
def moving(robot: Robot) -> Moving:
    """A happy partner that has just begun a gesture, and its body."""
    body = PaperBody(robot)
    partner = Partner(body, happy())
    run(partner, 0.1)
    return partner, body
