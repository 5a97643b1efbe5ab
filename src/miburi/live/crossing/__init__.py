"""Between the partner's process and the others: pipes, messages, and who answers them."""
