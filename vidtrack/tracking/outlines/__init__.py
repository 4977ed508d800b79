"""The rim of a target beside its light: cut discs, shadows and highlights, balls that a lamp lights from one side."""
