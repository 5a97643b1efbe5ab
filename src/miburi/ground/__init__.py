"""What every room stands on: compiled code, TOML at the door, whole files."""
