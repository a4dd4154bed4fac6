#!/usr/bin/env python3
"""drivers/live.py SCENE: plan in the browser. Bones are dragged, the face follows: at once by
derivatives, and exactly a moment later (docs/guide/live.md).

    drivers/live.py meshes/head_live.yaml
    drivers/live.py meshes/head_live.yaml -ranks 2 -port 8123 -no_browser

Starts repose-live and a server for this machine alone (127.0.0.1); its address holds a token,
without which nothing is answered. Ends with Ctrl-C. Needs NumPy, PyYAML and a browser with WebGL 2."""

import hmac
import http.server
import json
import pathlib
import secrets
import signal
import sys
import threading
import types
import urllib.parse
import webbrowser

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE / "python"), str(HERE)]
from sheet.scene import named_file, with_moves  # noqa: E402
from sheet.script import Arguments, Unusable, number_from, refuse, refuse_missing  # noqa: E402
from sheet.script import require_file, run, start  # noqa: E402
from sheet.summary import cautions, sentence  # noqa: E402
from sheet.web_page import read_web, web_page  # noqa: E402

LONGEST_REQUEST = 1 << 20
ANGLES = ("facial convexity", "nasolabial angle", "nasolabial angle by the tip", "mentolabial angle")


def page(scene):
    """The page with all that it needs: no request but to this server."""
    return web_page(scene.stem, read_web("live.html"), ("viewer.css", "live.css"),
                    ("three.js", "viewer.js", "plan.js", "live.js")).encode()


def packed(head, arrays):
    """A line of JSON, then the arrays: as repose-live answers."""
    return json.dumps(head).encode() + b"\n" + b"".join(values.tobytes()
                                                        for values in arrays.values())


class ProfileAngles:
    """Angles of the profile along the axes of the head, by the scene's landmarks and otherwise by the shape of
    the skin."""

    def __init__(self, scene, session):
        self.axes, self.corners = session.axes, session.triangles
        self.before = session.initial @ self.axes.T
        self.points = {}  # {landmark: place on the initial skin}
        try:
            from sheet import profile
        except ImportError:
            return  # they need h5py
        known = self.given(scene)
        profile.complete(known, types.SimpleNamespace(before=self.before, after=self.before, corners=self.corners))
        self.points = {name: place for name, (place, _) in known.items()}

    def given(self, scene):
        from sheet import landmarks
        named = named_file(scene, "landmarks")
        try:
            read = landmarks.read_landmarks(named) if named else {}
        except landmarks.Unusable:
            return {}
        near = {name: landmarks.on_surface(self.before, self.before, self.corners, self.axes @ point)
                for name, point in read.items()}
        return landmarks.known_places([{"name": name, "on": "skin", "before": place, "after": place}
                                       for name, (place, _, distance) in near.items() if distance <= landmarks.NEAR])

    def of(self, position):
        """[{name, before, after}] in degrees."""
        if not self.points:
            return []
        from sheet import landmarks, measures
        after = position @ self.axes.T
        known = {name: landmarks.on_surface(self.before, after, self.corners, point)[:2]
                 for name, point in self.points.items()}
        return [{"name": one["name"], "before": one["values"][0], "after": one["values"][1]}
                for one in measures.measured(known, []) if one["name"] in ANGLES]


class Handler(http.server.BaseHTTPRequestHandler):
    """Answers GET / (the page), /scene and /notice, POST /solve, /scene_file, /result and /report."""
    protocol_version = "HTTP/1.1"

    def allowed(self, token):
        """Returns whether a request has the token and was meant for this machine (no DNS rebinding)."""
        host = self.headers.get("Host", "").rsplit(":", 1)[0]
        good = hmac.compare_digest(token.encode(), self.server.token.encode())
        if good and host in ("127.0.0.1", "localhost"):
            return True
        self.reply(403, b"the request lacks the token of the address that drivers/live.py printed\n",
                   "text/plain")
        return False

    def reply(self, status, content, kind="application/octet-stream"):
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        try:
            self.wfile.write(content)
        except OSError:
            pass  # the page was closed

    def do_GET(self):
        self.answer(self.get)

    def do_POST(self):
        self.answer(self.post)

    def answer(self, work):
        """Answers a request by `work`, or says in words why not."""
        from repose import Refused
        try:
            work()
        except (Refused, Unusable) as refusal:
            overtaken = str(refusal).startswith("abandoned")  # the page has requested another since
            self.reply(204 if overtaken else 409, b"" if overtaken else str(refusal).encode(),
                       "text/plain; charset=utf-8")
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            self.close_connection = True  # the rest of the body is no request
            self.reply(400, f"malformed request: {error}\n".encode(), "text/plain; charset=utf-8")

    def get(self):
        address = urllib.parse.urlsplit(self.path)
        query = urllib.parse.parse_qs(address.query)
        if not self.allowed(query.get("token", [self.headers.get("X-Token", "")])[0]):
            return
        if address.path == "/":
            self.reply(200, self.server.page, "text/html; charset=utf-8")
        elif address.path == "/scene":
            self.reply(200, packed(*self.server.session.describe()))
        elif address.path == "/notice":
            self.reply(200, self.notice(), "application/json")
        else:
            self.reply(404, b"there is no such page\n", "text/plain")

    def content(self):
        """The body of a request; of one that is too long nothing is read, and the connection ends."""
        length = int(self.headers.get("Content-Length") or 0)
        if not 0 <= length <= LONGEST_REQUEST:
            raise ValueError(f"its length must be 0 … {LONGEST_REQUEST} bytes")
        return self.rfile.read(length)

    def post(self):
        content = self.content()
        if not self.allowed(self.headers.get("X-Token", "")):
            return
        work = {"/solve": self.solve, "/scene_file": self.scene_file, "/result": self.result,
                "/report": self.report}.get(self.path)
        if not work:
            return self.reply(404, b"there is no such page\n", "text/plain")
        self.reply(200, work(json.loads(content)))

    def solve(self, request):
        session = self.server.session
        head, arrays = session.ask({**request, "do": "solve"})
        if request.get("points", "skin") == "skin":
            if request.get("tangents"):  # the page rests there
                session.count_answer(request["plan"], head, arrays["position"], request.get("accuracy"))
            head["angles"] = self.server.angles.of(arrays["position"])
            head["cautions"] = [sentence(*one) for one in cautions(head.get("summary", "").splitlines())]
        return packed(head, arrays)

    def notice(self):
        """Returns the text beside the mark of the page: the latest verification, and a scene that has changed."""
        session = self.server.session
        latest = session.verifications[-1:]
        said = {"text": "", "good": True}
        if latest:
            said = {"text": latest[0].message, "good": latest[0].agrees, "plan": latest[0].plan,
                    "lower": latest[0].lower}
        if session.scene_changed:
            said = {"text": "the scene or one of its files has changed on disk: the faces are those of the "
                            "scene as it was; start live.py again", "good": False}
        return json.dumps(said).encode()

    def scene_file(self, request):
        scene = self.server.scene
        return (f"# The plan of {scene.name} as of drivers/live.py; belongs in its folder.\n"
                f"{with_moves(scene, request['moves'])}").encode()

    def result(self, request):
        with self.server.writing:
            self.server.session.write(self.server.output, request["plan"])
        return f"{self.server.output}.h5".encode()

    def report(self, request):
        """Writes the result and its planning sheet."""
        name, file = self.server.output, pathlib.Path(f"{self.server.output}.h5")
        with self.server.writing:
            self.server.session.write(name, request["plan"])
            written = file.stat()
            done = start(sys.executable, HERE / "report.py", name, "-output", f"{name}.html", "-scene",
                         self.server.scene, capture_output=True, text=True)
        if done.returncode != 0:
            reason = done.stderr.strip().splitlines()[-1:] or ["report.py failed"]
            raise Unusable(f"{reason[0]}; {file} is written")
        if not file.exists() or file.stat().st_mtime_ns != written.st_mtime_ns:
            raise Unusable(f"{file} has been written by another program since; write again, or choose another "
                           "-output")
        return f"{name}.html".encode()

    def log_message(self, *_):
        pass


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request, client_address):
        """Passes over connections that end within a request."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


def make_server(session, scene, port=0, output=None):
    """A server of the page about a session of this scene, and its address. Results are called `output` and an ending."""
    try:
        server = Server(("127.0.0.1", port), Handler)
    except OSError as reason:
        refuse(f"-port {port}: {reason.strerror}; choose another one, or 0 for a free one")
    server.session, server.scene, server.writing = session, scene.resolve(), threading.Lock()
    output = output or scene.with_name(scene.stem + "_plan")
    server.output = (output.with_suffix("") if output.suffix == ".h5" else output).resolve()
    server.angles = ProfileAngles(server.scene, session)
    server.token, server.page = secrets.token_urlsafe(18), page(server.scene)
    return server, f"http://127.0.0.1:{server.server_address[1]}/?token={server.token}"


def main():
    parser = Arguments(__doc__)
    parser.add_argument("scene", type=pathlib.Path, help="scene (.yaml) with a plan")
    parser.add_argument("-ranks", type=number_from(1, 1024), default=1, help="processes of the solver")
    parser.add_argument("-port", type=number_from(0, 65535), default=0, help="port of 127.0.0.1; default: a free one")
    parser.add_argument("-output", type=pathlib.Path, metavar="NAME", help="name of results and reports that the page "
                        "writes, without ending; default: that of the scene with _plan, beside it")
    parser.add_argument("-no_browser", action="store_true", help="only print the address")
    options = parser.parse_args()
    require_file(options.scene, "give a scene file (.yaml)")
    try:
        import repose
    except ImportError as missing:
        refuse_missing(missing, "apt-get install --no-install-recommends python3-numpy")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        with repose.Session(options.scene, options.ranks, verify_every=1) as session:
            server, address = make_server(session, options.scene, options.port, options.output)
            print(f"{options.scene}: {address}\nCtrl-C ends it.", flush=True)
            if not options.no_browser:
                webbrowser.open(address)
            with server:
                server.serve_forever()
    except KeyboardInterrupt:
        print()
    except ValueError as refusal:
        refuse(refusal)


if __name__ == "__main__":
    run(main)
