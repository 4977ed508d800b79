"""Time stamps and time code: what files carry, and what of it is right."""
