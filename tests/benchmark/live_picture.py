#!/usr/bin/env python3
"""The page of drivers/live.py in headless Chromium, as a picture of the guide.

    tests/benchmark/live_picture.py [-bin build/bin] [-scene meshes/head_live.yaml] [-size 1280,800]
                                    [-output docs/images/live.png]

Needs: apt-get install --no-install-recommends chromium python3-numpy
"""

import pathlib
import sys
import threading

from page import PROJECT, option_parser
from browser import browse  # page knows where it is

sys.path[:0] = [str(PROJECT / "drivers/python"), str(PROJECT / "drivers")]
import live  # noqa: E402
import repose  # noqa: E402

VIEW = """<script>(async () => {
  while (!window.planner || document.getElementById("mark").className !== "exact")
    await new Promise(end => setTimeout(end, 50));
  document.getElementById("mode").value = "split";
  planner.showMode();
})();</script></body>"""


def main():
    parser = option_parser(__doc__, PROJECT / "docs/images/live.png", size="1280,800")
    parser.add_argument("-scene", type=pathlib.Path, default=PROJECT / "meshes/head_live.yaml")
    chosen = parser.parse_args()
    with repose.Session(chosen.scene, program=chosen.bin / "repose-live") as session:
        server, address = live.make_server(session, chosen.scene)
        server.page = server.page.replace(b"</body>", VIEW.encode())
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with server:
            browse(address, "--virtual-time-budget=40000", f"--screenshot={chosen.output.resolve()}",
                   size=chosen.size.split(","), seconds=300, check=True)
            server.shutdown()


if __name__ == "__main__":
    main()
