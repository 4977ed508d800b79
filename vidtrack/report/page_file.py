"""The report as one HTML file that needs nothing beside it: no script, no style sheet, no picture elsewhere."""

from __future__ import annotations

import os

from vidtrack.files.atomic import replacing
from vidtrack.report.page import Page


def write_page(path: str | os.PathLike[str], page: Page) -> None:
    """Write the page, whole or not at all."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    templates = Environment(
        loader=PackageLoader("vidtrack.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    with replacing(path) as file:
        file.write(templates.get_template("page.html").render(page=page).encode())
