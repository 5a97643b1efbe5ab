"""Communication between the partner's process and the others: pipes, messages, answers."""
