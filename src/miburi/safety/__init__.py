"""What must equal the firmware, header for header: moves, profiles, the contact rule, stops."""
