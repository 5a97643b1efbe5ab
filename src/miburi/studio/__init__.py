"""The web pages of a running partner: the studio and the face."""
