"""The page's server, by HTTP: who is let in, and what it answers."""

import http.client
import json
import threading

import pytest

from tests.preview.conftest import lab, rendered  # noqa: F401
from vidtrack.picking.desk import Desk
from vidtrack.picking.server import Server


@pytest.fixture(scope="module")
def served(rendered, tmp_path_factory):  # noqa: F811
    import os
    import shutil

    folder = tmp_path_factory.mktemp("served") / "lab"
    shutil.copytree(rendered, folder)
    before = os.getcwd()
    os.chdir(folder)
    server = Server(Desk())
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()
    os.chdir(before)


def request(server, method, path, body=None, **headers):
    """Status, headers and content of the answer; the token and the server's own host unless others are given."""
    wire = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    sent = {"Host": f"127.0.0.1:{server.port}", "X-Token": server.token, "Content-Type": "application/json"}
    sent |= {name.replace("_", "-"): value for name, value in headers.items()}
    wire.putrequest(method, path, skip_host=True)
    content = b"" if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    for name, value in {**sent, "Content-Length": str(len(content))}.items():
        if value is not None:
            wire.putheader(name, value)
    wire.endheaders(content)
    answer = wire.getresponse()
    return answer.status, dict(answer.headers), answer.read()


CLIP = {"kind": "clip", "name": "front", "camera": "cam1"}


@pytest.mark.parametrize(
    "headers",
    [
        {"X_Token": None},
        {"X_Token": "wrong"},
        {"X_Token": ""},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Host": "evil.example"},
        {"Host": "127.0.0.1:1"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"},
    ],
)
@pytest.mark.parametrize(("method", "path"), [("GET", "/state"), ("GET", "/"), ("POST", "/save"), ("POST", "/measure")])
def test_a_request_from_elsewhere_or_without_the_token_is_refused(served, method, path, headers):
    status, _, content = request(served, method, path, {} if method == "POST" else None, **headers)
    assert status == 403
    assert b"front" not in content
    assert served.token.encode() not in content


def test_it_listens_on_this_computer_only(served):
    assert served.server_address[0] == "127.0.0.1"


def test_the_page_holds_everything_itself_and_may_ask_no_one_else(served):
    status, headers, content = request(served, "GET", f"/?token={served.token}", X_Token=None)
    assert status == 200
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "connect-src 'self'" in policy
    assert "unsafe" not in policy
    text = content.decode()
    assert "http://" not in text
    assert "https://" not in text
    assert headers["Cache-Control"] == "no-store"
    assert headers["Referrer-Policy"] == "no-referrer"


def test_the_state_lists_every_recording_with_its_picks_and_tags(served):
    _, _, content = request(served, "GET", "/state")
    state = json.loads(content)
    assert [(v["kind"], v["name"], v["camera"]) for v in state["views"]][:2] == [
        ("clip", "front", "cam1"),
        ("clip", "front", "cam2"),
    ]
    assert len(state["views"][0]["rows"]) == 6
    assert state["views"][0]["tags"] == [str(n) for n in range(1, 13)]
    assert len(state["tags"]) == 36


def test_a_picture_is_a_jpeg_and_a_mask_is_a_png_of_its_size(served):
    import cv2
    import numpy as np

    status, headers, content = request(served, "GET", "/frame?kind=run&name=pluck&camera=cam1&n=3&low=0&high=255")
    assert (status, headers["Content-Type"]) == (200, "image/jpeg")
    assert cv2.imdecode(np.frombuffer(content, np.uint8), 0).shape == (480, 512)
    status, headers, content = request(served, "GET", "/mask?kind=run&name=pluck&camera=cam1&n=3")
    assert (status, headers["Content-Type"]) == (200, "image/png")
    mask = cv2.imdecode(np.frombuffer(content, np.uint8), 0)
    assert set(np.unique(mask)) == {0, 255}
    assert 20 < (mask > 0).sum() < 200  # one ball, 9 px wide


def test_what_is_measured_under_the_cursor_is_what_the_stage_measures(served):
    import numpy as np

    from vidtrack.labelling.shot import take
    from vidtrack.video.reader import open_video

    with open_video("calibration/front/cam1.mov") as video:
        frame = next(video.frames())
        shot = take([frame], {})
    i = 4
    given = {**CLIP, "n": 0, "x": float(shot.at[i, 0]) + 2, "y": float(shot.at[i, 1]) - 1, "reach": 3}
    _, _, content = request(served, "POST", "/measure", given)
    (blob,) = json.loads(content)["blobs"]
    np.testing.assert_allclose((blob["Xf"], blob["Yf"]), shot.at[i], atol=1e-9)
    np.testing.assert_allclose((blob["sd_x"], blob["sd_y"]), (shot.blobs.sd_x[i], shot.blobs.sd_y[i]), rtol=1e-6)
    assert blob["pixels"] == shot.blobs.pixels[i]


def test_how_many_pictures_are_counted_so_far_is_answered_while_a_recording_is_opened(served):
    served.desk.counted = 1234
    status, _, content = request(served, "GET", "/counted")
    assert (status, json.loads(content)) == (200, {"pictures": 1234})


def test_an_empty_place_has_no_blob(served):
    _, _, content = request(served, "POST", "/measure", {**CLIP, "n": 0, "x": 5, "y": 5, "reach": 3})
    assert json.loads(content)["blobs"] == []


@pytest.mark.parametrize(
    ("method", "path", "body", "status"),
    [
        ("GET", "/nothing", None, 404),
        ("GET", "/../config.yaml", None, 404),
        ("GET", "/frame?kind=clip&name=../..&camera=cam1&n=0", None, 422),
        ("GET", "/frame?kind=clip&name=front&camera=cam1&n=x", None, 400),
        ("POST", "/measure", {"kind": "clip"}, 400),
        ("POST", "/measure", b"{not json", 400),
        ("POST", "/save", b"", 400),
        ("POST", "/label", {"camera": "cam1", "picks": 3}, 400),
    ],
)
def test_a_request_that_makes_no_sense_gets_an_answer_and_does_no_harm(served, method, path, body, status):
    got, _, content = request(served, method, path, body)
    assert got == status, content
    assert "problem" in json.loads(content)
    assert request(served, "GET", "/state")[0] == 200


def test_a_threshold_that_is_no_setting_is_refused_and_nothing_is_written(served):
    from pathlib import Path

    before = Path("config.yaml").read_bytes()
    state = json.loads(request(served, "GET", "/state")[2])
    change = {"kind": "run", "name": "pluck", "changes": {"threshold": 999}}
    status, _, content = request(served, "POST", "/save", {"detect": [change], "config": state["config"]})
    assert status == 422
    assert "threshold" in json.loads(content)["problem"]
    assert Path("config.yaml").read_bytes() == before


@pytest.mark.parametrize("kind", ["clip", "run", "other"])
@pytest.mark.parametrize("name", ["../../../outside", "..", "/tmp", "front/../front", "new", ""])
def test_names_that_are_none_of_the_experiments_are_refused_and_nothing_is_written(served, kind, name):
    import os
    from pathlib import Path

    def lies_here():
        return sorted(str(path) for path in Path.cwd().parent.rglob("*")), Path("config.yaml").read_bytes()

    os.makedirs("../outside", exist_ok=True)
    before = lies_here()
    state = json.loads(request(served, "GET", "/state")[2])
    rows = [{"tag": "1", "target": "1", "Xf": 1, "Yf": 1, "width": 9, "height": 9}]
    tables = [{"kind": kind, "name": name, "camera": c, "rows": rows, "version": ""} for c in state["cameras"]]
    changes = [{"kind": kind, "name": name, "changes": {"threshold": 90}}]
    for given in ({"tables": tables}, {"detect": changes, "config": state["config"]}):
        status, _, content = request(served, "POST", "/save", given)
        assert status == 422, content
    assert request(served, "POST", "/save", {"tags": {name: "1-4"}, "config": state["config"]})[0] == 422
    asked = f"kind={kind}&name={name}&camera=cam1&n=0"
    assert {request(served, "GET", f"/{what}?{asked}")[0] for what in ("frame", "mask", "info")} <= {400, 422}
    assert lies_here() == before


def test_a_file_that_has_changed_since_is_not_overwritten(served):
    from pathlib import Path

    before = Path("calibration/front/picks.csv").read_bytes()
    status, _, content = request(served, "POST", "/save", {"tables": [{**CLIP, "rows": [], "version": "old"}]})
    assert status == 409
    assert "another window" in json.loads(content)["problem"]
    assert Path("calibration/front/picks.csv").read_bytes() == before
