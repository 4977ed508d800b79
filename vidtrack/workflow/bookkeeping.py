"""What Snakemake itself does for each job, made cheaper: in a season of hundreds of runs it adds up.

Nothing that it records is another value: a checksum that is known already is not computed again.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from functools import wraps
from typing import Any


def with_known_checksums(file_class: Any, checksum_of: Callable[[str], str], results: str) -> None:
    """Let Snakemake's files under `results` have the checksums that are kept for the state that each is in.

    It notes the checksums of all inputs of a job once for each output: a table was read five times.
    checksum_of   the SHA-256 of a file; OSError where it cannot be read
    """
    plain = file_class.checksum
    inside = f"{results}/"

    @wraps(plain)
    async def checksum(self: Any, threshold: int | None = None, force: bool = False, algorithm: Any = None) -> Any:
        if str(self).startswith(inside) and not force and algorithm is None and threshold is not None:
            try:
                if await self.is_checksum_eligible(threshold):
                    return f"sha256:{checksum_of(str(self))}"
            except OSError:
                pass
        return await plain(self, threshold, force, algorithm)

    file_class.checksum = checksum


def with_plain_params(persistence: Any) -> None:
    """Let Snakemake write the params of jobs by `repr` alone: to find that none is a table it would import pandas."""
    persistence._serialize_param_pandas = persistence._serialize_param_builtin


def without_garbage() -> None:
    """Count all that is there as permanent: the graph of all jobs is no matter for the garbage collector."""
    gc.collect()
    gc.freeze()
