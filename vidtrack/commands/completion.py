"""vidtrack completion."""

from __future__ import annotations

import sys

import click
from click.shell_completion import get_completion_class

SHELLS = ("bash", "zsh", "fish")


@click.command("completion", epilog='\b\nExample, for ~/.bashrc:\n  eval "$(vidtrack completion bash)"')
@click.argument("shell", type=click.Choice(SHELLS))
def command(shell: str) -> None:
    """Print what SHELL needs to complete commands, options and folders with the tab key."""
    found = get_completion_class(shell)
    assert found is not None
    root = click.get_current_context().find_root().command
    sys.stdout.write(found(root, {}, "vidtrack", "_VIDTRACK_COMPLETE").source() + "\n")
