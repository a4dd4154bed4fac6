"""Random small scenes: a patch of skin over one or two bones, and features drawn so that every pair of
their levels that can meet occurs."""

import itertools

import numpy as np

SPRINGS = ("linear", "quadratic", "quartic", "isotropic")
SOLIDS = ("face", "skin_on_fat", "incompressible", "strata")
LEVELS = {
    "tissue": SPRINGS + SOLIDS,
    "dilatation": ("prism", "nodal"),
    "region": ("none", "sphere"),
    "volume": ("penalty", "none", "paper"),
    "poisson": (0.3, 0.45, 0.49),
    "layers": (2, 3, 4),
    "depths": ("even", "uneven"),
    "shape": ("flat", "wavy"),
    "bone": ("box", "ellipsoid"),
    "bones": ("one", "two", "cut"),
    "move": ("none", "translate", "rotate", "both"),
    "rim": ("fixed", "free", "auto"),
    "turgor": (0, 0.03),
    "weight": ("none", "mass", "density"),
    "scan": ("same", "other"),
    "force": ("none", "one"),
    "cut": ("none", "skin", "through", "mouth"),
    "instrument": ("none", "sphere", "capsule", "box", "half_space", "mesh"),
    "skin": ("stick", "slide"),
    "contact_bones": ("off", "on"),
    "contact_cuts": ("off", "on"),
    "attach": ("fixed", "slide", "contact", "free"),
    "release": (0, 2, 5),
    "load_steps": ("auto", 2),
    "ranks": (1, 2, 3),
}


def possible(scene):
    """A scene with what cannot be combined set to "-"."""
    solid = scene["tissue"] in SOLIDS
    own = {
        "dilatation": solid, "region": solid,
        "volume": not solid and scene["tissue"] != "isotropic",
        "poisson": solid or scene["tissue"] == "isotropic" or scene["volume"] == "penalty",
        "scan": scene["weight"] != "none",
        "skin": scene["instrument"] != "none",
        "contact_cuts": scene["cut"] != "none",
        "release": scene["move"] != "none",
    }
    return {name: level if own.get(name, True) else "-" for name, level in scene.items()}


def pairs(scene):
    return set(itertools.combinations(sorted(scene.items()), 2))


def draw(random):
    return possible({name: levels[random.integers(len(levels))] for name, levels in LEVELS.items()})


def plan(seed, count):
    """Scenes in an order in which each covers as many new pairs as any of a few hundred draws, and how
    many of them cover every pair of levels that 20 000 draws hold."""
    random = np.random.default_rng(seed)
    every, pool = set(), np.random.default_rng([seed, 1])
    for _ in range(20000):
        every |= pairs(draw(pool))
    left, chosen, needed = set(every), [], None
    while len(chosen) < count:
        candidates = [draw(random) for _ in range(200 if left else 1)]
        best = max(candidates, key=lambda scene: len(pairs(scene) & left))
        chosen.append(best)
        left -= pairs(best)
        needed = len(chosen) if not left and needed is None else needed
    return chosen, len(every), len(left), needed


def write_ply(file, points, triangles):
    rows = [f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in points]
    rows += [f"3 {a} {b} {c}" for a, b, c in triangles]
    head = f"""ply
format ascii 1.0
element vertex {len(points)}
property double x
property double y
property double z
element face {len(triangles)}
property list uchar int vertex_indices
end_header
"""
    file.write_text(head + "\n".join(rows) + "\n")


def sheet(columns, rows):
    """Triangles of a grid of vertices, counterclockwise seen from +z."""
    i, j = (part.ravel() for part in np.meshgrid(np.arange(columns - 1), np.arange(rows - 1)))
    a = i * rows + j
    b, c, d = a + rows, a + rows + 1, a + 1
    return np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def block(low, high):
    """A closed box of 12 triangles."""
    corners = np.array(list(itertools.product(*zip(low, high))), float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def ellipsoid(low, high, turns=10, rings=6):
    """A closed ellipsoid in a box."""
    middle, half = (np.array(low) + high) / 2, (np.array(high) - low) / 2
    points = [[0, 0, 1]]
    for r in range(1, rings):
        for t in range(turns):
            up, around = np.pi * r / rings, 2 * np.pi * t / turns
            points.append([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)])
    points.append([0, 0, -1])
    last, triangles = len(points) - 1, []
    for t in range(turns):
        u = (t + 1) % turns
        triangles.append((0, 1 + t, 1 + u))
        for r in range(rings - 2):
            a, b = 1 + r * turns, 1 + (r + 1) * turns
            triangles += [(a + t, b + t, b + u), (a + t, b + u, a + u)]
        begin = 1 + (rings - 2) * turns
        triangles.append((last, begin + u, begin + t))
    return middle + half * np.array(points), triangles


class Writer:
    """Writes a scene's files to a folder; its numbers come from a seed."""

    def __init__(self, scene, seed, folder):
        self.scene, self.folder, self.random = scene, folder, np.random.default_rng(seed)
        cut = scene["cut"] != "none"
        self.columns = int(self.random.integers(7, 9) if cut else self.random.integers(5, 9))
        self.rows = int(self.random.integers(7, 9) if cut else self.random.integers(4, 7))
        self.edge = self.number(4, 6)
        self.thick = self.number(6, 9)
        self.size = self.edge * np.array([self.columns - 1, self.rows - 1])

    def number(self, low, high):
        return float(f"{self.random.uniform(low, high):.4g}")

    def vector(self, size, *scale):
        """Random numbers up to a size as YAML, each with its own factor."""
        return "[" + ", ".join(str(self.number(-size, size) * k) for k in scale or (1, 1, 1)) + "]"

    def point(self, x, y, z):
        return f"[{x:.4f}, {y:.4f}, {z:.4f}]"

    def middle(self, z=0.0):
        return self.point(*(self.size * self.random.uniform(0.4, 0.6, 2)), z)

    def low(self, z=0.0):
        """Where no instrument is."""
        return self.point(*(self.size * self.random.uniform([0.3, 0.15], [0.7, 0.35])), z)

    def write(self):
        files = self.surfaces()
        parts = [files, self.tissue(), self.loads(), self.moves(), self.contact(), self.solve()]
        text = "\n".join(part for part in parts if part) + "\n"
        (self.folder / "scene.yaml").write_text(text)
        return text

    def surfaces(self):
        i, j = (part.ravel() for part in np.meshgrid(np.arange(self.columns), np.arange(self.rows),
                                                     indexing="ij"))
        skin = self.edge * np.stack([i, j, 0 * i], 1).astype(float)
        skin += self.edge * self.random.uniform(-0.15, 0.15, skin.shape) * [1, 1, 0.3]
        if self.scene["shape"] == "wavy":
            skin[:, 2] += self.number(0.8, 1.5) * np.sin(skin[:, 0] / self.number(4, 7))
        write_ply(self.folder / "skin.ply", skin, sheet(self.columns, self.rows))
        self.skin = skin
        text = "skin: skin.ply\nbones:"
        x, y = self.size
        spans = {"upper": (-6, x + 6)}
        if self.scene["bones"] == "two":
            spans = {"upper": (-6, x / 2 - 0.7), "lower": (x / 2 + 0.7, x + 6)}
        shape = block if self.scene["bone"] == "box" else ellipsoid
        for name, (begin, end) in spans.items():
            wide = 6 if shape is block else 12
            low, high = (begin, -wide, -self.thick - 14), (end, y + wide, -self.thick)
            write_ply(self.folder / f"{name}.ply", *shape(low, high))
            text += f"\n  - {{name: {name}, file: {name}.ply}}"
        if self.scene["bones"] == "cut":
            text += (f"\nosteotomies:\n  - {{bone: upper, piece: lower, kerf: 0.6, planes: [{{point: "
                     f"{self.point(x * self.number(0.45, 0.55), y / 2, -self.thick)}, "
                     f"normal: [1, {self.number(-0.2, 0.2)}, 0]}}]}}")
        return text

    def tissue(self):
        scene, lines = self.scene, [f"layers: {self.scene['layers']}"]
        if scene["depths"] == "uneven":
            inner = np.sort(self.random.uniform(0.2, 0.8, scene["layers"] - 2))
            inner = inner + 0.1 * np.arange(len(inner))
            lines.append("depths: [" + ", ".join(f"{v:.3f}" for v in [0, *inner, 1]) + "]")
        if scene["turgor"]:
            lines.append(f"turgor: {0.01 if scene['tissue'] in SPRINGS else scene['turgor']}")
        if scene["weight"] == "mass":
            lines.append(f"mass: {[self.number(1e-4, 3e-4) for _ in range(scene['layers'])]}")
        if scene["weight"] == "density":
            lines.append("density: 1.0e-6")
        if scene["release"] != "-":
            lines.append(f"release: {scene['release']}")
        if scene["attach"] != "fixed":
            radius = 0.25 * max(self.size)
            region = f"sphere: {{center: {self.low(-self.thick)}, radius: {radius:.3f}}}"
            lines.append(f"attach_regions:\n    - {{{region}, attach: {scene['attach']}}}")
        lines.append(self.solid() if scene["tissue"] in SOLIDS else self.springs())
        return "tissue:\n  " + "\n  ".join(lines)

    def solid(self):
        scene = self.scene
        lines = [f"poisson: {scene['poisson']}", f"dilatation: {scene['dilatation']}"]
        if scene["tissue"] == "strata":
            strata = ", ".join(f"{{thickness: {self.number(1, 3)}, young: {self.number(0.005, 0.1)}}}"
                               for _ in range(2))
            lines += [f"strata: [{strata}]", f"young: {self.number(0.01, 0.03)}"]
        else:
            lines.append(f"preset: {scene['tissue']}")
        if scene["turgor"] and scene["tissue"] in ("face", "incompressible"):
            lines.append(f"skin: {{thickness: 1.5, young: {self.number(0.04, 0.1)}}}")
        if scene["region"] == "sphere":
            sphere = f"sphere: {{center: {self.middle(-3)}, radius: {self.number(4, 8)}}}"
            lines.append(f"regions:\n      - {{{sphere}, young: {self.number(0.002, 0.2)}}}")
        return "material:\n    " + "\n    ".join(lines)

    def springs(self):
        kind = self.scene["tissue"]
        if kind == "isotropic":
            return (f"springs: {{isotropic: {{young: {self.number(0.01, 0.05)}, "
                    f"poisson: {self.scene['poisson']}}}}}")
        reference = "initial" if self.random.random() < 0.5 else "1.0"
        stiffness, skin = ((f"stiffness: 1.0", f"stiffness: {self.number(0.5, 2)}")
                           if self.random.random() < 0.5 else
                           ("modulus: 0.02", f"modulus: {self.number(0.01, 0.04)}"))
        return (f"springs:\n    default: {{{stiffness}, law: {kind}, reference: {reference}}}\n"
                f"    \"layer 0\": {{{skin}}}")

    def loads(self):
        scene, text = self.scene, f"boundary: {{rim: {self.scene['rim']}}}"
        if scene["weight"] != "none":
            text += f"\ngravity: {self.vector(9)}"
        if scene["scan"] == "other":
            text += f"\nscan_gravity: {self.vector(9)}"
        if scene["force"] == "one":
            text += (f"\nforces:\n  - {{at: {self.low()}, radius: 8, "
                     f"force: {self.vector(0.05)}}}")
        return text

    def moves(self):
        scene = self.scene
        bone = "upper" if scene["bones"] == "one" else "lower"
        turn = (f"rotate: {{axis: {self.vector(1)}, center: {self.middle(-self.thick - 5)}, "
                f"angle: {self.number(2, 6)}}}")
        shift = f"translate: {self.vector(2.5)}"
        made = {"none": [], "translate": [shift], "rotate": [turn], "both": [turn, shift]}[scene["move"]]
        return "moves:" * bool(made) + "".join(f"\n  - {{bone: {bone}, {one}}}" for one in made)

    def contact(self):
        scene, text = self.scene, self.cut() + self.instrument()
        cuts = "" if scene["contact_cuts"] == "-" else f", cuts: {scene['contact_cuts']}"
        return text + f"contact: {{bones: {scene['contact_bones']}{cuts}}}"

    def solve(self):
        scene = self.scene
        volume = ""
        if scene["volume"] != "-":
            poisson = f", poisson: {scene['poisson']}" if scene["poisson"] != "-" else ""
            volume = f", volume: {{form: {scene['volume']}{poisson}}}"
        return f"solve: {{load_steps: {scene['load_steps']}{volume}}}"

    def cut(self):
        kind = self.scene["cut"]
        if kind == "none":
            return ""
        y = self.size[1] * self.random.uniform(0.28, 0.36, 3)
        x = self.size[0] * np.array([self.number(0.2, 0.3), 0.5, self.number(0.7, 0.8)])
        path = "[" + ", ".join(self.point(*at, 0) for at in zip(x, y)) + "]"
        if kind == "mouth":
            return f"mouth: {{path: {path}}}\n"
        layers = 1 if kind == "skin" else self.scene["layers"]
        return f"incisions:\n  - {{path: {path}, layers: {layers}}}\n"

    def instrument(self):
        kind = self.scene["instrument"]
        if kind == "none":
            return ""
        low, high = (0.5, 0.7) if self.scene["cut"] == "none" else (0.7, 0.8)
        x, y = self.size * self.random.uniform([0.3, low], [0.7, high])
        nearest = np.linalg.norm(self.skin[:, :2] - [x, y], axis=1).argmin()
        radius, top = self.number(4, 9), self.skin[nearest, 2] + self.number(-0.2, 0.4)
        z = top + radius
        end = self.point(x + self.number(3, 8), y + self.number(-3, 3), z)
        half = [radius, 0.8 * radius, radius]
        shape = {
            "sphere": f"sphere: {{center: {self.point(x, y, z)}, radius: {radius}}}",
            "capsule": f"capsule: {{from: {self.point(x, y, z)}, to: {end}, radius: {radius}}}",
            "box": f"box: {{center: {self.point(x, y, z)}, size: {[2 * h for h in half]}}}",
            "half_space": f"half_space: {{point: {self.point(x, self.size[1], top)}, normal: "
                          f"[{self.number(-0.1, 0.1)}, -{self.number(0.3, 0.5)}, -1]}}",
            "mesh": "mesh: instrument.ply",
        }[kind]
        if kind == "mesh":
            middle = np.array([x, y, z])
            write_ply(self.folder / "instrument.ply", *ellipsoid(middle - half, middle + half))
        push = self.point(self.number(-0.5, 0.5), self.number(-0.5, 0.5), -self.number(1.5, 3))
        return f"instruments:\n  - {{{shape}, push: {push}, skin: {self.scene['skin']}}}\n"
