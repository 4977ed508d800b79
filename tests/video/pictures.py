"""A ball whose place is known, in pictures of any kind, and where it is found."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from tests.files.clips import ball

SIZE = (120, 90)
"""px, width and height."""


def place(i: int) -> tuple[float, float]:
    """Where the ball is in picture i, px."""
    return 30.3 + 2.37 * i, 44.2 + 0.41 * i


def levels(i: int, bits: int = 8, size: tuple[int, int] = SIZE) -> np.ndarray:
    """Picture i, as large as `bits` allow."""
    picture = ball(*size, *place(i)) * (2**bits - 1) / 255
    return np.rint(picture).astype(np.uint8 if bits == 8 else np.uint16)


def found(luma: np.ndarray) -> tuple[float, float]:
    """The centroid of what is brighter than half, weighted, px."""
    picture = luma.astype(float)
    weight = np.clip(picture - (picture.min() + 0.3 * np.ptp(picture)), 0, None)
    rows, columns = np.mgrid[: luma.shape[0], : luma.shape[1]]
    return float((columns * weight).sum() / weight.sum()), float((rows * weight).sum() / weight.sum())


def tiff(
    pages: list[np.ndarray], *, order: str = "<", big: bool = False, imagej: str = "", thumbnail: bool = False
) -> bytes:
    """A TIFF of grey pages, uncompressed, each with a directory (imagej: one directory for all)."""
    word, size = ("Q", 8) if big else ("I", 4)
    head = (b"II" if order == "<" else b"MM") + struct.pack(order + "H", 43 if big else 42)
    head += struct.pack(order + "HH", 8, 0) if big else b""
    data = head + bytes(size)
    link = len(head)  # where the place of the next directory goes
    blocks = [pages] if imagej else [[page] for page in pages]
    for k, block in enumerate(blocks):
        pixels = b"".join(page.astype(page.dtype.newbyteorder(order)).tobytes() for page in block)
        at, text = len(data), imagej.encode() + b"\0"
        data += pixels + (text if imagej else b"")
        data += bytes(len(data) % 2)
        height, width = block[0].shape
        tags = [(254, 4, 1, int(thumbnail and k > 0)), (256, 4, 1, width), (257, 4, 1, height)]
        tags += [(258, 3, 1, 8 * block[0].itemsize), (259, 3, 1, 1), (262, 3, 1, 1)]
        tags += [(270, 2, len(text), at + len(pixels))] if imagej else []
        tags += [(273, 16 if big else 4, 1, at), (277, 3, 1, 1), (278, 4, 1, height)]
        tags += [(279, 16 if big else 4, 1, len(pixels) // len(block))]
        place_of_it = len(data)
        data = data[:link] + struct.pack(order + word, place_of_it) + data[link + size :]
        data += struct.pack(order + ("Q" if big else "H"), len(tags))
        for tag, kind, count, value in tags:
            form = {3: "H", 4: "I", 2: word, 16: "Q"}[kind]
            data += struct.pack(order + "HH" + word, tag, kind, count) + struct.pack(order + form, value).ljust(
                size, b"\0"
            )
        link = len(data)
        data += bytes(size)
    return data


def cine(times: list[float], bits: int = 8) -> bytes:
    """A Phantom CINE of grey pictures that bear their own times, s; its header states 100 pictures a second."""
    n, (width, height) = len(times), SIZE
    header, bitmap, setup_length = 44, 40, 0x2000
    setup = bytearray(setup_length)
    struct.pack_into("<2sH", setup, 140, b"ST", setup_length)
    struct.pack_into("<I", setup, 768, 100)
    struct.pack_into("<I", setup, 908, bits)
    stamps = b"".join(struct.pack("<II", int((t % 1) * 2**32) | 1, 1_700_000_000 + int(t)) for t in times)
    other = struct.pack("<IHH", 12, 1003, 0) + bytes(4)
    block = other + struct.pack("<IHH", 8 + len(stamps), 1002, 0) + stamps
    offsets = header + bitmap + setup_length + len(block)
    begin = offsets + 8 * n
    step = 8 + width * height * (bits // 8)
    data = struct.pack("<2sHHHiIiIIIIII", b"CI", 44, 0, 1, 0, n, 0, n, header, header + bitmap, offsets, 0, 0)
    data += struct.pack("<IiiHHIIiiII", 40, width, height, 1, bits, 0, step - 8, 0, 0, 0, 0)
    data += bytes(setup) + block + struct.pack(f"<{n}Q", *(begin + step * k for k in range(n)))
    for k in range(n):
        data += struct.pack("<II", 8, step - 8) + np.flipud(levels(k, bits)).tobytes()
    return data


def ser(times: list[float], bits: int = 8, *, flag: int = 0, trailer: bool = True) -> bytes:
    """A SER of grey pictures with the trailer of their times, s."""
    width, height = SIZE
    data = b"LUCAM-RECORDER" + struct.pack("<7i", 0, 0, flag, width, height, bits, len(times)) + bytes(120) + bytes(16)
    data += b"".join(levels(k, bits).tobytes() for k in range(len(times)))
    ticks = [638_000_000_000_000_000 + round(t * 1e7) for t in times]
    return data + (struct.pack(f"<{len(ticks)}Q", *ticks) if trailer else b"")


def write_mraw(
    path: Path, n: int, *, stored: int, effective: int, rate: int, side: str = "Lower", xml: bool = False
) -> Path:
    """An .mraw and its header."""
    width, height = SIZE
    data = b""
    for k in range(n):
        grey = levels(k, max(8, effective)).ravel()
        if stored == 12:
            a, b = grey[::2].astype(int), grey[1::2].astype(int)
            data += np.stack([a >> 4, (a & 15) << 4 | b >> 8, b & 255], axis=-1).astype(np.uint8).tobytes()
        elif stored == 16:
            data += (grey.astype("<u2") << (stored - effective if side == "Higher" else 0)).astype("<u2").tobytes()
        else:
            data += grey.tobytes()
    path.write_bytes(data)
    if xml:
        tags = {"width": width, "height": height, "bit": stored, "depth": effective, "side": side}
        tags |= {"recordRate": rate, "totalFrame": n, "type": "Mono"}
        path.with_suffix(".cihx").write_text("<cih>" + "".join(f"<{k}>{v}</{k}>" for k, v in tags.items()) + "</cih>")
    else:
        lines = {"Image Width": width, "Image Height": height, "Color Bit": stored, "EffectiveBit Depth": effective}
        lines |= {"EffectiveBit Side": side, "Record Rate(fps)": rate, "Total Frame": n, "Color Type": "Mono"}
        path.with_suffix(".cih").write_text(
            "#Camera Information Header\n" + "".join(f"{k} : {v}\n" for k, v in lines.items())
        )
    return path
