"""Pages in a real browser: one browser and one live partner for all files here."""
