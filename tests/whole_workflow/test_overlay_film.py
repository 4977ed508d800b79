"""The overlay film: made on request alone, and shown on the page of its run."""

import av
import yaml

from tests.whole_workflow.conftest import configure, planned, snakemake


def test_a_film_is_made_on_request_and_then_has_a_poster_on_the_page(laboratory):
    film = laboratory / "results/runs/still/overlay_cam2.mp4"
    assert not list(laboratory.glob("results/runs/*/overlay_*"))
    answer = snakemake(laboratory, "results/runs/still/overlay_cam2.mp4")
    assert answer.returncode == 0, answer.stderr
    with av.open(str(film)) as shown:
        assert sum(1 for _ in shown.decode(video=0)) == 15
    assert planned(laboratory) == {"report_run": 1, "report": 1}
    assert snakemake(laboratory).returncode == 0
    page = (laboratory / "results/report/run_still.html").read_text()
    assert 'href="../runs/still/overlay_cam2.mp4"' in page
    assert "data:image/jpeg" in page
    assert "overlay_" not in (laboratory / "results/report/run_pluck.html").read_text()
    # the config asks for those of all runs; the one that was made stays as it is
    config = yaml.safe_load((laboratory / "config.yaml").read_text())
    configure(laboratory, {**config, "report": {"overlay": True}})
    assert planned(laboratory) == {"overlay_film": 3, "report_run": 2, "report": 1}
