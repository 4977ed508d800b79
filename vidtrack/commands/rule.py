"""vidtrack rule."""

from __future__ import annotations

import click


@click.command(
    "rule", context_settings={"ignore_unknown_options": True, "help_option_names": []}, add_help_option=False
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
def command(arguments: tuple[str, ...]) -> int:
    """Run one rule of the workflow; its order comes on the standard input."""
    from vidtrack.workflow.entry import main as run_rule

    return run_rule(arguments)
