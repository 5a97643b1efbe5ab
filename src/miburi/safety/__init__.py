"""Moves, profiles, the contact rule and stops, as in the firmware; and the paper's rule as printed.
"""
