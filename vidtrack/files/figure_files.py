"""Figures as files, and as pieces of a page."""

from __future__ import annotations

import base64
import io
import os
from typing import TYPE_CHECKING

from vidtrack.files.atomic import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_figure(path: str | os.PathLike[str], figure: Figure) -> None:
    """Write a figure as PNG; the same figure makes the same bytes."""
    with replacing(path) as file:
        figure.savefig(file, format="png", metadata={"Software": None})


def data_uri(figure: Figure) -> str:
    """A figure as a PNG that lies inside the page."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()


def file_uri(path: str | os.PathLike[str]) -> str:
    """A PNG or JPEG file as a picture that lies inside the page."""
    kind = "jpeg" if os.fspath(path).endswith(".jpg") else "png"
    with open(path, "rb") as file:
        return f"data:image/{kind};base64," + base64.b64encode(file.read()).decode()
