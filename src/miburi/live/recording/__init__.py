"""Recordings: MCAP files of the body's motion and the partner's feelings, and their folder."""
