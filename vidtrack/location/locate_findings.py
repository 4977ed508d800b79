"""What the user should know of a located run, by the record of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vidtrack.findings import Finding, Level
from vidtrack.location.sight_lines.erring_camera import lens_findings
from vidtrack.timing.clock_text import readable

Record = Mapping[str, Any]

OVER_SIGMA = (2.0, 10.0)
"""Position errors over sigma, rms, that the misses of lines of sight stand for: doubtful, and bad. Of 235 runs that
were good by a limit of 3 the largest had 1.44, of 50 unspoiled ones, each sample over its own sigma, 1.24; a
stabiliser that wanders by 0.8 px in one of three cameras makes 2.6, with a quarter of the samples off by more than 5
sigma."""

EXPLAINED_OVER = 1.0
"""The same where one turned camera or one late clock explains the misses: sigma has grown with them by then, and says
less than it seems. Of 16 unspoiled random experiments none had evidence for either above 0.2."""

EVIDENCE = 9.0
"""Chi squared that a cause must explain to be reported."""

EXPLAINS = 0.5
"""Share of the misses that a cause must explain to be named as the reason."""

SURE_SDS, SURE_SHARE, SURE_OVER = 5.0, 0.8, 1.5
"""Standard deviations of a cause, share of the misses that it explains, and position errors over sigma, above which it
is reported though what does not average away over a run (`sight_misses.BIAS_PX`) might explain as much. Of 87 unspoiled
random experiments none had a cause of more than 3.2 sd, or errors of more than 1.04 sigma."""

EXPLAINS_SOME = 0.1
"""Share from which it is named as a part of it, or as the nearest that one camera alone can do."""

READOUT_SDS, READOUT_S = 6.0, 0.001
"""Standard errors, and s, that a read-out must differ from the one assumed to be reported."""

LONGEST_S = 0.05
"""s, longer than any camera takes to read a picture: an estimate beyond it has another reason."""

OUTSIDE = (0.01, 0.5)
"""Share of samples outside the calibrated volume that is reported, and that is doubtful."""

LASTING = 30
"""Samples of something located besides the targets, at least, to be reported."""

SUDDEN = (0.002, 0.1)
"""Share of samples that miss suddenly, reported, and doubtful."""

DISAGREE = (0.02, 0.2)
"""Share of samples on which cameras disagree: doubtful, and bad."""


UNLIKE_CRYSTALS_PPM = 400.0
"""ppm; four times what the clocks of cameras differ by (`timing.clock.RATE_PRIOR_PPM`)."""

LEFT_OUT = (0.05, 5)
"""Share of the located samples, and samples, of which a camera is left out without more being said."""

IN_VIEW = 0.5
"""Share of the samples in which a target lies inside a camera's picture, below which the camera hardly has a part in
its positions: nothing checks those that two cameras alone give. Of 73 in 16 unspoiled experiments none was below 1."""

IN_VIEW_FROM = 30
"""Samples inside a camera's picture, at least: what only crosses its corner is no loss."""


def findings_of(record: Record, units: str) -> list[Finding]:
    """What a user should look at, by the record of stage locate."""
    out = [*_correspondence(record, units), *_sight_lines(record, units), *_rolling(record, units)]
    out += [*_rates(record), *_noise(record["noise"])]
    volume = record["volume"]
    if volume and volume["share_outside"] > OUTSIDE[0]:
        far: Level = "doubtful" if volume["share_outside"] > OUTSIDE[1] else "note"
        text = (
            f"{100 * volume['share_outside']:.0f} % of the samples lie outside the calibrated volume, by up to "
            f"{volume['farthest_outside']:.3g} {units}"
        )
        out.append(Finding(far, "outside-volume", text, "Calibrate with points around the whole motion."))
    samples = record["samples"]
    if samples["disagree"]:
        text = (
            f"{samples['disagree']} samples have no position: the cameras do not see one point there (lines of sight "
            f"miss each other by {samples['mean_miss_where_disagreed']:.3g} {units})"
        )
        share = samples["disagree"] / samples["n"]
        level: Level = "bad" if share > DISAGREE[1] else "doubtful" if share > DISAGREE[0] else "note"
        out.append(Finding(level, "cameras-disagree", text, _cure(record)))
    sudden = samples.get("sudden_misses") or 0
    if sudden > max(2, SUDDEN[0] * samples["n"]):
        grave: Level = "doubtful" if sudden > SUDDEN[1] * samples["n"] else "note"
        text = (
            f"{sudden} samples: lines of sight miss each other for a moment by more than noise explains; their sigma "
            "is grown by it, or the camera that errs is left out"
        )
        cure = (
            "See the tracks there: a rope, a flash or a neighbour may touch the target in one camera, or a drop or "
            "dirt lie on its lens or window."
        )
        out.append(Finding(grave, "sudden-misses", text, cure))
    out += lens_findings(samples.get("erring") or {})
    return [*out, *_left_out(samples), *_seldom(samples.get("in_view") or {})]


def _left_out(samples: Record) -> list[Finding]:
    """Cameras without which the others agree, in more than a few samples: positions are right, and a camera is not."""
    out = []
    for camera, where in (samples.get("left_out_where") or {}).items():
        n = samples["left_out"][camera]
        if n < LEFT_OUT[1] or n <= LEFT_OUT[0] * samples["located"]:
            continue
        text = (
            f"{camera}: left out of {n} of {samples['located']} positions, between {readable(where['from_s'])} and "
            f"{readable(where['to_s'])}: its lines of sight miss there by {where['px']:.2g} px (median) the points on "
            "which the other cameras agree"
        )
        cure = (
            f"See whether {camera} was moved, or its recording jumps or was cut there: compare its pictures before and "
            "then. Positions rest on the other cameras."
        )
        out.append(Finding("doubtful", "camera-left-out", text, cure))
    return out


def _seldom(cameras: Mapping[str, Record]) -> list[Finding]:
    """Cameras that measured few of the samples in which a target lies inside their picture."""
    out = []
    for camera, targets in cameras.items():
        few = {
            name: own
            for name, own in targets.items()
            if own["inside"] >= IN_VIEW_FROM and own["tracked"] < IN_VIEW * own["inside"]
        }
        if not few:
            continue
        name, own = min(few.items(), key=lambda one: one[1]["tracked"] / one[1]["inside"])
        more = "" if len(few) == 1 else f" (and {len(few) - 1} other targets seldom)"
        again = f", {own['sought']} more by the second search" if own["sought"] else ""
        text = (
            f"{camera}: {name} was measured in {own['tracked']} of the {own['inside']} samples in which it lies inside "
            f"the picture{again}{more}: in the others its positions rest on the other cameras"
        )
        cure = (
            f"Look at the tracks of {camera}: what hides {name} there, or was followed in its place? Give it a start "
            "box in targets.csv or set detect.threshold; leave the camera out of the run if it cannot see it."
        )
        out.append(Finding("doubtful", "camera-seldom-measured", text, cure))
    return out


def _correspondence(record: Record, units: str) -> list[Finding]:
    match = record["correspondence"]
    out = []
    if not match["targets"]:
        text = f"no two cameras' tracks lie within {match['tolerance_px']:g} px of each other's epipolar lines"
        cure = (
            "The likeliest causes, in this order: recordings that did not begin at one moment (cameras.<name>.clock: "
            "auto), a recording of another run, a camera that was moved after its calibration, tracks of different "
            "things (see the tracks)."
        )
        out.append(Finding("bad", "nothing-matched", text, cure))
    for camera, own in match["left_over"].items():
        n = sum(each["samples"] for each in own if each["reason"] == "contested")
        if n:
            text = f"{camera}: {n} samples fit several targets about as well, and are used for none"
            cure = "Name the targets in targets.csv, or add a camera."
            out.append(Finding("doubtful", "match-ambiguous", text, cure))
    for camera, tracks in match["unmatched"].items():
        text = f"{camera}: no other camera shows the same target as {', '.join(tracks)}"
        cure = "See in the tracks what it followed; start boxes in targets.csv keep it off reflections and neighbours."
        out.append(Finding("doubtful", "track-unmatched", text, cure))
    return [*out, *_besides(match, units)]


def _besides(match: Record, units: str) -> list[Finding]:
    """What was located besides the targets, reflections, and stretches of which it is open whose they are."""
    out = []
    for image, target in match["mirrored"].items():
        text = f"target {image} is the mirror image of {target}: it lies beyond a surface that reflects"
        cure = "Remove it from the targets, or place its start box on the target itself."
        out.append(Finding("bad", "target-mirrored", text, cure))
    images = [own for own in match["besides"] if own["reason"] == "mirror"]
    if images:
        of = ", ".join(dict.fromkeys(own["of"] or "what is no target" for own in images))
        text = f"mirror images of {of} were seen as well, and are not taken for targets"
        cure = "Cover what reflects, or place start boxes on the targets, where a camera follows an image instead."
        out.append(Finding("note", "mirror-images", text, cure))
    several = {name: own["part_of"] for name, own in match["targets"].items() if own["part_of"]}
    for name, names in several.items():
        own = match["targets"][name]
        when = f"from {own['start_s']:.3f} to {own['end_s']:.3f} s"
        text = f"{when} nothing shows whether what is located as {name} is {' or '.join(names)}"
        out.append(Finding("doubtful", "identity-open", text, "Name the targets in a start box, or add a camera."))
    more = [own for own in match["besides"] if own["reason"] == "surplus" and own["samples"] >= LASTING]
    if more:
        n = len(match["targets"]) - len(several)
        where = [", ".join(f"{x:.3g}" for x in own["place"]) for own in more[:5]]
        listed = "; ".join(
            f"{own['start_s']:.2f} to {own['end_s']:.2f} s about ({place}) {units}"
            for own, place in zip(more, where, strict=False)
        )
        text = f"{n + len(more)} things move or stand in space where {n} were asked for; besides these: {listed}"
        cure = "Set targets to all to have every one of them, or place start boxes on those that are meant."
        out.append(Finding("note", "more-targets-located", text, cure))
    return out


def _sight_lines(record: Record, units: str) -> list[Finding]:
    """Lines of sight that miss the points by more than noise and calibration explain, however few px that is."""
    sights = record.get("sight_lines")
    if not sights:
        return []
    cause, explained = sights["cause"], _explains(sights)
    known = explained or cause["evidence"] > EVIDENCE
    over = max(sights["over_sigma"], cause["moves_over_sigma"] if known else 0.0)
    if over <= (EXPLAINED_OVER if explained else OVER_SIGMA[0]):
        return []
    worst = max(sights["px"], key=lambda camera: sights["px"][camera] / max(sights["expected_px"][camera], 1e-300))
    text = (
        f"{worst}: lines of sight miss the located points by {sights['px'][worst]:.2g} px rms where "
        f"{sights['expected_px'][worst]:.2g} px are expected: positions are off by some {over:.2g} "
        "times what these lead to expect"
    )
    if explained:
        text += f"; it would be explained by {_in_words(cause)}"
    elif cause["evidence"] > EVIDENCE and cause["share"] > EXPLAINS_SOME:
        text += f"; {cause['share']:.0%} of it would be explained by {_in_words(cause)}"
    bad = (over > OVER_SIGMA[1] and cause["evidence"] > EVIDENCE) or sights["over_sigma"] > OVER_SIGMA[1]
    return [Finding("bad" if bad else "doubtful", "sight-lines-miss", text, _cure(record))]


def caused_by(cause: Finding, misfit: Finding) -> Finding:
    """A misfit without the causes that its own numbers suggest, with the cure of one that is found otherwise."""
    return misfit._replace(text=misfit.text.split("; ")[0], cure=cause.cure)


def _rolling(record: Record, units: str) -> list[Finding]:
    """Cameras whose rows are seen one after the other though the config does not say so."""
    sights = record.get("sight_lines") or {}
    left_s, said_s = sights.get("readout_s") or {}, record.get("readout") or {}
    # what no camera has is no read-out, and where one estimate is so, the others make up for it
    if any(left is not None and abs(said_s.get(camera, 0.0) + left) > LONGEST_S for camera, left in left_s.items()):
        return []
    out = []
    for camera, left in left_s.items():
        sd = sights["readout_sd_s"][camera]
        if left is None or not abs(left) > READOUT_SDS * sd or not abs(left) > READOUT_S:
            continue
        said = 1e3 * said_s.get(camera, 0.0)
        text = (
            f"{camera}: its rows are read one after the other (rolling shutter), from first to last in "
            f"{said + 1e3 * left:.3g} ± {1e3 * sd:.1g} ms by the motion of the targets, where {said:g} ms are "
            f"assumed: a target that moves by 1 {units}/s is misplaced by up to {abs(left):.2g} {units}"
        )
        cure = f"Set cameras.{camera}.readout_ms: {said + 1e3 * left:.3g}, or what the camera's maker says."
        out.append(Finding("doubtful", "rolling-shutter", text, cure))
    return out


def _rates(record: Record) -> list[Finding]:
    """Clocks that by the motion run faster or slower than a crystal does."""
    out = []
    for camera, own in ((record.get("clocks") or {}).get("cameras") or {}).items():
        rate = own.get("rate_ppm") or 0.0
        if own.get("source", "config") == "config" or not abs(rate) > UNLIKE_CRYSTALS_PPM:
            continue
        way = "slow" if rate > 0 else "fast"
        text = (
            f"{camera}: by the motion its clock runs {way} by {abs(rate):.4g} ppm, which no crystal does, and is "
            "corrected by that"
        )
        cure = f"See whether its recording has the rate at which it was taken (cameras.{camera}.rate)."
        out.append(Finding("note", "clock-rate-large", text, cure))
    return out


def _explains(sights: Record) -> bool:
    cause = sights["cause"]
    if cause["evidence"] > EVIDENCE:
        return bool(cause["share"] > EXPLAINS)
    sure = abs(cause["amount"]) > SURE_SDS * cause["sd"] and cause["share"] > SURE_SHARE
    return bool(sure and sights["over_sigma"] > SURE_OVER)


def _in_words(cause: Record) -> str:
    cameras = " or ".join(cause["cameras"])
    if cause["kind"] == "turned":
        return f"{cameras} turned by {cause['amount']:.2g} ± {cause['sd']:.1g} deg after its calibration"
    if "zoomed" in cause["kind"]:
        who = "all lenses" if cause["kind"] == "all zoomed" else f"a lens of {cameras}"
        return (
            f"{who} at another zoom or focus than in the calibration, {cause['amount']:+.2%} ± {cause['sd']:.2%} of f"
        )
    if cause["kind"] == "fast":
        ways = ("slow", "fast") if cause["amount"] > 0 else ("fast", "slow")
        others = "".join(f", or of {other} that runs {ways[1]}" for other in cause["cameras"][1:])
        rate = f"{abs(cause['amount']):.4g} ± {cause['sd']:.1g} ppm"
        return f"a clock of {cause['cameras'][0]} that runs {ways[0]}{others}, by {rate} since the run began"
    off = f"a clock of {cameras} that is off by {1e3 * abs(cause['amount']):.3g} ± {1e3 * cause['sd']:.1g} ms"
    return off if cause.get("from_s") is None else f"{off} from about {cause['from_s']:.2f} s on"


def _cure(record: Record) -> str:
    sights = record.get("sight_lines")
    if sights and _explains(sights):
        cause = sights["cause"]
        if cause["kind"] == "jumped":
            return (
                f"Compare the recordings of {' and '.join(sights['px'])} about {cause['from_s']:.2f} s: pictures were "
                "lost or a pause was left out there, and the time goes on as if it had not been. Use the run up to "
                "there (runs.<run>.detect.end), or the recording as the camera wrote it."
            )
        if cause["kind"] in ("late", "fast"):
            own = ((record.get("clocks") or {}).get("cameras") or {}).get(cause["cameras"][0]) or {}
            if own.get("source", "config") != "config":
                return (
                    f"The motion was asked for cameras.{cause['cameras'][0]}.clock already: see whether each recording "
                    "has the rate at which it was taken (cameras.<camera>.rate: slow motion, a conversion), or give "
                    "offset_s and rate_ppm."
                )
            if cause["kind"] == "fast":
                rate = f"{cause['amount']:+.4g}"
                return (
                    f"Set cameras.{cause['cameras'][0]}.clock: auto, or give its rate_ppm, about {rate}; see whether "
                    "each recording has the rate at which it was taken (cameras.<camera>.rate)."
                )
            return f"Set cameras.{cause['cameras'][0]}.clock: auto, or give its offset_s."
        if "zoomed" in cause["kind"]:
            return "Switch autofocus, zoom and stabilisation off; calibrate with the lens as it was in the run."
        return "Compare its picture with that of the calibration clips; calibrate it again as it stood in the run."
    return (
        "Neither one late clock nor one turned camera or zoomed lens explains all of it. What does, the likeliest "
        "first: a camera that moved, or a lens that was zoomed or focused, between the clips of its calibration or "
        "before the run (compare their pictures); a stabiliser that was on; water or a window before the targets that "
        "was not there when the camera was calibrated; a drop or dirt on a lens or window; one name that means two "
        "targets; a track that jumps to a reflection or a neighbour; recordings of which a part was cut out, or one "
        "of another run."
    )


def _noise(noise: Record) -> list[Finding]:
    if noise["source"] != "assumed":
        return []
    text = "sigma rests on a centroid noise that is assumed: neither the tracker nor enough samples estimate it"
    return [Finding("doubtful", "noise-assumed", text, "Give sd_x, sd_y with the centroids, or record more samples.")]
