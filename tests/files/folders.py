"""What the tests of an experiment folder share: its settings, its problems, and how one of its files is spoilt."""

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.experiment_checks import checked_experiment
from vidtrack.settings.config import settings_from_config


def settings(**changes):
    return settings_from_config({"units": "in", "cameras": {"cam1": {}, "cam2": {}}, **changes})


def problems(**changes):
    with pytest.raises(VidtrackError) as caught:
        checked_experiment(settings(**changes))
    return list(caught.value.problems)


def spoil(folder, path, text=None):
    target = folder / path
    target.parent.mkdir(parents=True, exist_ok=True)
    if text is None:
        target.unlink()
    else:
        target.write_text(text)
