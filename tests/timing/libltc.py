"""libltc (Gareus, LGPL), a decoder and encoder of longitudinal time code that shares nothing with ours: a witness.

Debian has it as libltc11. `load()` is None where it is not installed.
"""

from __future__ import annotations

import ctypes
from ctypes import POINTER, c_char, c_double, c_float, c_int, c_longlong, c_size_t, c_ubyte, c_void_p

import numpy as np

TV_525, TV_625, FILM_24 = 0, 1, 3
NO_PARITY_AND_FLAGS = 4


class FrameExt(ctypes.Structure):
    _fields_ = (
        ("bits", c_ubyte * 10),
        ("off_start", c_longlong),
        ("off_end", c_longlong),
        ("reverse", c_int),
        ("tics", c_float * 80),
        ("sample_min", c_ubyte),
        ("sample_max", c_ubyte),
        ("volume", c_double),
    )


class Label(ctypes.Structure):
    _fields_ = (
        ("timezone", c_char * 6),
        *((name, c_ubyte) for name in ("years", "months", "days", "hours", "mins", "secs", "frame")),
    )


def load() -> ctypes.CDLL | None:
    try:
        library = ctypes.CDLL("libltc.so.11")
    except OSError:
        return None
    library.ltc_decoder_create.restype = c_void_p
    library.ltc_decoder_create.argtypes = (c_int, c_int)
    library.ltc_decoder_write_float.argtypes = (c_void_p, POINTER(c_float), c_size_t, c_longlong)
    library.ltc_decoder_read.argtypes = (c_void_p, POINTER(FrameExt))
    library.ltc_decoder_free.argtypes = (c_void_p,)
    library.ltc_frame_to_time.argtypes = (POINTER(Label), c_void_p, c_int)
    library.ltc_encoder_create.restype = c_void_p
    library.ltc_encoder_create.argtypes = (c_double, c_double, c_int, c_int)
    library.ltc_encoder_set_timecode.argtypes = (c_void_p, POINTER(Label))
    library.ltc_encoder_set_frame.argtypes = (c_void_p, c_void_p)
    library.ltc_encoder_get_frame.argtypes = (c_void_p, c_void_p)
    library.ltc_encoder_encode_frame.argtypes = (c_void_p,)
    library.ltc_encoder_inc_timecode.argtypes = (c_void_p,)
    library.ltc_encoder_copy_buffer.argtypes = (c_void_p, POINTER(c_ubyte))
    library.ltc_encoder_get_buffersize.argtypes = (c_void_p,)
    library.ltc_encoder_get_buffersize.restype = c_size_t
    library.ltc_encoder_free.argtypes = (c_void_p,)
    return library


def decode(
    library: ctypes.CDLL, samples: np.ndarray, per_frame: float
) -> list[tuple[tuple[int, int, int, int, bool], int]]:
    """((hours, minutes, seconds, frames, drop), first sample) of every word that libltc finds."""
    decoder = library.ltc_decoder_create(round(per_frame), 8192)
    found = []
    samples = np.ascontiguousarray(samples, np.float32)
    frame, label = FrameExt(), Label()
    for at in range(0, len(samples), 1024):
        block = samples[at : at + 1024]
        library.ltc_decoder_write_float(decoder, block.ctypes.data_as(POINTER(c_float)), len(block), at)
        while library.ltc_decoder_read(decoder, ctypes.byref(frame)):
            library.ltc_frame_to_time(ctypes.byref(label), ctypes.byref(frame), 0)
            drop = bool(frame.bits[1] >> 2 & 1)
            found.append(((label.hours, label.mins, label.secs, label.frame, drop), frame.off_start))
    library.ltc_decoder_free(decoder)
    return found


def encode(
    library: ctypes.CDLL, start: tuple[int, int, int, int], n: int, rate: float, fps: float, standard: int, drop: bool
) -> np.ndarray:
    """The sound of n words, float about 0, one after another."""
    encoder = library.ltc_encoder_create(rate, fps, standard, NO_PARITY_AND_FLAGS)
    label = Label(b"+0000", 0, 0, 0, *start)
    library.ltc_encoder_set_timecode(encoder, ctypes.byref(label))
    if drop:
        bits = (c_ubyte * 10)()
        library.ltc_encoder_get_frame(encoder, bits)
        bits[1] |= 1 << 2
        library.ltc_encoder_set_frame(encoder, bits)
    parts = []
    for _ in range(n):
        library.ltc_encoder_encode_frame(encoder)
        buffer = (c_ubyte * library.ltc_encoder_get_buffersize(encoder))()
        size = library.ltc_encoder_copy_buffer(encoder, buffer)
        parts.append(np.frombuffer(buffer, np.uint8, size).copy())
        library.ltc_encoder_inc_timecode(encoder)
    library.ltc_encoder_free(encoder)
    return np.concatenate(parts).astype(float) - 128
