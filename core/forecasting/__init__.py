"""Response to given ground motions, with what the records teach of its error."""
