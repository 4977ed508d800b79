"""One module a rule: reads through the doors, calls its stage, writes through the doors."""
