"""What the benchmarks' scripts share: the tables in their pages."""

import pathlib
import resource

PROJECT = pathlib.Path(__file__).resolve().parents[2]


def children():
    """What the programs that have been run used."""
    return resource.getrusage(resource.RUSAGE_CHILDREN)


def events(log):
    """Count and seconds of PETSc's events of preconditioners, from a -log_view."""
    found = {}
    for line in log.read_text(errors="replace").splitlines():
        words = line.split()
        if len(words) > 10 and words[0] in ("PCRenew", "PCApply"):
            found[words[0]] = int(words[1]), float(words[3])
    return found


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
    part = page.with_suffix(".part")
    part.write_text(before + mark_there + "\n" + text + ("\n" + end_there + after) * bool(end_there))
    part.rename(page)
