#!/usr/bin/env python3
"""The reference of command-line options, as the programs print it:

    tests/program/options_page.py build-ci/bin >docs/reference/options.md"""

import pathlib
import subprocess
import sys

HEAD = """# Command-line options

Printed by `-help` of each program; a test holds this page equal to it. `[…]` gives range and default.
"""


def options_page(folder, environment=None):
    """The page on the programs in a folder."""
    text = HEAD
    for program in sorted(folder.glob("repose-*")):
        message = subprocess.run([program, "-help"], text=True, check=True, env=environment,
                              stdout=subprocess.PIPE, timeout=60).stdout
        text += f"\n## {program.name}\n\n```\n{message.strip()}\n```\n"
    return text


if __name__ == "__main__":
    print(options_page(pathlib.Path(sys.argv[1])), end="")
