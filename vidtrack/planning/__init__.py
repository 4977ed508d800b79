"""A rig before it is built: what accuracy to expect, and what it depends on."""
