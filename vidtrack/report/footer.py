"""The foot of each page: units, and by which program it was made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def footer(provenance: Mapping[str, Any], units: str) -> tuple[str, ...]:
    """Units and program; settings and checksums are in each file that the page was made of."""
    made = [f"vidtrack {provenance.get('vidtrack', '')}"]
    if provenance.get("commit"):
        made.append(f"commit {str(provenance['commit'])[:12]}")
    made += [f"{name} {version}" for name, version in (provenance.get("libraries") or {}).items()]
    return (
        f"The unit of length is {units} unless said otherwise; px are frame buffer pixels.",
        f"Made by {', '.join(made)}. Settings and the checksums of what people recorded and wrote stand under "
        "`provenance` in every file of results/.",
    )
