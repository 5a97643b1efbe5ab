"""Moves, profiles, contact rule and stops, as in the firmware; and the paper's printed rule."""
