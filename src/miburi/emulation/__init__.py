"""The card's processor and its servos in virtual time."""
