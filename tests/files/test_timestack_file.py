import numpy as np

from vidtrack.files.timestack_file import read_timestacks, write_timestacks

STACKS = {"north": {"grey": np.arange(12, dtype=np.uint8).reshape(3, 4), "s": np.linspace(0, 1, 4)}}


def test_timestacks_come_back_as_they_were(tmp_path):
    write_timestacks(tmp_path / "w.npz", STACKS)
    read = read_timestacks(tmp_path / "w.npz")
    assert read["north"]["grey"].dtype == np.uint8
    assert (read["north"]["grey"] == STACKS["north"]["grey"]).all()
    assert (read["north"]["s"] == STACKS["north"]["s"]).all()


def test_the_same_timestacks_make_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        write_timestacks(tmp_path / name, STACKS)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
