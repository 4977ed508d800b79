"""Small changes to a healthy file, of its bytes or of its text; the same seed makes the same change."""

from __future__ import annotations

import codecs
import re

import numpy as np

WORDS = (
    *[
        "nan",
        "inf",
        "-inf",
        "-0",
        "1e999",
        "1e-400",
        "0x10",
        "1_000",
        "1,5",
        "99999999999999999999",
        "-1",
        "2147483648",
        "1e300",
        "TRUE",
        "null",
        ".5.",
        "--1",
        "1e",
        "5%",
    ],
    *("\u0663", "\u22121", "10:00:00:10", "1-4", "\xe9", "\u202e", "x", ""),
)
"""What a cell or a value may hold that no reader expects."""

MARKS = [
    "\0",
    "\ufeff",
    "\r\n",
    "\r",
    "\n\n",
    "\t",
    ",",
    ";",
    '"',
    "'",
    "#",
    "[",
    "]",
    "{",
    "}",
    ":",
    "&a",
    "*a",
    "!!",
    "<",
    ">",
]
MARKS += ["%", "\x1a", "\x1b[2J", "\u2028", "$(touch PWNED)", "../", "<!ENTITY a 'b'>", "=====", "\\", "-", "|", "- "]

CHANGES = [1, 1, 1, 2, 3, 4]
"""How many changes a file has: with many of them little of it is read."""

HEADS = 4096
"""Bytes in which headers are; most changes are made there."""


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """The bytes with one to four changes."""
    out = bytearray(data)
    for _ in range(int(rng.choice(CHANGES))):
        reach = min(len(out), HEADS) if rng.random() < 0.6 else len(out)
        at, length = int(rng.integers(0, max(reach, 1))), int(rng.integers(1, 33))
        way = int(rng.integers(6))
        if way == 0:
            out[at : at + 1] = bytes([int(rng.integers(256))])
        elif way == 1:
            order = "little" if rng.random() < 0.5 else "big"
            width = int(rng.choice([2, 4, 8]))
            value = int(rng.choice([0, 1, 0x7FFF, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000])) & (256**width - 1)
            out[at : at + width] = value.to_bytes(width, order)
        elif way == 2:
            del out[at : at + length]
        elif way == 3:
            out[at:at] = out[at : at + length]
        elif way == 4:
            out[at : at + 1] = bytes([(out[at] if at < len(out) else 0) ^ 1 << int(rng.integers(8))])
        else:
            del out[at:]
    return bytes(out)


def mutated_text(data: bytes, rng: np.random.Generator) -> bytes:
    """A text with one to four changes of its words and lines; now and then of its bytes, or of its encoding."""
    if rng.random() < 0.25:
        return mutated(data, rng)
    text = data.decode("utf-8", "surrogateescape")
    for _ in range(int(rng.choice(CHANGES))):
        text = _changed(text, rng)
    whole = rng.random()
    if whole < 0.03:
        return codecs.BOM_UTF16_LE + text.encode("utf-16-le", "surrogatepass")
    if whole < 0.05:
        return codecs.BOM_UTF8 + text.encode("utf-8", "surrogateescape")
    if whole < 0.07:
        return text.replace("\n", "\r\n").encode("utf-8", "surrogateescape")
    if whole < 0.08:
        return text.encode("latin-1", "replace")
    return text.encode("utf-8", "surrogateescape")


def _changed(text: str, rng: np.random.Generator) -> str:
    way = int(rng.integers(8))
    if way <= 1:  # another word in place of one
        words = list(re.finditer(r"[^\s,;<>\[\]{}=:\"']+", text[:20_000]))
        if words:
            word = words[int(rng.integers(len(words)))]
            return text[: word.start()] + str(rng.choice(WORDS)) + text[word.end() :]
    at = int(rng.integers(0, len(text) + 1))
    if way == 2:
        return text[:at] + MARKS[int(rng.integers(len(MARKS)))] + text[at:]
    if way == 3:
        return text[:at] + text[at + int(rng.integers(1, 40)) :]
    lines = text.split("\n")
    k, j = (int(n) for n in rng.integers(len(lines), size=2))
    if way == 4:
        lines[k], lines[j] = lines[j], lines[k]
    elif way == 5:
        lines.insert(k, lines[j])
    elif way == 6:
        del lines[k]
    else:
        return text[:at] + text[at : at + 30] * int(rng.choice([2, 50, 5000])) + text[at:]
    return "\n".join(lines)
