"""Where the workflow's own files lie: beside the package in the repo, inside it where it was installed."""

from __future__ import annotations

import os

from vidtrack.errors import VidtrackError
from vidtrack.workflow.fingerprint import PACKAGE


def workflow_file(*parts: str) -> str:
    """The path of a file of the workflow, named as in the repo: Snakefile, profiles/default.

    VidtrackError where neither the repo nor the package has it.
    """
    for house in (os.path.dirname(PACKAGE), os.path.join(PACKAGE, "shipped")):
        if os.path.isfile(os.path.join(house, "workflow", "Snakefile")) and os.path.exists(os.path.join(house, *parts)):
            return os.path.join(house, *parts)
    raise VidtrackError(f"{'/'.join(parts)}: the workflow is not installed with vidtrack. Install it again.")
