#!/usr/bin/env python3
"""drivers/map.py SCENE: one HTML page that shows the face of every plan of a scene's box, without a
server. Solves some plans with their derivatives, fits the others, and bounds the error
(docs/guide/map.md).

    drivers/map.py meshes/head_live.yaml -processes 2
    mpirun -n 8 drivers/map.py meshes/head_live.yaml       # a plan a rank
    drivers/map.py meshes/head_live.yaml -plan '{"chin": {"translate": [0, -4, 0]}}'

Solved plans are kept in a folder beside the page; a run that was ended goes on. -plan solves one plan
exactly, writes the result, and says how far the map is from it. Needs: apt-get install
--no-install-recommends python3-numpy python3-scipy"""

import itertools
import json
import math
import os
import pathlib
import shlex
import sys

from sheet.script import Arguments, Unusable, number_from, refuse, refuse_missing, require_file, run
from sheet.web_page import read_web, web_page
from sheet.whole_file import Target

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "python"))
LARGEST_PAGE = 5_000_000  # bytes
BONE_TRIANGLES = 16_000
CLOSE = 0.005             # mm: what rounding a mode may change


try:
    import numpy as np
    import scipy.stats  # noqa: F401  here, so that it is missed at once
    import repose
    from repose.map import LEAST_BOUNDED, MOST_MODES, PlanMap
    from repose.kriging import REACH, SPREAD_NUGGET
    from repose.samples import PlanBox, SampleStore, solve_all
    from sheet.meshes import Pack, coarser
except ImportError as missing:
    refuse_missing(missing, "apt-get install --no-install-recommends python3-numpy python3-scipy")


# ----- the page


def doubles(pack, values):
    """Adds numbers in full precision."""
    values = np.ascontiguousarray(values, "<f8")
    begin = len(pack.bytes)
    pack.bytes += values.tobytes()
    return {"at": begin, "count": int(values.size)}


def packed_kriging(pack, kriging):
    count, dimensions = kriging.u.shape
    return {"samples": count, "dimensions": dimensions, "modes": kriging.weights.shape[1],
            "length": kriging.length.tolist(), "reach": REACH, "spread_nugget": SPREAD_NUGGET,
            "u": doubles(pack, kriging.u), "rows": pack.add(kriging.used, 32),
            "weights": doubles(pack, kriging.weights), "trend": doubles(pack, kriging.trend_weights),
            "precision": doubles(pack, kriging.precision)}


def packed_shape(pack, shape, coefficients):
    """A mode in as few bits as its largest contribution to the samples needs."""
    contribution = (shape.max() - shape.min()) * np.abs(coefficients).max()
    return pack.numbers(shape, 8 if contribution / 510 < CLOSE else 16)


def packed_bones(pack, session):
    share = BONE_TRIANGLES / max(sum(len(one) for _, one in session.bones.values()), 1)
    for name, (points, triangles) in session.bones.items():
        (points,), triangles, _ = coarser([points.astype(float)], triangles, [],
                                          max(int(share * len(triangles)), 200))
        yield {"name": name, "points": pack.numbers(points), "triangles": pack.add(triangles, 32)}


def described(session, plan_map, command, about):
    """The description that map.js reads, and the packed arrays."""
    pack, box = Pack(), plan_map.box
    coefficients = np.abs(plan_map.kriging.predict(plan_map.u)).max(axis=0)
    said = {
        "pieces": [piece.name for piece in session.pieces], "least_bound": plan_map.least_bound,
        "bounded": plan_map.is_bounded, "least_bounded": LEAST_BOUNDED,
        "coordinates": box.coordinates, "half": box.half.tolist(), "box": session.box,
        "axes": session.axes.tolist(),
        "scene_plan": session.scene_plan, "command": command, "about": about,
        "centroids": {piece.name: piece.centroid.tolist() for piece in session.pieces},
        "kriging": packed_kriging(pack, plan_map.kriging), "failed": doubles(pack, plan_map.failed),
        "bones": list(packed_bones(pack, session)),
        "skin": {"points": pack.numbers(session.initial), "triangles": pack.add(session.triangles, 32),
                 "mean": pack.numbers(plan_map.modes.mean), "factor": pack.numbers(plan_map.bound_factor),
                 "shapes": [packed_shape(pack, *one) for one in zip(plan_map.modes.shapes, coefficients)]}}
    return said, pack.text()


def page(chosen, session, plan_map):
    """The page as text."""
    said, packed = described(session, plan_map, chosen.command, summary(plan_map, chosen.accuracy))
    return web_page(chosen.scene.stem, read_web("map.html"), ("viewer.css", "live.css", "map.css"),
                    ("three.js", "viewer.js", "pack.js", "plan.js", "map.js"), said, packed)


def summary(plan_map, accuracy):
    """Summary of the solved plans on which the map rests."""
    errors = plan_map.errors
    failed = len(plan_map.failed)
    return (f"Fitted to {len(errors)} plans solved to {accuracy:g} mm" +
            (f"; {failed} did not converge" if failed else "") +
            f". Plans left out of the fit are off by {np.median(np.percentile(errors, 95, axis=1)):.2f} mm "
            f"on 95 % of the skin (median of plans), at most by {errors.max():.2f} mm. " +
            ("95 % of them keep the error bound at each point" if plan_map.is_bounded else
             f"They keep the error bound, but {len(errors)} are too few to state how many other plans do: solve "
             f"at least {LEAST_BOUNDED}") +
            ". It is one against this model, and says nothing of how well the model fits a patient. For planning "
            "and teaching.")


def fitted_page(chosen, session, box, samples):
    """The map and its page, with as many modes as fit into it."""
    modes = MOST_MODES
    while True:
        plan_map = PlanMap(box, samples, modes, chosen.accuracy)
        text = page(chosen, session, plan_map)
        if len(text) < LARGEST_PAGE:
            return plan_map, text
        modes = len(plan_map.modes.shapes) * 3 // 4
        if modes < 4:
            raise repose.Refused(f"a page of {len(text) / 1e6:.1f} MB, at most {LARGEST_PAGE / 1e6:g} are "
                                 f"allowed: solve a coarser skin ({len(session.initial)} points; tissue.edge)")


# ----- the program


def require_folder(cache):
    """Refuses a folder of solved plans that cannot be made or written."""
    there = next(place for place in (cache, *cache.absolute().parents) if place.exists())
    if not there.is_dir():
        refuse(f"-cache {cache}: {there} is no folder; choose another one")
    if not os.access(there, os.W_OK | os.X_OK):
        refuse(f"-cache {cache}: folder {there} is read-only; choose another one")


def arguments():
    parser = Arguments(__doc__)
    parser.add_argument("scene", type=pathlib.Path, help="scene (.yaml) with a plan")
    parser.add_argument("-samples", type=number_from(3, 10000), help="plans to solve; default: 1 + 2 d and at least 24 or "
                        "4 d more for d coordinates")
    parser.add_argument("-accuracy", type=number_from(1e-4, 1, float), default=0.02, help="mm, of each (default: 0.02)")
    parser.add_argument("-processes", type=number_from(1, 64), default=1, help="solvers at a time (default: 1)")
    parser.add_argument("-output", type=pathlib.Path, help="page (default: SCENE_map.html) or, with "
                        "-plan, result without ending (default: SCENE_plan)")
    parser.add_argument("-cache", type=pathlib.Path, help="folder of solved plans (default: SCENE_map)")
    parser.add_argument("-plan", help="solve this plan, as JSON, in place of making the page")
    chosen = parser.parse_args()
    require_file(chosen.scene, "give a scene file (.yaml)")
    given = [(f"-{name}", str(getattr(chosen, name))) for name in ("samples", "accuracy", "cache")
             if getattr(chosen, name) != parser.get_default(name)]
    chosen.command = shlex.join(["drivers/map.py", str(chosen.scene), *itertools.chain(*given)])
    stem = chosen.scene.with_suffix("")
    chosen.cache = chosen.cache or pathlib.Path(f"{stem}_map")
    require_folder(chosen.cache)
    inputs = repose.Scene(chosen.scene).files()
    if chosen.plan is not None:
        chosen.output = str(chosen.output or f"{stem}_plan").removesuffix(".h5")
        Target(f"{chosen.output}.h5", ".h5", inputs)
    else:
        chosen.output = Target(chosen.output or f"{stem}_map.html", (".html", ".htm"), inputs)
    return chosen


def without_repetition(pairs):
    """The object of JSON; ValueError where a name is given twice."""
    names = [name for name, _ in pairs]
    if repeated := {name for name in names if names.count(name) > 1}:
        raise ValueError(f"'{min(repeated)}' is given more than once")
    return dict(pairs)


def read_plan(text):
    try:
        plan = json.loads(text, object_pairs_hook=without_repetition)
    except (ValueError, RecursionError) as reason:
        refuse(f"-plan: not JSON: {reason}")
    motions = plan.values() if isinstance(plan, dict) else [None]
    for motion in motions:
        numbers = list(motion.items()) if isinstance(motion, dict) else [("", None)]
        if not all(key in ("translate", "rotate") and isinstance(value, list) and len(value) == 3 and
                   all(type(x) in (int, float) and math.isfinite(x) for x in value) for key, value in numbers):
            refuse("-plan: give {PIECE: {\"translate\": [x, y, z], \"rotate\": [x, y, z]}}, mm and degrees")
    return plan


def default_samples(box):
    count = len(box.half)
    return 1 + 2 * count + max(24, 4 * count)


def solve_plan(chosen, session, box, store):
    """Solves one plan, writes it, and compares the map with it."""
    plan = read_plan(chosen.plan)
    box.vector(plan)
    face = session.solve(plan, chosen.accuracy)
    if not face.converged:
        refuse(f"-plan: not converged: {face.info['reason']}")
    session.write(chosen.output)
    print(f"{chosen.output}.h5: within {face.error:.3f} mm of rest")
    known = [store.load(u) for u in box.points(chosen.samples or default_samples(box))]
    if not all(known):
        print(f"{len(known) - known.count(None)} of the map's {len(known)} plans are solved, so how far it is off "
              "is not known; make the page first, with the same -samples, -accuracy and -cache")
    else:
        plan_map = PlanMap(box, known, least_bound=chosen.accuracy)
        off = np.linalg.norm(plan_map.displacement(plan) - face.displacement, axis=1)
        print(f"the map is off by {np.percentile(off, 95):.3f} mm on 95 % of the skin, at most by "
              f"{off.max():.2f} mm; its bound holds on {100 * np.mean(off <= plan_map.bound(plan)):.0f} %")


def show_progress(done, total, text):
    """A bar on a terminal; in a log the end alone, and plans that failed."""
    if sys.stderr.isatty():
        cells = 10 * done // total
        print(f"\r\033[K[{'#' * cells}{'.' * (10 - cells)}] {text}", end="\n" if done == total else "",
              file=sys.stderr, flush=True)
    elif done == total or "not converge" in text:
        print(text, file=sys.stderr, flush=True)


def make_page(chosen, session, box, store):
    points = box.points(chosen.samples or default_samples(box))
    samples = solve_all(chosen.scene, box, points, store, chosen.accuracy, session, chosen.processes,
                        report=show_progress)
    if samples is None:
        return  # another rank makes the page
    plan_map, text = fitted_page(chosen, session, box, samples)
    chosen.output.write(text)
    print(f"{chosen.output}: {len(text) / 1e6:.2f} MB, {len(plan_map.u)} plans, "
          f"{len(plan_map.modes.shapes)} modes\n{summary(plan_map, chosen.accuracy)}")


def main():
    try:
        chosen = arguments()
        with repose.Session(chosen.scene) as session:
            box = PlanBox([piece.name for piece in session.pieces], session.box)
            if not box.coordinates:
                refuse(f"{chosen.scene}: plan.box: all numbers are 0, so there is no other plan to map; make "
                       "one larger")
            key = f"{repose.Scene(chosen.scene).fingerprint(repose.session.find_program())}_{chosen.accuracy:g}"
            store = SampleStore(chosen.cache, key)
            (make_page if chosen.plan is None else solve_plan)(chosen, session, box, store)
    except KeyboardInterrupt:
        refuse("ended; the plans solved so far are kept, and the same command goes on")
    except ValueError as reason:
        raise Unusable(reason) from None


if __name__ == "__main__":
    run(main)
