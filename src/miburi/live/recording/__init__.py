"""Recordings: MCAP files of what the body did and the partner felt, and where they are kept."""
