"""What the partner says: small answers, care in distress, and what a language model may add."""
