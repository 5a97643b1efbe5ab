"""The robot on a card: an Arduino at the end of a serial line."""
