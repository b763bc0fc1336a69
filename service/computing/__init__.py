"""The worker: it claims work, has it computed elsewhere and writes what comes of it."""
