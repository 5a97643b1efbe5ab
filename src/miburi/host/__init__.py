"""The processes of a live partner: they are started, watched over and ended here."""
