"""Moves, profiles, the contact rule and stops: the firmware has a twin of each module."""
