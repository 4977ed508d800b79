"""Where the pages of a report lie, seen from each other: the first page above, all others in the folder `report`."""

from __future__ import annotations

from collections.abc import Iterable
from urllib.parse import quote

INDEX = "report.html"
FOLDER = "report"
CALIBRATION = "calibration.html"
CAMPAIGN = "campaign.html"


def run_file(run: str) -> str:
    """The file of a run's page, in the folder."""
    return f"run_{run}.html"


def addresses(runs: Iterable[str], cameras: Iterable[str], *, calibration: bool, folder: str = "") -> dict[str, str]:
    """By the key of a section, the address of the page that has it.

    runs, cameras   those with a page; folder: of the pages, seen from the page that has the links, with its slash
    """
    out = {f"run-{run}": f"{folder}{quote(run_file(run))}" for run in runs}
    if calibration:
        page = f"{folder}{CALIBRATION}"
        out |= {"calibration": page} | {f"camera-{c}": f"{page}#camera-{quote(c)}" for c in cameras}
    return out
