"""The page as a person uses it, in a browser."""

import os
import threading

import numpy as np
import pytest

from tests.picking.browser import choose, drag, needs_browser, open_page, pick, screen, wait
from tests.preview.conftest import lab, rendered  # noqa: F401
from vidtrack.files.tables import read_picks, read_targets
from vidtrack.picking.desk import Desk
from vidtrack.picking.server import Server

pytestmark = [pytest.mark.slow, needs_browser]
SHOTS = os.environ.get("VIDTRACK_SHOTS")


def shot(page, name):
    """Keep a picture of the page, where someone asks for it."""
    if SHOTS:
        page.screenshot(path=os.path.join(SHOTS, f"{name}.png"))


@pytest.fixture
def served(lab, monkeypatch):  # noqa: F811
    monkeypatch.chdir(lab)
    server = Server(Desk())
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()


def test_points_are_picked_a_box_is_drawn_and_what_is_saved_is_what_the_stages_read(lab, served):  # noqa: F811
    path = lab / "calibration/front/picks.csv"
    true = read_picks(str(path), "cam1").set_index("tag")
    path.unlink()
    served.desk.read()
    with open_page(served.address) as (page, troubles):
        choose(page, "clip front/cam1")
        assert "missing" in page.inner_text('[data-view="clip front/cam1"]')
        for tag in ("1", "3", "8", "12"):
            pick(page, tag, *true.loc[tag, ["Xf", "Yf"]])
        wait(page, "() => document.querySelector('#named').textContent.startsWith('36 of 36 points')")
        shot(page, "picked")
        page.keyboard.press("Control+z")
        wait(page, "() => document.querySelectorAll('#rows tr').length === 3")
        page.keyboard.press("Control+y")
        wait(page, "() => document.querySelector('#named').textContent.startsWith('36 of 36 points')")
        choose(page, "run pluck/cam1")
        page.fill("#target", "ball")
        ball = served.desk.look("run", "pluck", "cam1", 0, {}).blobs
        middle = float(ball.Xf[ball.mass.argmax()]), float(ball.Yf[ball.mass.argmax()])
        drag(page, (middle[0] - 20, middle[1] - 15), (middle[0] + 20, middle[1] + 15))
        wait(page, "() => document.querySelectorAll('#boxrows tr').length === 1")
        drag(page, middle, (middle[0] + 4, middle[1] - 3))
        page.mouse.move(*screen(page, *middle))
        wait(page, "() => document.querySelector('#measure').textContent.includes('1 blob')")
        page.select_option("#polarity", "dark")
        page.select_option("#polarity", "bright")
        page.fill("#threshold", "90")
        page.keyboard.press("Enter")
        shot(page, "box")
        page.click("#save")
        wait(page, "() => document.querySelector('#plan').textContent.includes(' x ')")
        assert "calibrate" in page.inner_text("#plan")
        shot(page, "saved")
        choose(page, "run pluck/cam2")
        wait(page, "() => document.querySelector('[data-view=\"run pluck/cam2\"]').textContent.includes('missing')")
    assert troubles == []
    picks = read_picks(str(path), "cam1").set_index("tag")
    assert list(picks.index) == ["1", "3", "8", "12"]
    blobs = served.desk.look("clip", "front", "cam1", 0, {}).blobs
    for _, row in picks.iterrows():
        away = np.hypot(blobs.Xf - row["Xf"], blobs.Yf - row["Yf"])
        assert away.min() < 0.01
    (box,) = read_targets(str(lab / "runs/pluck/targets.csv"), "cam1", (512, 480)).to_dict("records")
    assert box["target"] == "ball"
    assert (box["Xf"], box["Yf"]) == pytest.approx((middle[0] + 4, middle[1] - 3), abs=1.5)
    assert (box["width"], box["height"]) == pytest.approx((40, 30), abs=1.5)
    assert "threshold: 90" in (lab / "config.yaml").read_text()


OVERTAKEN = """async () => {
  const real = ask, camera = view().camera;
  let asked = 0, release = null;
  const held = new Promise((done) => { release = done; });
  ask = async (path, given) => {
    if (path !== "/label" || asked++) return real(path, given);
    await held;
    return { tags: {}, points: [], problems: [], rms: null };
  };
  const first = label(camera);
  await label(camera);
  release();
  await first;
  ask = real;
  return S.labels[camera].points.length;
}"""
"""An answer to an earlier question comes after that to a later one: how many points are named then."""


def test_a_wrong_pick_stands_out(lab, served):  # noqa: F811
    with open_page(served.address) as (page, troubles):
        choose(page, "clip front/cam1")
        wait(page, "() => document.querySelector('#named').textContent.startsWith('36 of 36')")
        first, other = page.evaluate("() => vidtrack.state.views[vidtrack.state.at].rows.slice(0, 2)")
        page.click("#rows tr:first-child")
        page.keyboard.press("Delete")
        wait(page, "() => document.querySelectorAll('#rows tr').length === 5")
        drag(page, (other["Xf"], other["Yf"]), (first["Xf"], first["Yf"]))
        wait(page, "() => document.querySelector('#problems').textContent.includes('picked at')")
        shot(page, "wrong")
        assert page.evaluate(OVERTAKEN) == 36
    assert troubles == []


def test_the_epipolar_line_of_a_box_runs_through_the_target_in_the_other_camera(lab, served):  # noqa: F811
    with open_page(served.address) as (page, troubles):
        choose(page, "run pluck/cam1")
        wait(page, "() => Object.keys(vidtrack.state.labels).length === 2")
        found = {}
        for camera in ("cam1", "cam2"):
            blobs = served.desk.look("run", "pluck", camera, 0, {}).blobs
            i = int(blobs.mass.argmax())
            found[camera] = float(blobs.Xf[i]), float(blobs.Yf[i])
        (x, y), (u, w) = found["cam1"], found["cam2"]
        page.fill("#target", "t1")
        drag(page, (x - 15, y - 15), (x + 15, y + 15))
        choose(page, "run pluck/cam2")
        wait(page, "() => vidtrack.state.curves.length > 0")
        curve = page.evaluate("() => vidtrack.state.curves[0].points")
        shot(page, "epipolar")
    assert (
        min((a - u) ** 2 + (b - w) ** 2 for a, b in curve) ** 0.5 < 5
    )  # px; points of the curve are 5 px apart or less
    assert troubles == []


def test_two_windows_do_no_harm(lab, served):  # noqa: F811
    path = lab / "calibration/front/picks.csv"
    with open_page(served.address) as (page, _):
        choose(page, "clip front/cam1")
        wait(page, "() => document.querySelectorAll('#rows tr').length === 6")
        path.write_text(path.read_text().rsplit("\n", 2)[0] + "\n")  # another window has saved meanwhile
        kept = path.read_text()
        page.click("#rows tr:first-child")
        page.keyboard.press("Delete")
        page.click("#save")
        wait(page, "() => document.querySelector('#status').textContent.includes('changed by another window')")
    assert path.read_text() == kept


def test_a_point_that_is_no_ball_is_placed_by_hand_with_its_own_sd_and_the_stages_take_it_so(lab, served):  # noqa: F811
    path = lab / "calibration/front/picks.csv"
    before = read_picks(str(path), "cam1")
    tag = before["tag"].iloc[-1]
    with open_page(served.address) as (page, troubles):
        choose(page, "clip front/cam1")
        wait(page, "() => document.querySelectorAll('#rows tr').length === 6")
        page.click("#rows tr:last-child")
        page.keyboard.press("Delete")
        wait(page, "() => document.querySelectorAll('#rows tr').length === 5")
        page.check("#hand")
        page.fill("#sd", "0.4")
        pick(page, tag, *before[["Xf", "Yf"]].iloc[-1] + [0.3, -0.2])
        wait(page, "() => document.querySelector('#named').textContent.startsWith('36 of 36 points')")
        page.click("#save")
        wait(page, "() => document.querySelector('#status').textContent === 'saved'")
    assert troubles == []
    row = read_picks(str(path), "cam1").set_index("tag").loc[tag]
    assert row["sd"] == 0.4
    assert row[["Xf", "Yf"]].tolist() == pytest.approx((before[["Xf", "Yf"]].iloc[-1] + [0.3, -0.2]).tolist(), abs=1)
    answer = served.desk.label("cam1", {"front": read_picks(str(path), "cam1").to_dict("records")})
    (point,) = [p for p in answer["points"] if p["tag"] == tag and p["clip"] == "front"]
    assert (point["Xf"], point["Yf"]) == pytest.approx(tuple(row[["Xf", "Yf"]]))  # where it was placed, not a blob


def test_a_box_is_resized_by_its_corner_and_moved_and_keys_do_what_the_page_says(lab, served):  # noqa: F811
    state = "vidtrack.state"
    with open_page(served.address) as (page, troubles):
        choose(page, "run pluck/cam2")
        page.fill("#target", "float")
        drag(page, (100, 100), (140, 130))
        box = f"() => {state}.views[{state}.at].rows[0]"
        wait(page, f"() => !!({box})()")
        drag(page, (140, 130), (160, 150))
        assert page.evaluate(box) == pytest.approx(
            {"target": "float", "Xf": 130, "Yf": 125, "width": 60, "height": 50}, abs=1.5
        )
        drag(page, (130, 125), (200, 225))
        assert page.evaluate(box) == pytest.approx(
            {"target": "float", "Xf": 200, "Yf": 225, "width": 60, "height": 50}, abs=1.5
        )
        page.keyboard.press("Control+z")
        assert page.evaluate(box)["Xf"] == pytest.approx(130, abs=1.5)
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Shift+ArrowRight")
        wait(page, f"() => {state}.n === 11")
        page.keyboard.press("ArrowLeft")
        wait(page, f"() => {state}.n === 10")
        scale = page.evaluate(f"() => {state}.scale")
        page.keyboard.press("+")
        assert page.evaluate(f"() => {state}.scale") == pytest.approx(1.3 * scale)
        middle = screen(page, 250, 240)
        page.mouse.move(*middle)
        page.mouse.wheel(0, -400)
        wait(page, f"() => {state}.scale > {3 * scale}")
        assert screen(page, 250, 240) == pytest.approx(middle, abs=0.5)  # the place under the cursor stays
        page.mouse.down(button="right")
        page.mouse.move(middle[0] + 30, middle[1] - 10)
        page.mouse.up(button="right")
        assert screen(page, 250, 240) == pytest.approx([middle[0] + 30, middle[1] - 10], abs=0.5)
        page.keyboard.press("0")
        assert page.evaluate(f"() => {state}.scale") == pytest.approx(scale)
        page.keyboard.press("]")
        assert page.input_value("#threshold") == "130"
        page.keyboard.press("m")
        assert page.is_hidden("#mask")
    assert troubles == []
