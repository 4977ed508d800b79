"""The JSON schema of config.yaml on the standard output."""

import sys

from vidtrack.settings.config import schema_text

sys.stdout.write(schema_text())
