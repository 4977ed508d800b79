import numpy as np
import pytest
from scipy.io import loadmat, savemat

from tests.exchange.runs import NAMES, bodies, run
from vidtrack.errors import VidtrackError
from vidtrack.exchange.formats import written
from vidtrack.exchange.points.formats import read_measured


def qtm(path, markers=2, own_bodies=1, frames=12, **more):
    """A measurement as QTM has it: cells of names, arrays thing by number by frame."""
    rng = np.random.default_rng(markers)

    def cells(names):
        out = np.empty((1, len(names)), object)
        out[0, :] = names
        return out

    data = rng.uniform(-900, 900, (markers, 4, frames))
    data[0, :, 3] = np.nan
    record = {"File": "a.qtm", "Timestamp": "2021-03-04, 14:05:06.125\t1234.5", "FrameRate": 100.0, "Frames": frames}
    labels = ["bow", "stern \u00e9", "mast"][:markers]
    record["Trajectories"] = {"Labeled": {"Count": markers, "Labels": cells(labels), "Data": data}}
    if own_bodies:
        place = rng.uniform(-900, 900, (own_bodies, 3, frames))
        record["RigidBodies"] = {
            "Bodies": own_bodies,
            "Name": cells(["float", "buoy"][:own_bodies]),
            "Positions": place,
        }
    savemat(path, {"run_7": record | more}, long_field_names=True)
    return path


@pytest.mark.parametrize(("markers", "own_bodies"), [(2, 1), (1, 0), (1, 2), (3, 1)])
def test_markers_and_bodies_are_as_scipy_has_them(tmp_path, markers, own_bodies):
    path = qtm(tmp_path / "truth.mat", markers, own_bodies)
    found = read_measured(path)
    theirs = loadmat(path)["run_7"][0, 0]
    data = theirs["Trajectories"][0, 0]["Labeled"][0, 0]["Data"]
    assert len(found.names) == markers + own_bodies
    for k in range(markers):
        np.testing.assert_array_equal(found.p[:, k], data[k, :3].T)
    for k in range(own_bodies):
        np.testing.assert_array_equal(found.p[:, markers + k], theirs["RigidBodies"][0, 0]["Positions"][k].T)
    assert np.isnan(found.p[3, 0]).all()
    assert found.start_s == 14 * 3600 + 5 * 60 + 6.125
    np.testing.assert_allclose(np.diff(found.time_s), 0.01)
    assert (found.unit, found.format) == ("mm", "QTM")


def test_what_vidtrack_writes_for_qtm_comes_back(tmp_path):
    own = run()
    (tmp_path / "truth.mat").write_bytes(written("qtm", own).files["pluck_qtm.mat"])
    found = read_measured(tmp_path / "truth.mat")
    assert found.names == (*NAMES, "float")
    row = own.tables["trajectories"]
    row = row[row["target"] == NAMES[1]].iloc[0]
    np.testing.assert_allclose(found.p[0, 1], row[["x", "y", "z"]].to_numpy(float) * 25.4, rtol=1e-12)
    np.testing.assert_allclose(found.p[0, 3], bodies().iloc[0][["x", "y", "z"]].to_numpy(float) * 25.4, rtol=1e-12)


@pytest.mark.parametrize(
    ("broken", "what"),
    [
        (lambda path: path.write_bytes(path.read_bytes()[:700]), "not a whole MAT file"),
        (lambda path: path.write_bytes(b"MATLAB 7.3 MAT-file" + bytes(600)), "version 7.3"),
        (lambda path: path.write_text("no mat file at all, only words" * 40), "not a whole MAT file|no measurement"),
        (lambda path: savemat(path, {"x": np.eye(3)}), "no measurement of QTM"),
        (lambda path: qtm(path, FrameRate=0.0), "not positive"),
        (lambda path: qtm(path, Trajectories=0.0, RigidBodies=0.0), "no labelled marker and no body"),
    ],
)
def test_what_is_no_measurement_is_refused_in_one_line(tmp_path, broken, what):
    path = qtm(tmp_path / "truth.mat")
    broken(path)
    with pytest.raises(VidtrackError, match=what) as error:
        read_measured(path)
    assert "\n" not in str(error.value)
