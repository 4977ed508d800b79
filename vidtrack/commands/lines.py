"""Lines for a person: on a terminal they are broken between words, into a file or a pipe they go whole."""

from __future__ import annotations

import shutil
import sys
import textwrap

import click

INDENT = "    "
"""Before what goes on with a line that was broken."""


def say(line: str) -> None:
    """Print a line on the standard output."""
    click.echo(broken(line, shutil.get_terminal_size().columns) if sys.stdout.isatty() else line)


def broken(line: str, width: int) -> str:
    """A line as lines of at most `width` characters; a word that is longer, such as a path, stays whole."""
    if len(line) <= width:
        return line
    indent = line[: len(line) - len(line.lstrip())]
    lines = textwrap.TextWrapper(max(width, 20), break_long_words=False, break_on_hyphens=False)
    lines.subsequent_indent = indent + INDENT
    return lines.fill(line)
