"""vidtrack doctor: what a bug report needs to know of this computer."""

from __future__ import annotations

import os
import platform
import shutil
import sys
from importlib.metadata import PackageNotFoundError, version

import click

PACKAGES = (
    *("vidtrack", "snakemake", "numpy", "scipy", "pandas", "pyarrow", "opencv-python-headless", "av", "matplotlib"),
    *("pydantic", "click", "rich"),
)
CODECS = ("h264", "hevc", "mpeg2video", "dvvideo", "mjpeg", "prores", "ffv1", "rawvideo", "vp9", "av1", "png", "tiff")

_EXAMPLES = """
\b
Examples:
  vidtrack doctor            versions, codecs, cores, memory
  vidtrack doctor my-lab     and the disc and the lock of an experiment
"""


@click.command("doctor", epilog=_EXAMPLES)
@click.argument("folder", required=False, type=click.Path(exists=True, file_okay=False))
def command(folder: str | None) -> int:
    """Print versions, codecs, cores and memory, and of FOLDER what disc space and which lock it has."""
    troubles = []
    click.echo(f"python: {platform.python_version()} ({sys.executable})")
    click.echo(f"system: {platform.platform()}")
    for package in PACKAGES:
        try:
            click.echo(f"{package}: {version(package)}")
        except PackageNotFoundError:
            click.echo(f"{package}: not installed")
            troubles.append(f"{package} is not installed. Run setup.sh, or install vidtrack again.")
    click.echo(f"cores: {_cores()}")
    click.echo(f"memory: {_memory()}")
    missing = _missing_codecs()
    click.echo(f"decoders: {', '.join(c for c in CODECS if c not in missing)}")
    if missing:
        troubles.append(f"decoders missing: {', '.join(missing)}. Recordings of that kind cannot be read.")
    click.echo(f"workflow: {_workflow(troubles)}")
    if folder:
        _of_folder(folder, troubles)
    for trouble in troubles:
        click.echo(f"trouble: {trouble}")
    return 1 if troubles else 0


def _cores() -> str:
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{usable} usable of {os.cpu_count()} ({platform.processor() or platform.machine()})"


def _memory() -> str:
    try:
        import psutil

        memory = psutil.virtual_memory()
    except ImportError:
        return "unknown"
    return f"{memory.available / 2**30:.1f} of {memory.total / 2**30:.1f} GiB free"


def _missing_codecs() -> list[str]:
    import av

    return [codec for codec in CODECS if codec not in av.codecs_available]


def _workflow(troubles: list[str]) -> str:
    from vidtrack.errors import VidtrackError
    from vidtrack.workflow.shipped import workflow_file

    try:
        return workflow_file("Snakefile")
    except VidtrackError as error:
        troubles.append(str(error))
        return "missing"


def _of_folder(folder: str, troubles: list[str]) -> None:
    from vidtrack.workflow.lock import at_work, is_locked

    space = shutil.disk_usage(folder)
    click.echo(f"disc: {space.free / 2**30:.1f} of {space.total / 2**30:.1f} GiB free")
    if not os.access(folder, os.W_OK):
        troubles.append(f"{folder}: may not be written to. Correct its permissions.")
    holder = at_work(folder)
    if is_locked(folder) and not holder:
        troubles.append(f"{folder}: locked by a run that was killed. Call vidtrack unlock {folder}.")
    click.echo(f"lock: {f'held by process {holder}' if holder else 'stale' if is_locked(folder) else 'none'}")
