"""The JSON schema of config.yaml on the standard output; with the argument `page`, the page of all keys."""

import sys

if sys.argv[1:] == ["page"]:
    from vidtrack.settings.key_page import key_page

    sys.stdout.write(key_page())
else:
    from vidtrack.settings.config import schema_text

    sys.stdout.write(schema_text())
