"""vidtrack pick: calibration points, start boxes and thresholds, in the browser."""

from __future__ import annotations

import sys
from contextlib import suppress

import click

from vidtrack.commands.folder import FOLDER, inside

_EXAMPLES = """
\b
Examples:
  vidtrack pick my-lab
  vidtrack pick my-lab --no-browser --port 8000
      on a computer without a screen: open the address that is printed on your
      own, through ssh -L 8000:127.0.0.1:8000 that-computer
"""


@click.command("pick", epilog=_EXAMPLES)
@FOLDER
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    metavar="PORT",
    help="Where the page is served; default: any free one.",
)
@click.option("--no-browser", is_flag=True, help="Only print the address of the page.")
def command(folder: str, port: int, no_browser: bool) -> None:
    """Serve a page for FOLDER on which points are tagged, start boxes are drawn and thresholds are tried.

    It is served on this computer only (127.0.0.1), for those who have the address that is printed. It writes
    calibration/<clip>/picks.csv, runs/<run>/targets.csv and detect keys of config.yaml. End it with Ctrl-C.
    """
    from vidtrack.picking.desk import Desk
    from vidtrack.picking.server import Server

    with inside(folder), Server(Desk(), port) as server, suppress(KeyboardInterrupt):
        click.echo(f"the page: {server.address}")
        sys.stdout.flush()
        if not no_browser:
            import webbrowser

            with suppress(webbrowser.Error):
                webbrowser.open(server.address)
        server.serve_forever()
    click.echo("\nstopped; what was saved is in the folder")
