"""What happened to a live partner: one model, one log and one file, which every door reads."""
