"""An emulated card: its processor runs the real firmware, and emulated servos are on its bus."""
