"""Check numbers, seeds and deadlines that a caller passes; an invalid one is an error."""

import time
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from miburi.errors import InputError

Seed = int | np.random.Generator


def real_numbers(values: Any, name: str, wanted: str) -> NDArray[np.float64]:
    """Return a copy of ``values`` as contiguous float64.

    Raises
    ------
    InputError
        A value is too large, masked or not a real number (text and dates are not). The message
        contains ``name``, and ``wanted``, which describes the allowed values.
    """
    try:
        array = np.asarray(values)
        rows = [values, *values] if isinstance(values, list | tuple) else [values]
        if array.dtype.kind == "O" and all(isinstance(one, Real) for one in array.flat):
            array = array.astype(np.float64)
        if array.dtype.kind not in "biuf" or any(map(np.ma.is_masked, rows)):
            raise TypeError(f"no real numbers: {array.dtype}")
        return np.array(array, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} must be {wanted}, got {values!r}.") from error


def clock_limit(deadline: float | None) -> float:
    """Convert a deadline, in seconds from now (above 0), to a time on ``perf_counter``'s clock."""
    if deadline is None:
        return np.inf
    if not isinstance(deadline, int | float | np.number) or not deadline > 0:
        raise InputError(f"deadline must be a number above 0 s, got {deadline!r}.")
    return time.perf_counter() + float(min(deadline, 1e300))


def seed_of(seed: Any) -> int:
    """Return the number from 0 to 2**63 - 1 that a seed or a NumPy generator stands for."""
    if type(seed) is int and 0 <= seed < 1 << 63:
        return seed
    if isinstance(seed, np.random.Generator):
        return int(seed.integers(1 << 63))
    if not isinstance(seed, np.integer) or not 0 <= seed < 1 << 63:
        raise InputError(
            f"seed must be a whole number from 0 to 2**63 - 1, or a NumPy generator, got {seed!r}."
        )
    return int(seed)
