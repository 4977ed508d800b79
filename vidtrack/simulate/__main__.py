"""python -m vidtrack.simulate SCENARIO OUT: write the experiment folder OUT that a scenario describes.

--list      only say which files it would write
--seed N    other random numbers than the scenario's
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from vidtrack.errors import VidtrackError
from vidtrack.files.config_file import read_config
from vidtrack.simulate.laboratory import planned_files, set_up
from vidtrack.simulate.scenario import scenario_from


def main(argv: Sequence[str]) -> int:
    """Write the folder; 0 when it is written, 1 when a problem was reported."""
    parser = argparse.ArgumentParser(prog="python -m vidtrack.simulate", description="Make an experiment folder.")
    parser.add_argument("scenario", help="YAML; data/demo.yaml is an example with comments")
    parser.add_argument("out", help="the folder to write")
    parser.add_argument("--list", action="store_true", help="only say which files it would write")
    parser.add_argument("--seed", type=int, help="other random numbers than the scenario's")
    parser.add_argument("--threads", type=int, help="how many files are written at once; default: one a processor core")
    arguments = parser.parse_args(argv)
    try:
        values = read_config(arguments.scenario)
        if arguments.seed is not None:
            values["seed"] = arguments.seed
        scenario = scenario_from(values, arguments.scenario)
        if arguments.list:
            sys.stdout.write("".join(f"{path}\n" for path in planned_files(scenario)))
        else:
            set_up(scenario, arguments.out, threads=arguments.threads)
    except VidtrackError as error:
        sys.stderr.write("".join(f"vidtrack: {problem}\n" for problem in error.problems))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
