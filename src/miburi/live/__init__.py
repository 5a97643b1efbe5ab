"""The partner in real time: the runner, what viewers see, the memory, and recordings."""
