"""Gestures measured: rehearsals, checks, pictures, the gallery."""
