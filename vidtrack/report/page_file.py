"""A page of the report as one HTML file that needs nothing beside it: script, style and pictures lie inside."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from vidtrack.files.atomic import replacing
from vidtrack.report.page import Page

if TYPE_CHECKING:
    from jinja2 import Template


def write_page(path: str | os.PathLike[str], page: Page) -> None:
    """Write the page, whole or not at all."""
    from markupsafe import Markup

    script = Markup(Path(__file__).with_name("templates").joinpath("report.js").read_text("utf-8"))
    with replacing(path) as file:
        file.write(prepare().render(page=page, script=script).encode())


@cache
def prepare() -> Template:
    """The template of a page; compiling it takes as long as writing a short page."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    templates = Environment(
        loader=PackageLoader("vidtrack.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return templates.get_template("page.html")
