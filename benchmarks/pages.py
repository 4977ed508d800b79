"""How large the pages of a season are, and how long they take to open in headless Chromium.

    PYTHONPATH=. python benchmarks/pages.py data/demo --runs 100

The runs of a processed experiment are listed again and again under other names until there are so many; the first page
is written for all of them, in a temporary folder, and opened; then each page that the experiment has.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

from vidtrack.files.results_files import read_results
from vidtrack.report.index_page import index_page
from vidtrack.report.page_file import write_page


def season(results: Path, folder: Path, runs: int) -> float:
    """Write the first page of a season under `folder`; how long it took, s."""
    found = read_results([str(results / "verdict.json"), str(results / "calibration/backprojection.json")])
    summaries = [json.loads(path.read_text()) for path in sorted(results.glob("report/run_*.json"))]
    judged = dict(found.verdict or {})["runs"]
    names = [f"run{i:03d}" for i in range(runs)]
    own = {name: summaries[i % len(summaries)] for i, name in enumerate(names)}
    found.summaries = {name: {**summary, "run": name} for name, summary in own.items()}
    found.verdict = {**(found.verdict or {}), "runs": {name: judged[summary["run"]] for name, summary in own.items()}}
    began = time.perf_counter()
    write_page(folder / "report.html", index_page(found, units="in", runs=names, title="season", provenance={}))
    return time.perf_counter() - began


def main() -> None:
    """Print a line a page: kB, and s from asking for it to all of it drawn."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("experiment", type=Path)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    arguments = parser.parse_args()
    results = arguments.experiment.resolve() / "results"
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        wrote = season(results, Path(folder), arguments.runs)
        print(f"first page of {arguments.runs} runs written in {wrote:.2f} s")
        pages = [Path(folder, "report.html"), *sorted(results.glob("report/*.html"))]
        browser = play.chromium.launch(executable_path=arguments.chromium, args=["--no-sandbox", "--disable-gpu"])
        for path in pages:
            page = browser.new_page(viewport={"width": 1200, "height": 900})
            faults: list[str] = []
            page.on("pageerror", lambda error, faults=faults: faults.append(str(error)))
            began = time.perf_counter()
            page.goto(path.as_uri())
            page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
            took = time.perf_counter() - began
            print(f"{path.name:24} {path.stat().st_size / 1e3:8.0f} kB {took:6.2f} s {faults or ''}")
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
