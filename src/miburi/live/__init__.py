"""The partner on the clock: runner, observer, memory, recordings."""
