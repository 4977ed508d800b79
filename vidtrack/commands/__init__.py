"""The commands of `vidtrack`, one module each: options in, lines on the terminal out, the work done by other rooms."""
