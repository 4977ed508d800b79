"""Which read-out of a rolling shutter is used for each camera: the config's, else what the file's maker says."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from vidtrack.findings import Finding
from vidtrack.timing.readout import Readout


class ChoiceSettings(NamedTuple):
    """When two statements of one read-out are not the same."""

    apart_ms: float = 1.0
    apart_share: float = 0.1


SETTINGS = ChoiceSettings()


class ChosenReadouts(NamedTuple):
    """How each camera reads its picture, and what to say of where that is known from."""

    readouts: dict[str, Readout]
    findings: list[Finding]


def chosen_readouts(
    videos: Mapping[str, Mapping[str, Any]], said: Mapping[str, float | str], *, by_motion: bool = True
) -> ChosenReadouts:
    """How the cameras of a run read their pictures.

    videos  camera: what the record of its reading says of the recording: width, height, rotation, mirrored and, where
            the file's maker wrote one into it, readout {ms, source, doubt, steady}
    said    camera: what the config says, ms, or "motion": it is sought then, from none on, where `by_motion`
    All rows at once where neither says anything.
    """
    readouts, findings = {}, []
    for name, video in videos.items():
        stated = video.get("readout")
        usable = stated["ms"] if stated and not stated["doubt"] else None
        known = 0.0 if usable is None else usable
        own = said.get(name, known)
        if isinstance(own, str) and not by_motion:
            own = known
            findings.append(_not_by_motion(name, known))
        turn = int(video.get("rotation", 0)), bool(video.get("mirrored", False))
        size = (int(video["width"]), int(video["height"]))
        readouts[name] = Readout(0.0 if isinstance(own, str) else own / 1e3, size, *turn)
        if stated:
            findings += _findings(name, stated, said.get(name))
    return ChosenReadouts(readouts, findings)


def _findings(name: str, stated: Mapping[str, Any], said: float | str | None) -> list[Finding]:
    key, out = f"cameras.{name}.readout_ms", []
    maker = f"{stated['source']} in the file says {stated['ms']:.4g} ms"
    if isinstance(said, int | float):
        apart = abs(abs(said) - stated["ms"])
        if not stated["doubt"] and apart > max(SETTINGS.apart_ms, SETTINGS.apart_share * stated["ms"]):
            text = f"{name}: {key} is {said:g}, and {maker} from the first row to the last; that of the config is used"
            cure = f"Correct {key}, or take it out: the file's is used then."
            out.append(Finding("doubtful", "readout-disagrees", text, cure))
    elif said is None and stated["doubt"]:
        text = f"{name}: {maker} of the read-out, which is not used: {stated['doubt']}"
        out.append(Finding("note", "readout-not-used", text, f"Set {key}, or motion."))
    elif said is None:
        text = (
            f"{name}: its rows are taken to be read one after the other in {stated['ms']:.4g} ms ({stated['source']})"
        )
        out.append(Finding("note", "readout-of-maker", text, f"Set {key} where you measured another."))
    if stated["steady"] is False:
        text = f"{name}: its electronic stabiliser was on ({stated['source']}): it moves, cuts and bends the picture"
        out.append(Finding("note", "stabiliser-on", text, "Switch it off in calibration clips and runs."))
    return out


def _not_by_motion(name: str, known: float) -> Finding:
    key = f"cameras.{name}.readout_ms"
    text = (
        f"{name}: {key} is motion, by which it is found only where cameras locate targets: {known:.4g} ms are used here"
    )
    return Finding("doubtful", "readout-unsure", text, f"Give {key} in ms, as a run has found it.")
