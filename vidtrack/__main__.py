"""The door through which a rule enters: python -m vidtrack RULE --settings FILE --input NAME=PATH... --output NAME=PATH..."""

import sys

from vidtrack.entry import main

sys.exit(main(sys.argv[1:]))
