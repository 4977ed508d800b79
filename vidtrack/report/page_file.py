"""A page of the report as one HTML file that needs nothing beside it: script, style and pictures lie inside."""

from __future__ import annotations

import os
from pathlib import Path

from vidtrack.files.atomic import replacing
from vidtrack.report.page import Page


def write_page(path: str | os.PathLike[str], page: Page) -> None:
    """Write the page, whole or not at all."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    templates = Environment(
        loader=PackageLoader("vidtrack.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    script = Markup(Path(__file__).with_name("templates").joinpath("report.js").read_text("utf-8"))
    with replacing(path) as file:
        file.write(templates.get_template("page.html").render(page=page, script=script).encode())
