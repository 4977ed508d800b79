"""vidtrack schema."""

from __future__ import annotations

import sys

import click


@click.command("schema")
def command() -> None:
    """Print the JSON schema of config.yaml, for editors that complete and check by it."""
    from vidtrack.settings.config import schema_text

    sys.stdout.write(schema_text())
