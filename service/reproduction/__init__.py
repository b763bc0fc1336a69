"""The paper's sections 7 and 8, computed again: what it prints beside what comes out here."""
