"""Pages in headless Chromium: what a script finds in them, and pictures of them. Files get no network."""

import contextlib
import json
import re
import shutil
import subprocess
import tempfile

import pytest

CHROMIUM = shutil.which("chromium")
OPTIONS = ["--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
           "--enable-unsafe-swiftshader", "--disable-background-networking", "--hide-scrollbars"]
FOUND = re.compile(r'<pre id="found">(.*?)</pre>', re.S)


def needs_browser():
    if not CHROMIUM:
        pytest.skip("Chromium is not installed (apt-get install --no-install-recommends chromium)")


def browse(page, *options, size=(500, 500), seconds=100, check=False):
    """Runs Chromium on a page, a file or an address; returns what it prints."""
    needs_browser()
    place = [page] if isinstance(page, str) else ["--host-resolver-rules=MAP * ~NOTFOUND", page.as_uri()]
    with tempfile.TemporaryDirectory() as profile:
        command = [CHROMIUM, *OPTIONS, f"--user-data-dir={profile}",
                   f"--window-size={size[0]},{size[1]}", *options, *place]
        return subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=check).stdout


@contextlib.contextmanager
def scripted(page, script):
    """A copy of the page that runs the body of an asynchronous function when it says data-ready."""
    copy = page.with_name(page.stem + "_run.html")
    copy.write_text(page.read_text(encoding="utf-8").replace("</body>", f"""<script>(async () => {{
  const sleep = time => new Promise(end => setTimeout(end, time));
  while (!document.documentElement.dataset.ready) await sleep(20);
  {script}
}})();</script></body>"""), encoding="utf-8")
    yield copy
    copy.unlink()


def evaluate(page, script, **options):
    """Returns the JSON result of an asynchronous JavaScript function, given as its body."""
    with scripted(page, f"""
  const told = document.createElement("pre");
  told.id = "found";
  try {{ told.textContent = JSON.stringify(await (async () => {{ {script} }})() ?? null); }}
  catch (reason) {{ told.textContent = JSON.stringify({{error: String(reason.stack)}}); }}
  document.body.append(told);""") as copy:
        printed = browse(copy, "--virtual-time-budget=4000", "--dump-dom", **options)
    found = FOUND.search(printed)
    assert found, printed[-2000:]
    return json.loads(found[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
