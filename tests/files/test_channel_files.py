"""Records of other instruments, in every format that is read."""

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from vidtrack.errors import VidtrackError
from vidtrack.files.channel_files import read_channels

T = np.arange(0, 2, 0.01)
ETA = np.sin(T)
LOAD = np.where(np.arange(T.size) == 7, np.nan, 5 * T)
TABLE = pd.DataFrame({"t": T, "eta_m": ETA, "load_N": LOAD})
COLUMNS = {"eta": "eta_m", "load": "load_N"}


def expect(found):
    assert list(found.columns) == ["time_s", "eta", "load"]
    assert found["time_s"].to_numpy() == pytest.approx(T)
    assert found["eta"].to_numpy() == pytest.approx(ETA)
    assert found["load"].isna().to_numpy().nonzero()[0].tolist() == [7]


@pytest.mark.parametrize("ending", ["csv", "parquet", "mat"])
def test_a_record_is_the_same_in_each_format(tmp_path, ending):
    path = str(tmp_path / f"daq.{ending}")
    if ending == "csv":
        TABLE.to_csv(path, index=False)
    elif ending == "parquet":
        TABLE.to_parquet(path)
    else:
        savemat(path, {name: TABLE[name].to_numpy() for name in TABLE})
    expect(read_channels(path, COLUMNS, time="t"))


def test_a_structure_and_a_matrix_of_a_mat_file_are_read_by_their_parts(tmp_path):
    path = str(tmp_path / "daq.mat")
    savemat(path, {"daq": {"t": T, "data": np.column_stack([ETA, LOAD])}})
    expect(read_channels(path, {"eta": "daq.data:1", "load": "daq.data:2"}, time="daq.t"))
    with pytest.raises(VidtrackError, match=r"daq.data has the shape 200 x 2. Name one of its columns, as daq.data:1"):
        read_channels(path, {"eta": "daq.data"}, time="daq.t")


def test_a_mat_file_of_version_7_3_is_refused_with_what_to_do(tmp_path):
    path = tmp_path / "daq.mat"
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(head.ljust(512, b"\0") + b"\x89HDF\r\n\x1a\n")
    with pytest.raises(VidtrackError, match="-v7"):
        read_channels(str(path), {"eta": "eta"}, time="t")


def test_tdms_channels_bring_their_own_clock_or_name_it(tmp_path):
    import nptdms

    path = str(tmp_path / "daq.tdms")
    clocked = {"wf_increment": 0.01, "wf_start_offset": 0.0}
    channels = [nptdms.ChannelObject("basin", n, v, properties=clocked) for n, v in (("eta", ETA), ("load", LOAD))]
    with nptdms.TdmsWriter(path) as file:
        file.write_segment([*channels, nptdms.ChannelObject("basin", "t", T)])
    expect(read_channels(path, {"eta": "basin/eta", "load": "load"}, time=None))
    expect(read_channels(path, {"eta": "basin/eta", "load": "load"}, time="t"))
    expect(read_channels(path, {"eta": "basin/eta", "load": "load"}, time="time_s"))


def test_without_the_package_a_tdms_file_is_refused_with_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "nptdms", None)
    (tmp_path / "daq.tdms").write_bytes(b"TDSm")
    with pytest.raises(VidtrackError, match="pip install npTDMS"):
        read_channels(str(tmp_path / "daq.tdms"), {"eta": "eta"}, time=None)


def test_samples_at_a_rate_need_no_times(tmp_path):
    path = str(tmp_path / "daq.csv")
    TABLE[["eta_m"]].to_csv(path, index=False)
    assert read_channels(path, {"eta": "eta_m"}, time=None, rate=100)["time_s"].to_numpy() == pytest.approx(T)
    with pytest.raises(VidtrackError, match="has no times"):
        read_channels(path, {"eta": "eta_m"}, time=None)


@pytest.mark.parametrize("ending", ["parquet", "mat"])
def test_what_is_no_such_file_is_refused_in_a_line(tmp_path, ending):
    path = tmp_path / f"daq.{ending}"
    path.write_bytes(b"not what it says" * 20)
    with pytest.raises(VidtrackError, match=r"cannot be read as (Parquet|MAT)"):
        read_channels(str(path), {"eta": "eta"}, time="t")


def test_a_name_that_is_not_there_times_that_fall_and_lengths_that_differ_are_refused(tmp_path):
    path = str(tmp_path / "daq.mat")
    savemat(path, {"t": T, "eta_m": ETA, "short": ETA[:5], "back": T[::-1], "words": "abc"})
    for columns, time, says in (
        ({"eta": "eta"}, "t", "no channel 'eta'; did you mean 'eta_m'"),
        ({"eta": "eta_m"}, "time", "no channel 'time'"),
        ({"eta": "short"}, "t", "differ in length .t 200, short 5"),
        ({"eta": "eta_m"}, "back", "do not rise: row 2"),
        ({"eta": "words"}, "t", "holds no numbers"),
    ):
        with pytest.raises(VidtrackError, match=says):
            read_channels(path, columns, time=time)


@pytest.mark.parametrize("name", ["time_ms", "time (ms)"])
def test_times_in_milliseconds_are_refused_in_every_format(tmp_path, name):
    path = tmp_path / "gauges.csv"
    path.write_text(f"{name},gauge\n0,1\n5,2\n")
    own = name if name == "time_ms" else "time"
    with pytest.raises(VidtrackError, match="is in ms, and vidtrack reads"):
        read_channels(str(path), {"wave": "gauge"}, time=own)
    if name == "time_ms":
        table = pd.DataFrame({name: [0.0, 5.0], "gauge": [1.0, 2.0]})
        table.to_parquet(tmp_path / "gauges.parquet")
        with pytest.raises(VidtrackError, match="time_ms is in ms"):
            read_channels(str(tmp_path / "gauges.parquet"), {"wave": "gauge"}, time=name)
