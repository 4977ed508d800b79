"""The order that a rule gives to its job: settings, inputs, outputs and where the numbers come from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Job:
    """One run of one rule.

    settings     exactly the settings that the rule uses, as written by the workflow
    inputs       name -> path, or list of paths
    outputs      name -> path
    provenance   vidtrack's version, the settings and the input checksums; embedded in every output
    threads      how many processor cores the job may use
    """

    settings: dict[str, Any]
    inputs: dict[str, str | list[str]]
    outputs: dict[str, str]
    provenance: dict[str, Any] = field(default_factory=dict)
    threads: int = 1

    def path(self, name: str) -> str:
        """The one path of input `name`; KeyError where there is none, ValueError where there are several."""
        value = self.inputs[name]
        if not isinstance(value, str):
            if len(value) != 1:
                raise ValueError(f"input {name} has {len(value)} paths, not one")
            return value[0]
        return value

    def paths(self, name: str) -> list[str]:
        """All paths of input `name`, in the rule's order; empty where it has none."""
        value = self.inputs.get(name, [])
        return [value] if isinstance(value, str) else list(value)


SHARED = {"track_wand": "track", "body_sights": "locate"}
"""Rules that are done by another rule's job: what differs is what they are given."""


def module_of(rule: str) -> str:
    """The module that does a rule's job."""
    return f"vidtrack.jobs.{SHARED.get(rule, rule)}"
