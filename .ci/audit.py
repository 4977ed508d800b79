"""What pip-audit found: python audit.py FILE, its JSON. Exit code 0 checked, 1 vulnerable, 2 in part, 3 not at all.

pip-audit itself says "No known vulnerabilities found" and ends with 0 where its service knows none of the packages, as
a mirror that has files but no records does. What it could not ask for stands in its file as skipped.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

CHECKED, VULNERABLE, IN_PART, NOT_AT_ALL = range(4)


def outcome(answer: Path) -> tuple[int, str]:
    """The exit code, and what is said."""
    try:
        packages = json.loads(answer.read_text())["dependencies"]
        asked = [package for package in packages if "skip_reason" not in package]
        bad = [f"{p['name']} {p['version']}: {v['id']}" for p in asked for v in p["vulns"]]
    except (OSError, ValueError, KeyError, TypeError):
        return NOT_AT_ALL, "pip-audit gave no answer: its service cannot be reached from here"
    said = f"pip-audit: {len(asked)} of {len(packages)} packages asked for, {len(bad)} known vulnerabilities"
    if bad:
        return VULNERABLE, f"{said}: {', '.join(bad)}"
    if not asked:
        return NOT_AT_ALL, f"{said}: its service knows none of them, as a mirror does"
    return (CHECKED if len(asked) == len(packages) else IN_PART), said


if __name__ == "__main__":
    code, said = outcome(Path(sys.argv[1]))
    print(f"release-check: {said}", file=sys.stderr)
    sys.exit(code)
