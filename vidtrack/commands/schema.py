"""vidtrack schema."""

from __future__ import annotations

import sys

import click

_EXAMPLES = """
\b
Examples:
  vidtrack schema > vidtrack.schema.json
                  first line of config.yaml, for editors with YAML support:
                  # yaml-language-server: $schema=vidtrack.schema.json
"""


@click.command("schema", epilog=_EXAMPLES)
def command() -> None:
    """Print the JSON schema of config.yaml, for editors that complete and check by it."""
    from vidtrack.settings.config import schema_text

    sys.stdout.write(schema_text())
