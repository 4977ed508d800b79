"""The list of formats against what the writers make, and against the config."""

from typing import get_args

import pytest

from tests.exchange.runs import camera, run
from tests.exchange.test_digitised import digitised_run
from tests.exchange.thesis.test_results import run as pair_run
from vidtrack.exchange.formats import FORMATS, Layout, places, written
from vidtrack.settings.exports import OTHER_NAMES, FormatName, formats

FULL = Layout("pluck", "space", ("cam1", "cam2"), ("float",))


def test_the_config_knows_exactly_these_formats():
    assert sorted(get_args(FormatName)) == sorted(FORMATS)
    assert set(OTHER_NAMES.values()) <= set(FORMATS)
    assert not set(OTHER_NAMES) & set(FORMATS)


def test_files_are_known_by_name_before_anything_is_measured(everything):
    for name in FORMATS:
        own = digitised_run() if "tracklets" in FORMATS[name].reads else everything
        own = pair_run() if "points" in FORMATS[name].reads else own
        assert sorted(written(name, own).files) == sorted(FORMATS[name].files(FULL)), name


@pytest.fixture
def everything():
    return run(cameras={name: camera(name) for name in FULL.cameras})


def test_several_files_lie_in_a_folder_of_their_own():
    assert places("c3d", FULL) == ["pluck.c3d"]
    assert all(place.startswith("csv/pluck_") for place in places("csv", FULL))


@pytest.mark.parametrize(
    ("name", "layout", "why"),
    [
        ("c3d", FULL._replace(mode="plane"), "no z"),
        ("mot", FULL._replace(bodies=()), "no bodies"),
        ("csv", FULL._replace(mode="waterline"), "no targets"),
        ("thesis", FULL._replace(cameras=("cam1", "cam2", "cam3")), "3 cameras, and the format two"),
    ],
)
def test_a_run_that_a_format_cannot_hold_is_known_before(name, layout, why):
    assert why in FORMATS[name].lacking(layout)
    assert not FORMATS[name].suits(layout)


def test_tables_suit_a_run_in_a_plane():
    assert FORMATS["csv"].suits(FULL._replace(mode="plane"))


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("WEC-Sim", "wecsim"),
        ("OpenFAST", "openfast"),
        ("matlab", "mat"),
        ("DLTdv 8", "dltdv8"),
        ("Agisoft", "metashape"),
        ("C3D", "c3d"),
        ("thesis", "thesis"),
    ],
)
def test_a_format_is_known_by_the_names_that_people_give_it(said, meant):
    assert formats([said, meant]) == (meant,)
