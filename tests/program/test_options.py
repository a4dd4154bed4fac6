"""The reference of command-line options is what the programs print."""

import re

from conftest import PROJECT, programs
from options_page import options_page

PAGE = (PROJECT / "docs/reference/options.md").read_text(encoding="utf-8")


def test_the_reference_is_what_the_programs_print(environment):
    printed = options_page(programs(), environment)
    assert re.findall("^## repose-solve$", printed, re.M)
    assert PAGE == printed, "write it again by tests/program/options_page.py"
