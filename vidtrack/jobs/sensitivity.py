"""Job `sensitivity`: a rig on paper in, tables of the accuracy that it would have out.

By hand:  vidtrack plan thesis results/sensitivity
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from vidtrack.errors import VidtrackError
from vidtrack.files.records import write_json
from vidtrack.files.tables import write_csv, write_parquet
from vidtrack.progress import Progress
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from pandas import DataFrame

_LENGTHS = (
    *("mean_3d", "worst_mean_3d", "floor_3d", "diagonal_field", "field_width", "field_height", "field_diagonal"),
    *("least_diameter", "least_spacing", "checked_mean_3d", "sd_checked_mean_3d"),
    *(f"{kind}_{axis}" for kind in ("mean_abs", "max_sd", "checked_mean_abs", "sd_t") for axis in "xyz"),
)
_PIXELS = ("target_px", "target_px_least", "target_noise_px", "calibration_noise_px", "sd_Cx", "sd_Cy")
_REST = {"target_pixels_least": "px^2", "units_per_px": "world/px", "sd_f": "mm", "sd_kappa1": "1/mm^2"}
UNITS = {
    **dict.fromkeys(_LENGTHS, "world"),
    **dict.fromkeys(_PIXELS, "px"),
    **dict.fromkeys([f"sd_omega_{axis}" for axis in "xyz"], "rad"),
    **_REST,
}


def run(job: Job) -> None:
    """input scenario (YAML); outputs table, cameras, volume (Parquet, or CSV where the name ends so), record (JSON).

    outputs sweeps, volume_map (PNG), where figures are wanted.
    """
    from vidtrack.figures.sensitivity import sweeps, volume_map
    from vidtrack.files.figure_files import write_figure
    from vidtrack.planning.sensitivity_plan import read_sensitivity
    from vidtrack.stages.sensitivity import sensitivity

    plan, cases = read_sensitivity(job.path("scenario"))
    with Progress("sensitivity", len(cases), "rigs") as progress:
        found = sensitivity(progress.over(cases), trials=plan.trials, seed=plan.seed)
    provenance = {**job.provenance, "scenario": plan.model_dump(mode="json")}
    for name, table in found._asdict().items():
        for output in (name, f"{name}_csv"):
            if output in job.outputs:
                _write(job.outputs[output], table, plan.units, provenance)
    if "record" in job.outputs:
        planned = {str(name): entry for name, entry in found.table.iloc[0].items()}
        write_json(job.outputs["record"], {"units": plan.units, **planned}, provenance)
    if "sweeps" in job.outputs:
        write_figure(job.outputs["sweeps"], sweeps(found.table, plan.units))
        write_figure(job.outputs["volume_map"], volume_map(found.volume, plan.units))


def _write(path: str, table: DataFrame, units: str, provenance: dict[str, object]) -> None:
    if path.endswith(".csv"):
        write_csv(path, table)
    else:
        write_parquet(path, table, units=units, provenance=provenance, columns=UNITS)


def main(arguments: Sequence[str]) -> int:
    """A scenario's tables and figures into a folder; 0, or 1 where a problem was reported on one line."""
    if len(arguments) != 2:
        sys.stderr.write("usage: vidtrack plan SCENARIO.yaml FOLDER\n")
        return 2
    scenario, folder = arguments
    names = ("table", "cameras", "volume")
    outputs = {name: f"{folder}/{name}.parquet" for name in names} | {f"{n}_csv": f"{folder}/{n}.csv" for n in names}
    try:
        others = {"record": "record.json", "sweeps": "sweeps.png", "volume_map": "volume.png"}
        outputs |= {name: f"{folder}/{file}" for name, file in others.items()}
        run(Job(settings={}, inputs={"scenario": scenario}, outputs=outputs))
    except VidtrackError as error:
        sys.stderr.write("".join(f"vidtrack: {problem}\n" for problem in error.problems))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
