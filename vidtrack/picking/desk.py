"""Everything that the page asks for, without a word of HTTP: what there is, pictures, measures, names, files."""

from __future__ import annotations

import os
import subprocess
import threading
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.files.config_file import read_config
from vidtrack.files.experiment import Experiment, look_through, point_tags, tags_of, target_names
from vidtrack.picking import looking, store
from vidtrack.picking.ahead import Ahead
from vidtrack.picking.once import OnceEach
from vidtrack.picking.rows import point_of, rows_of
from vidtrack.picking.space import epipolar_curve
from vidtrack.preview.views import Few, View, opened_with, view_of
from vidtrack.settings.config import Settings, detect_for, settings_from_config
from vidtrack.timing.frame import Frame
from vidtrack.video.random_access import Pictures

if TYPE_CHECKING:
    from pandas import DataFrame

JPEG = [cv2.IMWRITE_JPEG_QUALITY, 88]
PNG = [cv2.IMWRITE_PNG_COMPRESSION, 1, cv2.IMWRITE_PNG_BILEVEL, 1]
DETECT = (*looking.DETECT, "box")
"""The detect keys that the page may set."""


class Desk:
    """An experiment that is looked at, in the current folder; may be used from several threads.

    counted   pictures so far of the recording that is being opened, where they must be counted
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._pictures: dict[str, Pictures] = {}
        self._closed = False
        self.counted = 0
        self._views: dict[str, View] = {}
        self._ahead = Ahead()
        self._looks = OnceEach(self._look, 64)
        self._levels = OnceEach(self._levels_of, 64)
        self._clips = OnceEach(self._frames_of, 32)
        self.read()

    def read(self) -> None:
        """Read config and folder again."""
        self.settings: Settings = settings_from_config(read_config("config.yaml"))
        self.experiment: Experiment = look_through(self.settings)[0]
        if not any(self._recordings()):
            raise VidtrackError("no recording of any camera here. Call vidtrack init, or put them in place.")

    def close(self) -> None:
        """Stop decoding, and let the recordings go."""
        with self._lock:
            self._closed = True
            opened = list(self._pictures.values())
        for pictures in opened:
            pictures.close()
        self._ahead.close()

    def read_again(self) -> dict[str, Any]:
        """The state of the folder as it is now: a person, or another window, may have changed it."""
        with self._lock:
            self.read()
            return self.state()

    def _recordings(self) -> list[tuple[str, str, str, str]]:
        clips = [
            ("clip", c.name, camera, p)
            for c in self.experiment.clips.values()
            for camera, p in c.videos.items()
            if camera not in c.digitised
        ]
        runs = [
            ("run", r.name, camera, p)
            for r in self.experiment.runs.values()
            for camera, p in r.videos.items()
            if camera not in r.tracks
        ]
        return clips + runs

    def pictures(self, kind: str, name: str, camera: str) -> Pictures:
        """The pictures of a recording, opened once; VidtrackError where there is none."""
        path = self._path_of(kind, name, camera)
        with self._lock:
            if self._closed:
                raise VidtrackError("the page is closed. Call vidtrack pick again.")
            how = opened_with(self.settings, self.experiment, kind, name, camera)
            key = f"{path} {how}"
            if key not in self._pictures:
                self.counted = 0
                self._pictures[key] = Pictures(path, lambda n: setattr(self, "counted", n), **how)
            return self._pictures[key]

    def _path_of(self, kind: str, name: str, camera: str) -> str:
        """The recording of a camera in a clip or a run; VidtrackError where there is none of these names."""
        folders = self.experiment.clips if kind == "clip" else self.experiment.runs
        if kind not in ("clip", "run") or name not in folders or camera not in folders[name].videos:
            raise VidtrackError(f"{kind} {name}: no recording of camera {camera!r}.")
        return folders[name].videos[camera]

    def state(self) -> dict[str, Any]:
        """All that the page shows before a picture is chosen."""
        tags = self._tags()
        views = []
        for kind, name, camera, _ in self._recordings():
            rows = self.picks(name, camera) if kind == "clip" else self.boxes(name, camera)
            here = tags_of(self.settings, name, tags) if kind == "clip" else []
            own: dict[str, Any] = {"kind": kind, "name": name, "camera": camera, "rows": rows, "tags": here}
            own["detect"] = self.detect(kind, name)
            own["targets"] = target_names(self.settings, self.experiment.runs[name]) if kind == "run" else []
            own["table"] = self.table(kind, name)
            own["text"] = self._tags_as_written(name) if kind == "clip" else ""
            views.append({**own, "version": store.version_of(own["table"])})
        return {
            "views": views,
            "tags": tags,
            "cameras": list(self.settings.cameras),
            "units": self.settings.units,
            "config": store.version_of("config.yaml"),
            "title": self.settings.title or os.path.basename(os.getcwd()),
        }

    def _tags(self) -> list[str]:
        try:
            return [str(tag) for tag in point_tags(self.experiment)]
        except VidtrackError:  # a points.csv that holds only its header yet
            return []

    def _tags_as_written(self, clip: str) -> str:
        own = self.settings.calibration.clips.get(clip)
        return ", ".join(own.tags) if own and own.tags is not None else ""

    def table(self, kind: str, name: str) -> str:
        """Where the picks of a clip, or the start boxes of a run, are kept."""
        parts = ("calibration", name, "picks.csv") if kind == "clip" else ("runs", name, "targets.csv")
        return os.path.normpath(os.path.join(self.experiment.folder, *parts))

    def picks(self, clip: str, camera: str) -> list[dict[str, Any]]:
        """A camera's picks of a clip."""
        from vidtrack.files.tables import read_picks

        path = self.experiment.clips[clip].picks
        return rows_of(read_picks(path, camera), store.PICKS[1:]) if path else []

    def boxes(self, run: str, camera: str) -> list[dict[str, Any]]:
        """A camera's start boxes of a run."""
        from vidtrack.files.csv_columns import TARGETS
        from vidtrack.files.tables import read_csv

        path = self.experiment.runs[run].targets
        if not path:
            return []
        table = read_csv(path, TARGETS)
        return rows_of(table[table["camera"] == camera], store.TARGETS[1:])

    def detect(self, kind: str, name: str) -> dict[str, Any]:
        """The detect settings in force for a clip or a run."""
        own = self.settings.calibration.clips.get(name) if kind == "clip" else self.settings.runs.get(name)
        return detect_for(self.settings, own, own.detect) if own else detect_for(self.settings)

    def info(self, kind: str, name: str, camera: str) -> dict[str, Any]:
        """What a recording is."""
        pictures = self.pictures(kind, name, camera)
        info, first = pictures.info, pictures.picture(0)
        scale = 255.0 / (2**info.bits - 1)
        low, high = float(np.percentile(first[::4, ::4], 0.1)) * scale, float(first.max()) * scale
        return {
            "frames": len(pictures),
            "width": info.width,
            "height": info.height,
            "rate": float(info.rate),
            "bits": info.bits,
            "low": low,
            "high": high,
            "order": info.field_order,
        }

    def jpeg(self, kind: str, name: str, camera: str, number: int, low: float, high: float) -> bytes:
        """A picture for the screen; its neighbours are decoded meanwhile."""
        pictures = self.pictures(kind, name, camera)
        with self._ahead.rests():
            grey = looking.grey_of(pictures.picture(number), pictures.info.bits, low, high)
            self._ahead.looked_at(pictures, number, lambda: self.look(kind, name, camera, number, {}))
            return bytes(cv2.imencode(".jpg", grey, JPEG)[1].tobytes())

    def mask(self, kind: str, name: str, camera: str, number: int, detect: Mapping[str, Any]) -> bytes:
        """What is above the threshold, as PNG."""
        look = self.look(kind, name, camera, number, detect)
        return bytes(cv2.imencode(".png", looking.mask_of(look), PNG)[1].tobytes())

    def look(self, kind: str, name: str, camera: str, number: int, detect: Mapping[str, Any]) -> looking.Look:
        """A picture with its blobs; `detect`: settings that are tried out, beside those in force."""
        asked = self._with(kind, name, detect)
        settings = tuple((key, asked.get(key)) for key in looking.DETECT)  # those of a box change no answer
        pictures = self.pictures(kind, name, camera)
        with self._ahead.rests():
            return self._looks(pictures, number, settings)

    def _with(self, kind: str, name: str, detect: Mapping[str, Any]) -> dict[str, Any]:
        tried = {key: value for key, value in detect.items() if value is not None and key in DETECT}
        return {**self.detect(kind, name), **tried}

    def _look(self, pictures: Pictures, number: int, settings: tuple[tuple[str, Any], ...]) -> looking.Look:
        bits = pictures.info.bits
        picture = pictures.picture(number)
        return looking.look_at(
            picture, bits, self._levels(pictures, settings), dict(settings), pictures.info.field_order
        )

    @staticmethod
    def _levels_of(pictures: Pictures, settings: tuple[tuple[str, Any], ...]) -> Any:
        """From the first picture: the same for all of them."""
        return looking.levels_of(pictures.picture(0), pictures.info.bits, dict(settings))

    def label(
        self,
        camera: str,
        picks: Mapping[str, Sequence[Mapping[str, Any]]],
        clips: Mapping[str, Mapping[str, Any]] | None = None,
    ) -> dict[str, Any]:
        """Name all points of a camera from its picks, clip by clip, and calibrate it, by the workflow's stages.

        clips   clip: {tags, detect} that are not saved yet
        Returns points: a row each (clip, tag, Xf, Yf, used, residual); problems; rms of the camera; tags by clip.
        """
        import pandas as pd

        columns = ["tag", "Xf", "Yf", "sd"]
        tables: dict[str, DataFrame] = {
            clip: pd.DataFrame([{**dict.fromkeys(columns), **row} for row in rows], columns=columns).astype(
                {"tag": str, "Xf": float, "Yf": float, "sd": float}
            )
            for clip, rows in picks.items()
            if rows
        }
        settings = self._settings_with(clips or {})
        view = view_of(
            settings, self.experiment, camera, lambda clip, *_: self._clips(self.pictures("clip", clip, camera)), tables
        )
        with self._lock:
            self._views[camera] = view
        known = self._tags()
        shown = {c: tags_of(settings, c, known) for c, own in self.experiment.clips.items() if camera in own.videos}
        answer: dict[str, Any] = {"problems": list(view.problems), "points": [], "rms": None, "tags": shown}
        if view.sightings is not None:
            answer["problems"] += view.sightings.warnings
            table = view.calibration.points if view.calibration else view.sightings.table
            answer["points"] = [point_of(row) for row in table.to_dict("records")]
        if view.calibration is not None:
            answer["rms"] = view.calibration.record["rms_px"]
            answer["problems"] += view.calibration.warnings
        return answer

    def _settings_with(self, clips: Mapping[str, Mapping[str, Any]]) -> Settings:
        """The settings as they would be with what the page has not saved yet."""
        config = read_config("config.yaml")
        own = (config.get("calibration") or {}).get("clips") or {}
        for clip, changes in clips.items():
            before = own.get(clip) or {}
            detect = {**(before.get("detect") or {}), **changes.get("detect", {})}
            tags = {"tags": changes["tags"] or None} if "tags" in changes else {}
            own = {**own, clip: {**before, **tags, "detect": detect}}
        return settings_from_config({**config, "calibration": {**(config.get("calibration") or {}), "clips": own}})

    @staticmethod
    def _frames_of(pictures: Pictures) -> Few:
        numbers = sorted({0, len(pictures) - 1})
        frames = [Frame(i, Fraction(i), pictures.picture(i), False, None) for i in numbers]
        return Few(frames, (pictures.info.width, pictures.info.height), pictures.info.bits)

    def epipolar(self, camera: str, x: float, y: float) -> dict[str, list[list[list[float]]]]:
        """Where what one camera sees at a place may lie in the others: polylines, px; of calibrated cameras."""
        known = {c: v.calibration for c, v in self._views.items() if v.calibration is not None}
        if camera not in known:
            return {}
        own = known[camera]
        p = own.points[["x", "y", "z"]].to_numpy(float)
        del known[camera]
        return {other: epipolar_curve(own.camera, view.camera, (x, y), p) for other, view in known.items()}

    def calibrated(self) -> list[str]:
        """Cameras whose view is known here."""
        return [camera for camera, view in self._views.items() if view.calibration is not None]

    def save(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Write what the page has changed; Outdated, nothing written, where a file is not as the page has seen it.

        tables   [{kind, name, camera, rows, version}]; detect: [{kind, name, changes}]; tags: {clip: text};
        config   the version of config.yaml that was seen
        """
        with self._lock:
            tables: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
            for own in given.get("tables", []):
                self._path_of(own["kind"], own["name"], own["camera"])  # a name of none, such as ../.., is no path
                tables.setdefault((own["kind"], own["name"]), []).append(own)
            for key, parts in tables.items():
                store.check_version(self.table(*key), parts[0]["version"])
            changes, tags = given.get("detect", []), given.get("tags", {})
            known = {recording[:2] for recording in self._recordings()}
            for place in [(own["kind"], own["name"]) for own in changes] + [("clip", clip) for clip in tags]:
                if place not in known and place[0] != "all":
                    raise VidtrackError(f"{place[0]} {place[1]}: there is none here. Load the page again.")
            if changes or tags:
                store.check_version("config.yaml", given["config"])
            for (kind, name), parts in tables.items():
                self._write_table(kind, name, {own["camera"]: own["rows"] for own in parts})
            for own in changes:
                kind, name = own["kind"], own["name"]
                place = () if kind == "all" else ("calibration", "clips", name) if kind == "clip" else ("runs", name)
                store.change_detect("config.yaml", place, {k: v for k, v in own["changes"].items() if k in DETECT})
            for clip, text in tags.items():
                store.change_clip("config.yaml", clip, {"tags": text or None})
            self.read()
            return self.state()

    def _write_table(self, kind: str, name: str, changed: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
        columns = store.PICKS if kind == "clip" else store.TARGETS
        read = self.picks if kind == "clip" else self.boxes
        folders = self.experiment.clips if kind == "clip" else self.experiment.runs
        rows: list[dict[str, Any]] = []
        for camera in self.settings.cameras:
            if camera in changed:
                rows += [{**row, "camera": camera} for row in changed[camera]]
            elif camera in folders[name].videos:
                rows += [{**row, "camera": camera} for row in read(name, camera)]
        store.write_rows(self.table(kind, name), columns, rows)

    def plan(self) -> list[str]:
        """What would run now, by Snakemake, which says it twice: a line each."""
        from vidtrack.running.snakemake import arguments_for

        command = [*arguments_for(".", "1"), "--dry-run", "--quiet", "rules"]
        done = subprocess.run(command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
        text = (done.stdout + done.stderr).splitlines()
        if done.returncode:
            return [line.removeprefix("vidtrack: ") for line in text if line.startswith("vidtrack: ")] or text[-3:]
        jobs = [line.split() for line in text]
        found = [f"{w[1]} x {w[0]}" for w in jobs if len(w) == 2 and w[1].isdigit() and w[0] not in ("all", "total")]
        return list(dict.fromkeys(found)) or ["nothing: everything is up to date"]
