"""What requests may say, and what is answered."""
