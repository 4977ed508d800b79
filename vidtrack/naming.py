"""Names as people mistype them: the nearest known one."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Sequence

LONGEST = 100
"""Characters of a name that may be a known one, mistyped."""


_INVISIBLE = dict.fromkeys(map(ord, "\ufeff\u200b\u200c\u200d\u2060\u00ad"))
_SPACES = re.compile(r"[^\S\n\r\t]+")


def in_one_form(name: str) -> str:
    """A name as it looks: what no reader can see apart is written in one way.

    Without invisible characters and the spaces around it; any run of spaces is one, an accented letter one character.
    """
    return _SPACES.sub(" ", unicodedata.normalize("NFC", name.translate(_INVISIBLE))).strip()


def did_you_mean(name: str, known: Iterable[str]) -> str | None:
    """The known name nearest to a mistyped one, or None where nothing is near. `treshold` finds `threshold`."""
    import difflib

    known = list(known)
    for candidate in known:
        if candidate.lower() == name.lower() or in_one_form(candidate) == in_one_form(name):
            return candidate
    if len(name) > LONGEST:
        return None
    begun = [c for c in known if c and name.lower().startswith(c.lower()) and not name[len(c)].isalnum()]
    if begun:  # cam1-2, cam1 (1): what a copy or a second take of cam1 is named
        return max(begun, key=len)
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    return near[0] if near else None


def hint_of(name: str, known: Iterable[str], otherwise: str) -> str:
    """`did you mean 'cam1'?`, what to do about one that differs by what no reader can see, or else `otherwise`."""
    near = did_you_mean(name, known)
    if near is not None and near != name and in_one_form(near) == in_one_form(name):
        return f"{near!r} has the same letters, stored otherwise (accents as a Mac stores them, or spaces). Rename it."
    return f"did you mean {near!r}?" if near else otherwise


_RANGE = re.compile(r"(\D*)(\d{1,9})\s*(?:[-\u2010-\u2015\u2212]|\.\.+|to\b)\s*(?:\1)?(\d{1,9})")


def tags_meant(parts: Sequence[str], known: Collection[str]) -> tuple[list[str], list[str]]:
    """The tags that a list such as 1-4, 9, left means, and what is wrong with it, a sentence each.

    known   the tags in points.csv. A part that is one of them is that tag as it stands, 1-4 too where it is one;
            otherwise 1-4 means 1, 2, 3, 4 (or 01, 02, ... where points.csv has these), and A1-A4 means A1, A2, A3, A4;
            a longer dash, 1 to 4 and 1..4 mean the same, and `1 2 4` these three where all are known
    """
    known = frozenset(known)
    tags: list[str] = []
    problems: list[str] = []
    for part in parts:
        ends = None if part in known else _RANGE.fullmatch(part)
        words = part.split()
        if ends is None:
            tags += words if part not in known and words and known.issuperset(words) else [part]
        elif int(ends[2]) > int(ends[3]):
            problems.append(
                f"{part} is no tag in points.csv, and as a range it counts backwards. Correct the tag, "
                f"or write {ends[1]}{ends[3]}-{ends[1]}{ends[2]}."
            )
        elif int(ends[3]) - int(ends[2]) > 10_000:
            problems.append(f"{part} are more than 10000 tags. Correct the range.")
        else:
            within = [_tag_of(ends[1], n, len(ends[2]), known) for n in range(int(ends[2]), int(ends[3]) + 1)]
            if known and known.isdisjoint(within):
                problems.append(
                    f"{part} is no tag in points.csv, and neither are {within[0]} to {within[-1]}. Correct the range."
                )
            else:
                tags += within
    return tags, problems


def _tag_of(prefix: str, number: int, digits: int, known: Collection[str]) -> str:
    plain = f"{prefix}{number}"
    if plain in known:
        return plain
    padded = f"{prefix}{number:0{digits}d}"
    if padded in known:
        return padded
    alike = [tag for tag in known if re.fullmatch(rf"{re.escape(prefix)}0*{number}(\.0+)?", tag)]
    return alike[0] if len(alike) == 1 else padded


def some_of(names: Sequence[str], most: int = 12) -> str:
    """Names in a row for a message, at most so many of them."""
    return (
        ", ".join(names) if len(names) <= most else f"{', '.join(names[: most - 2])} and {len(names) - most + 2} more"
    )


_NUMBERED = re.compile(r"(?P<before>.*?)(?P<number>\d{1,12})(?P<after>\.[^.\d][^.]*|\.[^.]*[^.\d])", re.DOTALL)


def numbered_like(name: str, names: Iterable[str]) -> list[tuple[int, str]]:
    """The names that differ from `name` in the number before its ending alone, by their numbers, which are given too.

    img_0001.png finds img_0002.png and img_10000.png. Empty where `name` bears no number.
    """
    own = _NUMBERED.fullmatch(name)
    if own is None:
        return []
    found: dict[int, str] = {}
    for other in sorted(names):
        match = _NUMBERED.fullmatch(other)
        if match and (match["before"], match["after"].lower()) == (own["before"], own["after"].lower()):
            found.setdefault(int(match["number"]), other)
    return sorted(found.items())


_CHAPTERS = (
    re.compile(r"G[HXLS](?P<chapter>\d\d)(?P<recording>\d{4})\.\w+", re.IGNORECASE),
    re.compile(r"GP(?P<chapter>\d\d)(?P<recording>\d{4})\.\w+", re.IGNORECASE),
    re.compile(r"GOPR(?P<chapter>)(?P<recording>\d{4})\.\w+", re.IGNORECASE),
)
"""GoPro's names: GX010012, GX020012; before 2018 GOPR0012, GP010012, GP020012."""


def chapter_of(name: str) -> tuple[str, int] | None:
    """The recording that a file is a chapter of, and which chapter, by names that say so; None for any other name."""
    for pattern in _CHAPTERS:
        if match := pattern.fullmatch(name):
            return match["recording"], int(match["chapter"] or 0)
    return None


def in_order(names: Iterable[str]) -> list[str]:
    """Names in the order in which they were numbered: chapters of a recording after each other, 10 after 9."""

    def key(name: str) -> tuple[object, ...]:
        if chapter := chapter_of(name):
            return (0, *chapter)
        pieces = re.split(r"(\d+)", name.casefold())
        return (1, *((int(piece), "") if k % 2 else (0, piece) for k, piece in enumerate(pieces)))

    return sorted(names, key=key)
