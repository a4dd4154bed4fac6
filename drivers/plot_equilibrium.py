#!/usr/bin/env python3
"""Fig. 2 of the paper for any result: the forces on the skin's free points at the initial position,
by skin tension and weight alone (before) and with the tensions that balance them (after).

    drivers/plot_equilibrium.py NAME PICTURE.png [GX GY GZ]

Forces are recomputed from /model. GX GY GZ is the gravity field of the recording (the scene's
scan_gravity), N/kg; when not given, that of /model.
Needs: apt-get install --no-install-recommends python3-matplotlib python3-h5py
"""

from sheet.script import Unusable, is_number, reading, refuse_missing, result_name, run, words
from sheet.whole_file import Target, write_figure

try:
    import h5py
    import matplotlib
    import numpy as np

    from sheet.shown_skin import read_places, read_rows
except ImportError as missing:
    refuse_missing(missing, "apt-get install --no-install-recommends python3-matplotlib python3-h5py")

matplotlib.use("Agg")
import matplotlib.pyplot as plt

LONGEST = 12  # mm of an arrow that few exceed
MOST = 1500  # arrows
SMALLEST = 1e-9  # N


def spring_forces(model, which):
    """The forces of the springs `which` on all points at the initial position, [N, 3] N."""
    position = read_places(model, "point/position")
    points = read_rows(model, "spring/points", len(position))[which]
    edge = position[points[:, 1]] - position[points[:, 0]]
    length = np.linalg.norm(edge, axis=1)
    elongation = length - model["spring/rest_length"][()][which]
    ratio = elongation / model["spring/reference"][()][which]
    tension = (model["spring/stiffness"][()][which] * elongation
               * (1 + ratio**2) ** model["spring/exponent"][()][which].astype(float))
    pull = edge * np.divide(tension, length, out=np.zeros_like(length), where=length > 0)[:, None]
    force = np.zeros_like(position)
    np.add.at(force, points[:, 0], pull)
    np.add.at(force, points[:, 1], -pull)
    return force


def initial_forces(file, gravity=None):
    """Free skin points, and the forces on them before and after the equilibrium, [K, 3] each."""
    with reading(file, "a result of repose-solve"), h5py.File(file) as h5:
        model = h5["model"]
        if "spring/points" not in model:
            raise Unusable(f"{file}: holds no springs; give the result of a scene with tissue.springs")
        field = np.array(gravity if gravity else model.attrs["gravity"], float)
        skin = list(model["spring_set"][()]).index(b"layer 0")
        weight = model["point/mass"][()][:, None] * field if "point/mass" in model else 0
        of_skin = model["spring/set"][()] == skin
        free = (model["point/set"][()] == 0) & (model["point/layer"][()] == 0)
        before = weight + spring_forces(model, of_skin)
        after = before + spring_forces(model, ~of_skin)
        if not np.abs(before[free]).max(initial=0) > SMALLEST:
            raise Unusable(f"{file}: no forces to draw: its skin has neither tension nor weight; solve a scene with "
                           "tissue.turgor, or with tissue.mass and scan_gravity")
        return model["point/position"][()][free], before[free], after[free]


def draw_forces(points, before, after, target):
    """Two panels of arrows seen from the side (+x), to one scale."""
    extent = np.ptp(points[:, 1:], axis=0)
    width = 3.4 * max(extent[0] / extent[1], 0.5)
    figure, panels = plt.subplots(1, 2, figsize=(2 * width, 3.8), sharey=True)
    scale = np.percentile(np.linalg.norm(before[:, 1:], axis=1), 98) / LONGEST
    shown = slice(None, None, 1 + len(points) // MOST)
    for axes, state, force in zip(panels, ("before", "after"), (before, after)):
        axes.plot(points[:, 1], points[:, 2], ".", color="0.75", ms=1.5)
        axes.quiver(points[shown, 1], points[shown, 2], force[shown, 1], force[shown, 2],
                    color="#b02020", angles="xy", scale_units="xy", scale=scale, width=0.004)
        largest = np.linalg.norm(force, axis=1).max()
        axes.set_title(f"{state}: {largest:.2g} N at most", fontsize=10)
        axes.set_aspect("equal")
        axes.set_axis_off()
    write_figure(figure, target)


def main():
    name, picture, *field = words(__doc__, 2, 5)
    if len(field) not in (0, 3) or not all(map(is_number, field)):
        raise Unusable(f"GX GY GZ: give three numbers in place of '{' '.join(field)}'")
    file = f"{result_name(name)}.h5"
    target = Target(picture, ".png", [file])
    draw_forces(*initial_forces(file, [float(number) for number in field]), target)


if __name__ == "__main__":
    run(main)
