"""The settings of the rules that find coded tags and locate them, as `orders` has those of the others."""

from __future__ import annotations

from typing import Any

from vidtrack.settings.runs import Run

Order = dict[str, Any]


def tags_of_run(own: Run) -> Order | None:
    """The coded tags of a run: family, size, sigma, ids, and the numbers that the config names; None without tags."""
    if own.tags is None:
        return None
    on = [number for body in own.bodies.values() for number in body.tags]
    return {**own.tags.model_dump(), "named": sorted({*(own.tags.ids or ()), *on})}


def tags_read(own: Run) -> Order | None:
    """What reading the tags in a recording needs to know: neither how large they are nor how well that is known."""
    tags = tags_of_run(own)
    return None if tags is None else {key: tags[key] for key in ("family", "ids", "named")}


def tagged(own: Run) -> Order:
    """What stage locate needs to know of a run's coded tags; nothing where it has none."""
    if own.tags is None:
        return {}
    size = own.tags.size
    bodies = {name: body for name, body in own.bodies.items() if body.tags}
    places = {name: {str(n): place.places(size) for n, place in body.tags.items()} for name, body in bodies.items()}
    others = {name: body.targets for name, body in bodies.items()}
    return {"tags": tags_of_run(own), "tag_bodies": places, "tag_targets": others}


def untagged(own: Run) -> dict[str, Any]:
    """The bodies that other targets alone locate, with the places of these."""
    return {name: body.targets for name, body in own.bodies.items() if not body.tags}


def tag_poses(located: Order) -> Order:
    """How the coded tags of a run become the poses of bodies.

    located   the order of stage locate of the same run
    """
    order = {key: located[key] for key in ("units", "run", "cameras", "readout_ms", "crop", "tags")}
    return order | {"bodies": located["tag_bodies"], "targets": located["tag_targets"]}
