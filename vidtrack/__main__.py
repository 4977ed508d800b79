"""The door through which a rule enters: python -m vidtrack RULE --settings FILE --input ... --output ..."""

import sys

from vidtrack.workflow.small_jobs import run_by_server

if __name__ == "__main__":
    code = run_by_server(sys.argv[1:])
    if code is None:
        from vidtrack.workflow.entry import main

        code = main(sys.argv[1:])
    sys.exit(code)
