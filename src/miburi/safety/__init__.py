"""Moves, profiles, the contact rule and stops; all but the printed rule have a firmware twin."""
