"""Derive the guards of the contact rule from free motion, and keep them in a file."""
