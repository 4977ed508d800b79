"""Agisoft Metashape's cameras.xml.

Source: the manual, appendix on camera models: u = w/2 + cx + x' f + x' b1 + y' b2, v = h/2 + cy + y' f.

origin          px: the corner of the top-left pixel is (0, 0); cx, cy are counted from the middle of the picture
axes            camera: x right, y down, z forward; transform (4 x 4, row by row) takes camera to world
units           transform in the experiment's unit, attribute `units` of the chunk; f, cx, cy, b1, b2 in px
lens            k1 to k3 and p1, p2 (exchanged against OpenCV's), from undistorted to distorted; of a wide lens k1 to k4
                and type fisheye: refitted over the picture; attribute largest_error_px has what the refit leaves
"""

from __future__ import annotations

from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from vidtrack.exchange.colmap import HALF
from vidtrack.exchange.ideal_to_distorted import Refitted, notes_of, refitted
from vidtrack.exchange.measured import Run, Written


def write(run: Run) -> Written:
    """The calibrated cameras as one file."""
    cameras = refitted(run, skew=True)
    document = Element("document", version="1.5.0")
    chunk = SubElement(document, "chunk", label="vidtrack", enabled="true", units=run.units)
    sensors, list_ = SubElement(chunk, "sensors"), SubElement(chunk, "cameras")
    for i, own in enumerate(cameras):
        _sensor(sensors, i, own)
        camera = SubElement(list_, "camera", id=str(i), sensor_id=str(i), label=own.name)
        place = np.eye(4)
        place[:3, :3], place[:3, 3] = own.camera.R.T, own.camera.position
        SubElement(camera, "transform").text = " ".join(map(repr, place.ravel().tolist()))
    ElementTree.indent(document)
    content = ElementTree.tostring(document, encoding="UTF-8", xml_declaration=True)
    return Written({"cameras.xml": content + b"\n"}, notes_of(cameras))


def _sensor(sensors: Element, number: int, own: Refitted) -> None:
    lens, (width, height) = own.lens, own.camera.image_size
    kind = "fisheye" if lens.fisheye else "frame"
    sensor = SubElement(sensors, "sensor", id=str(number), label=own.name, type=kind)
    SubElement(sensor, "resolution", width=str(width), height=str(height))
    inner = SubElement(sensor, "calibration", type=kind)
    inner.set("class", "adjusted")
    inner.set("largest_error_px", repr(own.largest_px))
    SubElement(inner, "resolution", width=str(width), height=str(height))
    values = {"f": lens.fy, "cx": lens.cx + HALF - width / 2, "cy": lens.cy + HALF - height / 2}
    values |= {"b1": lens.fx - lens.fy, "b2": lens.skew}
    values |= {f"k{n}": k for n, k in enumerate(lens.k, 1)}
    values |= {} if lens.fisheye else {"p1": lens.p2, "p2": lens.p1}
    for name, value in values.items():
        SubElement(inner, name).text = repr(float(value))
