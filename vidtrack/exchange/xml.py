"""XML of other programs: one clear line where it breaks off, and no entities: they can fill the memory."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, bytes_of


def parsed(path: Path) -> ElementTree.Element:
    """The root of an XML file; VidtrackError where it is not whole, or declares entities."""
    data = bytes_of(path)
    if re.search(rb"<!ENTITY", data):
        raise VidtrackError(f"{path}: XML that declares entities, which are not read. Export it without entities.")
    try:
        return ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise VidtrackError(f"{path}: the XML is cut off or damaged ({error}). Copy the whole file again.") from None
