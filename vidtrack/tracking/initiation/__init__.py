"""How tracks begin: the opening of a recording, trails of what moves in it, start boxes, late comers."""
