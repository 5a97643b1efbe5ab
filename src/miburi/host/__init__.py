"""The processes of a running partner: start, watch and end them."""
