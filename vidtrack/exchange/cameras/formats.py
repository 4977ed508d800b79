"""Which program a camera's file is of, and its camera."""

from __future__ import annotations

import os

from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras import anipose, argus, dlt, metashape, opencv, openptv
from vidtrack.exchange.cameras.given import Given, Said, needed_size
from vidtrack.exchange.text import Path, text_of
from vidtrack.exchange.thesis.camparm import Fixed
from vidtrack.exchange.thesis.outcam import camera_of, read_outcam
from vidtrack.exchange.xml import parsed


def read_camera(path: Path, said: Said) -> Given:
    """The camera in a file of any format that is known; VidtrackError, one line, for what cannot be read."""
    try:
        return _read(path, said)
    except (ValueError, ArithmeticError) as error:  # numbers of which no camera can be made
        reason = " ".join(str(error).split())[:150]
        raise VidtrackError(f"{path}: holds no camera that can be used ({reason}). Export it again.") from None


def _read(path: Path, said: Said) -> Given:
    ending = os.path.splitext(os.fspath(path))[1].lower()
    if ending == ".ori":
        return openptv.read(path, said)
    text = text_of(path)
    if text.lstrip().startswith("<"):
        root = parsed(path)
        return opencv.read(path, said) if root.tag == "opencv_storage" else metashape.read(path, said, root)
    if ending == ".toml":
        return anipose.read(path, said)
    if ending in (".yaml", ".yml") or text.startswith("%YAML"):
        return opencv.read(path, said)
    if ending == ".prn":
        return _of_thesis(path, said)
    if argus.looks_like_profiles(path):
        raise VidtrackError(
            f"{path}: an Argus camera profile, a lens without a pose. Put the DLT coefficients there, and name "
            "the profile in "
            f"cameras.{said.name}.camera_file.lens."
        )
    if ending in (".csv", ".txt", ".dlt", ".tsv"):
        return dlt.read(path, said)
    raise VidtrackError(
        f"{path}: no camera of a program that is known: anipose TOML, OpenCV YAML, OpenPTV .ori, DLT "
        "coefficients, Metashape "
        "XML or the thesis's outcam1.prn."
    )


def _of_thesis(path: Path, said: Said) -> Given:
    out = read_outcam(path)
    width, height = needed_size(said, "thesis")
    for key, value in (("Cx", said.Cx), ("Cy", said.Cy), ("sensor", said.sensor)):
        if value is None:
            raise VidtrackError(
                f"config.yaml: cameras.{said.name}.{key}: it is in camparm.dat, not in {path}. Give it as it "
                "stands there."
            )
    assert said.Cx is not None and said.Cy is not None and said.sensor is not None  # noqa: PT018
    fixed = Fixed(width, height, width, said.Cx, said.Cy, *said.sensor)
    return Given("thesis", camera_of(out, fixed, said.name), 1e-5)
