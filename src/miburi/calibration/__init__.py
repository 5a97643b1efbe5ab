"""From free motion to the contact rule's guards, and their file."""
