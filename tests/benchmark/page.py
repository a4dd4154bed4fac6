"""Shared by the benchmarks' scripts: their options, and the tables in their pages."""

import argparse
import pathlib
import sys

PROJECT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(PROJECT / "tests/program"))  # where results are read: tissue
sys.path.append(str(PROJECT / "drivers"))  # what sheets share


def option_parser(about, output=None, **settings):
    """A parser of the options -help, -bin, -output and those of `settings`, whose types are those of
    their defaults. `about` is the script's docstring."""
    parser = argparse.ArgumentParser(description=about, add_help=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-help", action="help")
    parser.add_argument("-bin", type=lambda name: pathlib.Path(name).resolve(),
                        default=PROJECT / "build/bin")
    parser.add_argument("-output", type=pathlib.Path, default=output)
    for name, default in settings.items():
        parser.add_argument(f"-{name}", type=type(default), default=default)
    return parser


def write(file, text):
    """Writes a page at once, so that it is never there in part."""
    part = file.with_suffix(".part")
    part.write_text(text)
    part.rename(file)


def print_table(head, rows, page=None, mark="measured"):
    """Prints a table row by row, and puts it in the place of the one below a page's mark, down to
    the mark "end of MARK" if there is one."""
    text = head + "\n"
    print(head)
    for row in rows:
        print(row, flush=True)
        text += row + "\n"
    if page is None:
        return
    begin, end = f"<!-- {mark} -->\n", f"<!-- end of {mark} -->\n"
    before, mark_there, rest = page.read_text().partition(begin)
    _, end_there, after = rest.partition(end)
    write(page, before + mark_there + "\n" + text + ("\n" + end_there + after) * bool(end_there))
