"""The reference of command-line options is what the programs print, and pages use what is in it."""

import re

import pytest

from conftest import PROJECT, programs
from options_page import options_page

pytestmark = pytest.mark.quick

PAGE = (PROJECT / "docs/reference/options.md").read_text(encoding="utf-8")
SECTIONS = re.findall(r"^## (repose-\w+)\n(.*?)(?=^## |\Z)", PAGE, re.M | re.S)
OPTIONS = {program: set(re.findall(r"^  -(\w+)", text, re.M)) for program, text in SECTIONS}
OF_PETSC = re.compile(r"help$|(tao|ksp|pc|log|options)_")


def unknown_options(text):
    """Yields the options in a page's commands that no program has."""
    for program, rest in re.findall(r"(?:^|[\s`/])(repose-\w+)( [^\n`|]*)", text):
        for name in re.findall(r" -([a-z]\w*)", rest.split("  #")[0]):
            if name not in OPTIONS.get(program, ()) and not OF_PETSC.match(name):
                yield f"{program} -{name}"


def test_the_reference_is_what_the_programs_print(environment):
    printed = options_page(programs(), environment)
    assert "repose-solve" in OPTIONS
    assert PAGE == printed, "write it again by tests/program/options_page.py"


def test_pages_use_options_that_exist():
    pages = [PROJECT / "README.md", *(PROJECT / "docs").rglob("*.md")]
    faults = [f"{page.relative_to(PROJECT)}: {fault}" for page in pages
              for fault in unknown_options(page.read_text(encoding="utf-8"))]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize("text", ["    repose-solve a.yaml -layer 3", "`repose-none a -output b`"])
def test_an_unknown_option_is_seen(text):
    assert list(unknown_options(text))
