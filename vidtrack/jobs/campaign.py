"""Job campaign: what was analysed in each run, and under which conditions -> results/campaign.json and its page."""

from __future__ import annotations

from vidtrack.analysis.campaign import campaign
from vidtrack.files.records import plain, read_json, write_json
from vidtrack.report.campaign_page import campaign_page
from vidtrack.report.page_file import write_page
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: records (analysis.json of each run that was analysed). outputs: record, page.

    settings: title, units, rows: run, H, T, heading, scale, repeat, notes and analysis of each run.
    """
    order = job.settings
    records = {str(record["run"]): record for record in map(read_json, job.paths("records"))}
    found = plain({"units": order["units"], **campaign(order["rows"], records)})
    write_json(job.outputs["record"], found, job.provenance)
    page = campaign_page(found, units=order["units"], title=order["title"], provenance=job.provenance)
    write_page(job.outputs["page"], page)
