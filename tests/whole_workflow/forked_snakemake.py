"""Snakemake for the tests, forked from a process that has imported it: half of what a short call takes is imports.

As a program: reads from its standard input one JSON call a line, {argv, environment, folder, out}, and answers each
with its exit code; what the call prints goes to the files out.stdout and out.stderr.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

_server: subprocess.Popen[str] | None = None


def call(arguments, environment, folder):
    """`python -m snakemake ARGUMENTS` in a folder, as subprocess.run returns it."""
    global _server
    if _server is None or _server.poll() is not None:
        _server = subprocess.Popen(
            [sys.executable, "-m", "tests.whole_workflow.forked_snakemake"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=Path(__file__).parents[2],
        )
    with tempfile.TemporaryDirectory() as place:
        out = os.path.join(place, "call")
        wanted = {"argv": arguments, "environment": environment, "folder": os.fspath(folder), "out": out}
        assert _server.stdin is not None
        assert _server.stdout is not None
        print(json.dumps(wanted), file=_server.stdin, flush=True)
        code = int(_server.stdout.readline())
        said = [Path(f"{out}.{name}").read_text(encoding="utf-8", errors="replace") for name in ("stdout", "stderr")]
    return subprocess.CompletedProcess(arguments, code, *said)


def _run(wanted):
    """In the fork: the call itself; never returns."""
    null = os.open(os.devnull, os.O_RDONLY)
    files = [os.open(f"{wanted['out']}.{name}", os.O_WRONLY | os.O_CREAT) for name in ("stdout", "stderr")]
    for source, target in zip((null, *files), (0, 1, 2), strict=True):
        os.dup2(source, target)
    os.environ.clear()
    os.environ.update(wanted["environment"])
    os.chdir(wanted["folder"])
    from snakemake.cli import main

    sys.argv = ["snakemake", *wanted["argv"]]
    sys.path[:1] = [wanted["folder"], *filter(None, wanted["environment"].get("PYTHONPATH", "").split(os.pathsep))]
    code = 1
    try:
        main()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(bool(end.code))
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        import atexit

        atexit._run_exitfuncs()
        os._exit(code)


def serve():
    """Answer calls until the standard input ends."""
    import numpy  # noqa: F401
    import snakemake.api
    import snakemake.cli
    import snakemake.dag
    import snakemake.logging
    import snakemake.persistence
    import snakemake.workflow  # noqa: F401

    for line in sys.stdin:
        child = os.fork()
        if not child:
            _run(json.loads(line))
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        print(code, flush=True)


if __name__ == "__main__":
    serve()
