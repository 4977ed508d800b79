"""One film in the places of two cameras is recognised by its tracks, whatever its coder and size."""

import numpy as np
import pytest

from tests.stages.test_locate import centroids, other, pluck
from vidtrack.location.cameras.followed import rows_of, view_of
from vidtrack.location.cameras.same_film import same_film
from vidtrack.memory import columns_of
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.locate import locate

RIG = thesis_rig(3)


def seen(camera=RIG[0], targets=("pluck", "other"), seed=1):
    motions = {"pluck": pluck, "other": other}
    return centroids(camera, {name: motions[name] for name in targets}, rng=np.random.default_rng(seed))


def view(name, table, camera):
    return view_of(name, rows_of(columns_of(table)), None, camera, None)


def copied(table, scale=1.0, noise=0.03, shift=0):
    """The table of the same film, coded again at another size."""
    out = table.copy()
    rng = np.random.default_rng(3)
    for axis in ("Xf", "Yf"):
        out[axis] = (out[axis] + 0.5) * scale - 0.5 + rng.normal(0, noise, len(out))
    return out[out["time_s"] >= np.unique(out["time_s"])[shift]]


@pytest.mark.parametrize("scale", [1.0, 0.5, 2.0])
@pytest.mark.parametrize("shift", [0, 3])
def test_a_copy_is_named_whatever_its_size_and_its_beginning(scale, shift):
    table = seen()
    small = RIG[1].with_(image_size=tuple(int(side * scale) for side in RIG[0].image_size))
    (finding,) = same_film([view("cam1", table, RIG[0]), view("cam2", copied(table, scale, shift=shift), small)], False)
    assert finding.code == "same-film"
    assert finding.level == "bad"
    assert finding.text.startswith("cam1 and cam2 show one film, coded again")
    assert ("px wide where" in finding.text) == (scale != 1.0)


def test_cameras_that_see_the_same_targets_from_elsewhere_show_no_one_film():
    assert same_film([view(c.name, seen(c), c) for c in RIG], False) == []


def test_what_rests_at_one_place_of_both_pictures_is_no_copy():
    table = seen()
    rest = table.assign(Xf=200.0, Yf=100.0)
    assert same_film([view("cam1", rest, RIG[0]), view("cam2", copied(rest), RIG[1])], False) == []


@pytest.mark.parametrize(("count", "level"), [(2, "bad"), (4, "doubtful")])
def test_a_run_with_a_copy_says_so(count, level):
    rig = thesis_rig(count)
    tables = {c.name: seen(c, seed=k) for k, c in enumerate(rig)}
    tables["cam2"] = copied(tables["cam1"])
    found = locate(tables, {c.name: (c, None) for c in rig}, targets=["pluck", "other"]).record["findings"]
    (finding,) = [f for f in found if f["code"] == "same-film"]
    assert finding["level"] == level
