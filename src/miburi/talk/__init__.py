"""What the partner says: small answers, care in distress, and a language model's replies."""
