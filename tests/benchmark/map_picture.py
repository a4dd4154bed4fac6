#!/usr/bin/env python3
"""The page of drivers/map.py in headless Chromium, as a picture of the guide.

    tests/benchmark/map_picture.py PAGE [-size 1280,800] [-output docs/images/map.png]

Needs: apt-get install --no-install-recommends chromium
"""

import pathlib
import tempfile

from page import PROJECT, option_parser
from browser import browse  # page knows where it is

VIEW = """<script>(async () => {
  while (!document.documentElement.dataset.ready) await new Promise(end => setTimeout(end, 30));
  const {coordinates, half} = mapPage.described, plan = copyOf(mapPage.plan);
  coordinates.forEach(([piece, key, axis], k) => {
    plan[piece][key][axis] = half[k] * [-0.35, 0.25, 0.15][k % 3];
  });
  mapPage.change(plan);
})();</script></body>"""


def main():
    parser = option_parser(__doc__, PROJECT / "docs/images/map.png", size="1280,800")
    parser.add_argument("page", type=pathlib.Path)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / "page.html"
        copy.write_text(chosen.page.read_text(encoding="utf-8").replace("</body>", VIEW), encoding="utf-8")
        browse(copy, "--virtual-time-budget=6000", f"--screenshot={chosen.output.resolve()}",
               size=chosen.size.split(","), seconds=300, check=True)


if __name__ == "__main__":
    main()
