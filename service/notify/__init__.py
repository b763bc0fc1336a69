"""Messages: recipients, the outbox, delivery, and the record of every attempt."""
