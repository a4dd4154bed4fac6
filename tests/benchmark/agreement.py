#!/usr/bin/env python3
"""Compares the faces of a scene over ranks, load steps and methods: a table.

    tests/benchmark/agreement.py [-bin build/bin] [-head ../shared/data/head] [-scenes head_solid,…]
                                 [-accuracy 0.01] [-time_limit 60]
                                 [-output docs/measurements/agreement.md]

Every shipped scene of a solid as it is, with its contact, on one rank by the default method; then on
2, 3 and 5 ranks, in 2, 5 and 10 load steps, and by TAO's other methods. Columns say how far the skin of
these is from the first, mm, at most and at 99 % of its points, the worst run of each kind; runs that
did not converge within the time limit are counted and left out. SCENE:off is the scene without its
contact. Scenes of a real head are passed over where it is missing. Needs: apt-get install --no-install-recommends python3-h5py python3-numpy
"""

import pathlib
import tempfile

import numpy as np

from measure import run
from page import PROJECT, option_parser, print_table
from tissue import last, model_of

SCENES = ("head_solid,head_jaw_advance,head_jaw_opening,head_genioplasty,head_le_fort,head_split,"
          "head_instrument,head_incision,real_head_solid,real_head_posture,real_head_genioplasty,"
          "real_head_le_fort,real_head_mouth,real_head_split,real_head_solid:off")
KINDS = {
    "ranks 2, 3, 5": [(ranks, []) for ranks in (2, 3, 5)],
    "load steps 2, 5, 10": [(1, ["-load_steps", steps]) for steps in (2, 5, 10)],
    "ntr, nls, cg": [(1, ["-tao_type", method]) for method in ("ntr", "nls", "cg")],
}
HEAD = ("| scene | unknowns | evaluations | " + " | ".join(f"{kind}: mm" for kind in KINDS)
        + " | not converged |\n|---" + "|--:" * (3 + len(KINDS)) + "|")


def solve(scene, chosen, folder, ranks, options):
    """Status, counts and the displacement of the skin."""
    done = run([chosen.bin / "repose-solve", f"{scene}.yaml", "-output", "face", "-accuracy",
                chosen.accuracy, "-time_limit", chosen.time_limit, *options], folder, ranks)
    model, step = model_of(folder / "face.h5"), last(folder / "face.h5")
    free = 3 * int((model["point/set"] == 0).sum())
    return done, free, step["point/displacement"][model["point/layer"] == 0]


def name_of(scene, folder):
    """Name of a shipped scene, or of a copy without its contact."""
    shipped, off, _ = scene.partition(":off")
    if not off:
        return shipped
    text = (folder / f"{shipped}.yaml").read_text()
    (folder / f"{shipped}_off.yaml").write_text(text + "contact: {bones: off, cuts: off}\n")
    return f"{shipped}_off"


def row_of(scene, chosen, folder):
    name = name_of(scene, folder)
    first, unknowns, skin = solve(name, chosen, folder, 1, [])
    found, failed = [], int(first.status != 0)
    for runs in KINDS.values():
        worst = [0, 0]
        for ranks, options in runs:
            done, _, other = solve(name, chosen, folder, ranks, options)
            if done.status != 0:
                failed += 1
                continue
            apart = np.linalg.norm(other - skin, axis=1)
            worst = max(worst, [apart.max(), np.quantile(apart, 0.99)])
        found.append("{:.3f}, {:.3f}".format(*worst))
    return (f"| {scene.replace(':off', ', contact off')} | {unknowns} | {first.evaluations[0]} | " + " | ".join(found)
            + f" | {failed} |")


def rows(chosen):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        head = pathlib.Path(chosen.head).resolve()
        for file in [*(PROJECT / "meshes").iterdir(), *head.glob("*.ply")]:
            (folder / file.name).symlink_to(file)
        for scene in chosen.scenes.split(","):
            if scene.startswith("real_head") and not head.is_dir():
                print(f"{scene}: passed over, {head} is missing")
                continue
            yield row_of(scene, chosen, folder)


def main():
    chosen = option_parser(__doc__, head=str(PROJECT.parent / "shared/data/head"), scenes=SCENES,
                           accuracy=0.01, time_limit=60).parse_args()
    print_table(HEAD, rows(chosen), chosen.output, "agreement")


if __name__ == "__main__":
    main()
