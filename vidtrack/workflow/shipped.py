"""Where the workflow's own files and the example scenarios lie: beside the package in the repo, inside it where it was
installed.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from vidtrack.errors import VidtrackError
from vidtrack.naming import did_you_mean
from vidtrack.workflow.fingerprint import PACKAGE


def workflow_file(*parts: str) -> str:
    """The path of a file of the workflow, named as in the repo: Snakefile, profiles/default.

    VidtrackError where neither the repo nor the package has it.
    """
    for house in (os.path.dirname(PACKAGE), os.path.join(PACKAGE, "shipped")):
        if os.path.isfile(os.path.join(house, "workflow", "Snakefile")) and os.path.exists(os.path.join(house, *parts)):
            return os.path.join(house, *parts)
    raise VidtrackError(f"{'/'.join(parts)}: the workflow is not installed with vidtrack. Install it again.")


SCENARIOS = {name: ("data", f"{name}.yaml") for name in ("tutorial", "demo", "float", "tank", "wand", "action")}
"""Scenarios of the simulator that come with vidtrack, by name."""

PLANS = {"thesis": ("data", "sensitivity", "thesis.yaml")}
"""Rigs on paper that come with vidtrack, by name."""


def example_or_file(name: str, examples: Mapping[str, tuple[str, ...]]) -> str:
    """The path of an example that comes with vidtrack, where `name` is one and no file of that name is here.

    VidtrackError where it is neither.
    """
    if os.path.exists(name):
        return name
    if name in examples:
        return workflow_file(*examples[name])
    near = did_you_mean(name, examples)
    hint = (
        f"Did you mean {near!r}?"
        if near
        else f"Name a YAML file, or one that comes with vidtrack: {', '.join(examples)}."
    )
    raise VidtrackError(f"{name}: no such file. {hint}")
