import pytest
from pydantic import ValidationError

from miburi.gestures.effort import Effort


def test_effort_is_four_numbers_from_0_to_1():
    Effort(space=0.0, weight=1.0, time=0.5, flow=0.25)
    with pytest.raises(ValidationError):
        Effort(space=1.1, weight=1.0, time=0.5, flow=0.25)
