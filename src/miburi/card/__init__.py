"""The real robot: an Arduino with the firmware, at the end of a serial line."""
