"""The folder that a command works in, and the settings of the config.yaml there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from vidtrack.errors import VidtrackError

if TYPE_CHECKING:
    from vidtrack.settings.config import Settings

FOLDER = click.argument("folder", default=".", type=click.Path(file_okay=False))
"""The folder that holds config.yaml; this one where none is named."""

NO_COLOR = click.option("--no-color", is_flag=True, help="No colours on the terminal; NO_COLOR=1 does the same.")
"""As other programs name it."""


@contextmanager
def inside(folder: str) -> Iterator[None]:
    """Work in the folder, as Snakemake does: paths in messages and tables are as it has them."""
    if not os.path.isdir(folder):
        raise VidtrackError(f"{folder}: no such folder. Correct the name, or make it.")
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def settings_here() -> Settings:
    """The settings of the config.yaml in this folder; VidtrackError with every problem of it."""
    from vidtrack.files.config_file import read_config
    from vidtrack.settings.config import settings_from_config

    if not os.path.lexists("config.yaml"):
        raise VidtrackError(
            f"config.yaml: no such file in this folder ({os.getcwd()}). Call vidtrack init there, or name the "
            "experiment's folder."
        )
    config: dict[str, Any] = read_config("config.yaml")
    return settings_from_config(config)
