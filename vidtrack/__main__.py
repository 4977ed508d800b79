"""The door through which a rule enters: python -m vidtrack RULE --settings FILE --input ... --output ..."""

import sys

from vidtrack.workflow.entry import main

sys.exit(main(sys.argv[1:]))
