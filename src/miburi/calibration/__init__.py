"""Derive the contact rule's guards, its tolerances, from free moves, and keep them in a file."""
