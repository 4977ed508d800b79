"""`report`: what the report holds beyond its pages."""

from __future__ import annotations

from pydantic import Field

from vidtrack.settings.sections import Section


class Report(Section):
    """What is made on request."""

    overlay: bool = Field(
        False,
        description="whether each run gets results/runs/<run>/overlay_<camera>.mp4, its recordings with what was found "
        "drawn over them; a file of that name as a target of snakemake asks for that one alone",
    )
    one_file: bool = Field(
        False,
        description="whether results/report_one_file.html holds all pages of the report in one file, to be handed on",
    )
