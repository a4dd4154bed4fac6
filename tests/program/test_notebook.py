"""The notebook of the guide: every cell runs, and its outputs are those of its cells."""

import contextlib
import importlib.util
import io
import json
import re
import sys

import pytest
from conftest import PROJECT, programs

NOTEBOOK = PROJECT / "docs/guide/planning.ipynb"


@pytest.fixture(scope="module")
def ran(environment):
    """The variables after the last cell, and [(source, what it printed, what the notebook says)]. The
    cell that draws is left out where Matplotlib is missing."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {**environment, "REPOSE_LIVE": str(programs() / "repose-live"),
                            "MPLBACKEND": "Agg"}.items():
            patch.setenv(name, value)
        patch.syspath_prepend(str(PROJECT / "drivers/python"))
        patch.chdir(NOTEBOOK.parent)
        variables, outcome = {}, []
        for cell in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]:
            source = "".join(cell["source"])
            drawn = "matplotlib" in source and importlib.util.find_spec("matplotlib") is None
            if cell["cell_type"] != "code" or drawn:
                continue
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile(source, str(NOTEBOOK), "exec"), variables)  # noqa: S102
            outcome.append((source, printed.getvalue(), "".join(
                "".join(one.get("text", [])) for one in cell["outputs"])))
        yield variables, outcome
    sys.modules.pop("repose", None)


def test_the_chin_is_where_it_is_wanted(ran):
    variables, _ = ran
    face, point = variables["face"], variables["point"]
    assert abs(face.position[point] - variables["wanted"])[1:].max() < 0.05
    assert "warning" not in face.summary, "bones that end inside one another are no plan"
    assert variables["error"].max() < 1 < variables["moved"].max()
    assert variables["mesh"].point_data["displacement"].shape == face.position.shape


def test_outputs_are_those_of_the_cells(ran):
    _, outcome = ran
    assert len(outcome) >= 5
    number = re.compile(r"-?\d+(?:\.\d+)?")
    for source, printed, stored in outcome:
        assert number.sub("", printed).split() == number.sub("", stored).split(), source
        for one, other in zip(number.findall(printed), number.findall(stored)):
            assert float(one) == pytest.approx(float(other), abs=0.05), source
