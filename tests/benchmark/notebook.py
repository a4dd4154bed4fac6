#!/usr/bin/env python3
"""Runs the notebook of the guide and stores its outputs in it.

    tests/benchmark/notebook.py [-bin build/bin] [-output docs/guide/planning.ipynb]

Needs: apt-get install --no-install-recommends python3-nbclient python3-ipykernel python3-matplotlib
python3-meshio
"""

import os

from page import PROJECT, option_parser, write


def main():
    import nbclient
    import nbformat
    chosen = option_parser(__doc__, PROJECT / "docs/guide/planning.ipynb").parse_args()
    os.environ |= {"REPOSE_LIVE": str(chosen.bin / "repose-live"),
                   "PYTHONPATH": str(PROJECT / "drivers/python")}
    notebook = nbformat.read(chosen.output, as_version=4)
    nbclient.NotebookClient(notebook, resources={"metadata": {"path": PROJECT / "docs/guide"}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        cell.pop("id", None)
        for one in cell.get("outputs", []):  # Matplotlib's own description of the picture
            one.get("data", {}).pop("text/plain", None)
    notebook.metadata["language_info"] = {"name": "python"}
    write(chosen.output, nbformat.writes(notebook) + "\n")


if __name__ == "__main__":
    main()
