"""Fixtures shared by all rooms."""

import pytest
from hypothesis import settings

from miburi.robot import Robot, iphonoid

# The same examples on every machine, and no clock: machines are slow and noisy.
settings.register_profile("miburi", deadline=None, derandomize=True)
settings.load_profile("miburi")


@pytest.fixture(scope="session")
def robot() -> Robot:
    return iphonoid()
