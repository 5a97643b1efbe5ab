"""Perform gestures on the simulated body to measure, check, film and classify them."""
