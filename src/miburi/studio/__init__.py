"""The pages of a live partner: the studio and the face."""
