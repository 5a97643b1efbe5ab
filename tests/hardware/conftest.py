"""The buildable robot's parts, which take a second to make."""

import pytest

from miburi.hardware.build import PrintedPart, printed_parts
from miburi.robot import buildable


@pytest.fixture(scope="session")
def parts() -> dict[str, PrintedPart]:
    return {part.name: part for part in printed_parts(buildable())}
