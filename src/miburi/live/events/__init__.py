"""What happened to a live partner: one model, one log, one file, and every door tells from it."""
