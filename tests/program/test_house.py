"""House rules that can be checked by program: rooms, sizes of functions, headers, words, links."""

import ast
import posixpath
import re

import pytest

from conftest import PROJECT

pytestmark = pytest.mark.quick

ROOMS = {
    "base": set(),
    "scene": {"base"},
    "surface": {"base"},
    "imaging": {"base", "surface"},
    "meshtools": {"base", "surface", "imaging"},
    "anatomy": {"base", "scene", "surface"},
    "model": {"base", "scene", "surface", "imaging", "meshtools", "anatomy"},
    "mechanics": {"base", "surface", "model"},
    "discrete": {"base", "surface", "model", "mechanics"},
    "linear": {"base", "model", "mechanics", "discrete"},
    "solve": {"base", "model", "mechanics", "discrete", "linear"},
    "results": {"base", "model"},
    "adapt": {"base", "scene", "surface", "meshtools", "model", "mechanics", "discrete", "linear",
              "solve"},
    "live": {"base", "scene", "surface", "model", "solve", "adapt", "app"},
    "app": {"base", "scene", "surface", "model", "mechanics", "discrete", "linear", "solve",
            "results", "adapt"},
    "tools/bone_separation": {"base", "imaging", "anatomy"},
    "tools/check": {"base", "model", "mechanics", "results"},
    "tools/comparison": {"base", "surface", "imaging", "meshtools"},
    "tools/decimation": {"base", "surface"},
    "tools/phantom": {"base", "scene", "surface"},
    "tools/range_scan": {"base", "surface"},
    "tools/registration": {"base", "surface"},
}
PETSC_ROOMS = [f"{top}/{room}" for room in ROOMS if room != "mechanics"
               for top in ("src", "include/repose")]
# Start of an included name → the folders that may include it.
LIBRARIES = {
    "CGAL/": ["src/surface", "src/meshtools", "src/tools/phantom"],
    "itk": ["src/imaging"],
    "nlohmann/": ["src/live"],
    "yaml-cpp": ["src/scene"],
    "slepc": ["src/solve"],
    "petsctao": ["src/solve", "include/repose/solve"],
    "hdf5": ["src/base", "src/results", "include/repose/base", "include/repose/results"],
    "petsc": PETSC_ROOMS,
    "repose/base/petsc": PETSC_ROOMS,
}
# No public header may show CGAL, and several rooms call it.
SHARED = {"../surface/cgal.h", "../../surface/cgal.h"}
MOST_HEADERS = MOST_MEMBERS = 12
LONGEST, USUAL, USUAL_SHARE = 60, 35, 0.9
WORDS = re.compile(r"\b(TO" r"DO|FIX" r"ME|XX" r"X|HA" r"CK)\b"
                   r"|(?<![\w.$})~*-])/(work|home|root|tmp|mnt|Users)/")
TEXT = {".cpp", ".h", ".py", ".sh", ".md", ".txt", ".yaml", ".json", ".cmake"}
NAMED = re.compile(r"(?<![\w./-])(?:src|include|tests|drivers|examples|cmake|meshes|docs)/[\w./-]*"
                   r"\.(?:cpp|h|py|sh|md|yaml|js|slurm|png|mhd|cmake|json)\b")


def files(*suffixes):
    """The project's text files with one of the suffixes, build folders left out."""
    for path in sorted(PROJECT.rglob("*")):
        name = path.relative_to(PROJECT)
        skip = any(part in (".git", ".pytest_cache") or part.startswith("build") for part in name.parts[:-1])
        if path.is_file() and path.suffix in suffixes and not skip:
            yield name.as_posix(), path.read_text(encoding="utf-8")


def sources():
    """The sources of the rooms: what is declared in include/ and defined in src/."""
    found = [(n, t) for n, t in files(".h", ".cpp") if n.startswith(("src/", "include/"))]
    assert found
    return found


def room_of(name):
    """The room of a file of src or include/repose, or of a header as it is included."""
    return re.match(r"(?:src/|include/)?(?:repose/)?(tools/\w+|\w+)", name).group(1)


def crossings(name, text):
    """Includes of a file of a room that cross the room's lines, one message each."""
    home = room_of(name)
    folder = name[:name.index(home) + len(home)]
    for line, text_line in enumerate(text.splitlines(), 1):
        match = re.match(r'\s*#\s*include\s*[<"]([^>"]+)', text_line)
        if not match:
            continue
        included = match.group(1)
        for start, homes in LIBRARIES.items():
            if included.startswith(start) and folder not in homes:
                yield f"{name}:{line} includes {included}, which belongs in {', '.join(homes)}"
        if "../" in included and included not in SHARED:
            yield f"{name}:{line} includes {included}, a header of another room's own"
        if included.startswith("repose/") and room_of(included) not in ROOMS[home] | {home}:
            yield f"{name}:{line} includes {included}; {home} may not"


def functions(text):
    """(first line, number of lines) of each C++ function, laid out over lines by clang-format: its
    last brace is as far in as the line that began it, and no line between is as far out."""
    text = re.sub(r'R"(\w*)\(.*?\)\1"', lambda m: "\n".join('""' for _ in m[0].splitlines()), text,
                  flags=re.S)
    indents = [len(t) - len(t.lstrip()) for t in text.splitlines()]
    lines = [t.strip() for t in text.splitlines()]
    found = []
    for end, line in enumerate(lines):
        if not line.startswith("}") or line.startswith("} "):
            continue
        begin = end - 1
        while begin >= 0 and (not lines[begin] or lines[begin][0] in '#"' or
                              indents[begin] > indents[end]):
            begin -= 1
        head = " ".join(lines[max(begin, 0):end]).split("{")[0]
        if "(" in head and not re.match(r"}|(if|for|while|switch|try|class|struct|enum)\b", head):
            found = [(b, n) for b, n in found if b < begin] + [(begin, end - begin + 1)]
    return [(begin + 1, length) for begin, length in found]


def classes(text):
    """(name, number of data members) of each class: members have names with a trailing underscore."""
    text = re.sub(r"//.*", "", text)
    found = []
    for match in re.finditer(r"\b(?:class|struct) (\w+)[^;{}()=]*{", text):
        depth, own = 1, ""  # what is outside all further braces
        for char in text[match.end():]:
            depth += {"{": 1, "}": -1}.get(char, 0)
            if depth == 0:
                break
            own += char.replace("}", ";") if depth == 1 else ""
        while re.search(r"<[^<>]*>", own):
            own = re.sub(r"<[^<>]*>", "", own)
        statements = re.sub(r"\b(public|protected|private):", "", own).split(";")
        members = [re.findall(r"\b\w+_(?=\s*(?:=|,|$))", statement) for statement in statements
                   if "(" not in statement.split("=")[0]]
        found.append((match.group(1), sum(map(len, members))))
    return found


def python_functions(text):
    """(first line, number of lines) of each Python function."""
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, kinds)]
    return [(node.lineno, node.end_lineno - node.lineno + 1) for node in nodes]


def test_includes_stay_in_their_rooms():
    faults = [fault for name, text in sources() for fault in crossings(name, text)]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize("name, include", [
    ("src/base/a.cpp", '"repose/scene/scene.h"'),
    ("include/repose/results/a.h", '"repose/mechanics/energy.h"'),
    ("include/repose/surface/a.h", "<CGAL/Surface_mesh.h>"),
    ("src/model/a.cpp", "<CGAL/Surface_mesh.h>"),
    ("src/model/a.cpp", "<yaml-cpp/yaml.h>"),
    ("include/repose/imaging/a.h", "<itkImage.h>"),
    ("src/mechanics/a.cpp", "<petscvec.h>"),
    ("src/mechanics/a.cpp", '"repose/base/petsc.h"'),
    ("src/base/a.cpp", "<petsctao.h>"),
    ("src/solve/a.cpp", "<hdf5.h>"),
    ("src/model/a.cpp", '"../surface/soup.h"'),
])
def test_a_crossing_is_seen(name, include):
    assert list(crossings(name, f"#pragma once\n#include {include}\n"))


def public_headers():
    """{room: names of its public headers}, as an include directive has them."""
    found = {room: set() for room in ROOMS}
    for name, _ in sources():
        if name.startswith("include/"):
            found[room_of(name)].add(name.removeprefix("include/"))
    return found


def headers_in_use(texts):
    """Headers that files outside their own room include, and what these need themselves."""
    included = {name: set(re.findall(r'#include "(repose/[^"]+)"', text)) for name, text in texts}
    ours = ("src/", "include/")
    ahead = [header for name, headers in included.items() for header in headers
             if not name.startswith(ours) or room_of(header) != room_of(name)]
    used = set()
    while ahead:
        header = ahead.pop()
        if header not in used:
            used.add(header)
            ahead += included.get(f"include/{header}", ())
    return used


def test_a_public_header_serves_other_rooms():
    texts = [(name, text) for name, text in files(".h", ".cpp") if not name.startswith("tests/")]
    used = headers_in_use(texts)
    alone = [header for headers in public_headers().values() for header in headers - used]
    assert not alone, f"used by their own room only, so they belong beside its sources: {alone}"


def test_a_header_of_one_room_is_seen():
    texts = [("src/model/a.cpp", '#include "repose/model/a.h"'), ("src/app/b.cpp", '#include "repose/model/b.h"'),
             ("include/repose/model/b.h", '#include "repose/model/c.h"')]
    assert headers_in_use(texts) == {"repose/model/b.h", "repose/model/c.h"}


def test_rooms_have_few_public_headers():
    counts = {room: len(headers) for room, headers in public_headers().items()}
    assert min(counts.values()) > 0 and max(counts.values()) <= MOST_HEADERS, counts


def test_no_room_holds_more_than_a_fifth():
    lines = {room: 0 for room in ROOMS}
    for name, text in sources():
        lines[room_of(name)] += text.count("\n")
    assert max(lines.values()) <= sum(lines.values()) / 5, lines


def test_functions_fit_on_a_screen():
    lengths = [(length, f"{name}:{line}") for name, text in files(".h", ".cpp")
               for line, length in functions(text)]
    lengths += [(length, f"{name}:{line}") for name, text in files(".py")
                for line, length in python_functions(text)]
    long_ones = sorted((entry for entry in lengths if entry[0] > USUAL), reverse=True)
    assert not long_ones or long_ones[0][0] <= LONGEST, long_ones
    assert len(long_ones) <= (1 - USUAL_SHARE) * len(lengths), long_ones


def test_function_lengths_are_counted():
    text = """namespace repose {
struct Box {
  int area() const {
    return 1;
  }
};
Box::Box(int a,
         int b)
    : a_(a) {
  for (int i = 0; i < a; ++i) {

    run([&] {
      b();
    });
  }
}

}  // namespace repose
"""
    assert functions(text) == [(3, 3), (7, 10)]


def test_classes_have_few_data_members():
    large = [(members, cls, name) for name, text in sources()
             for cls, members in classes(text) if members > MOST_MEMBERS]
    assert not large, large


def test_data_members_are_counted():
    text = """class Box {
 public:
  int area() const { return area_; }
  static int count(int a_);

 private:
  struct Side {
    double length_, width_;
  };
  Side& side_;
  double low_ = 0, high_ = f(0);
  std::vector<int> of_{3};  // a_;
  std::function<bool(int)> ends_;
};
"""
    assert classes(text) == [("Box", 5), ("Side", 2)]


def test_headers_are_included_once():
    headers = [(name, text) for name, text in files(".h")]
    assert headers
    assert [name for name, text in headers if not text.startswith("#pragma once\n")] == []


def test_no_word_that_does_not_belong():
    faults = [f"{name}:{line} {text_line.strip()[:80]}" for name, text in files(*TEXT)
              for line, text_line in enumerate(text.splitlines(), 1) if WORDS.search(text_line)]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize("text", ["// TO" "DO later", "/ho" "me/me/head.ply", 'open("/tm' 'p/x")'])
def test_a_word_is_seen(text):
    assert WORDS.search(text)


def pages():
    """The Markdown pages by name, without their fenced blocks of code."""
    return {name: re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
            for name, text in files(".md")}


def anchors(text):
    """Returns the anchors of a page's headings, as on GitHub."""
    heads = [re.sub(r"[^\w\- ]", "", head.lower()) for head in re.findall(r"^#+ (.*)", text, re.M)]
    return {head.strip().replace(" ", "-") for head in heads}


def links(name, text):
    """(file, anchor, as written) of each link of a page to something of the project's own."""
    for written in re.findall(r"\]\(([^)\s]+)\)", text):
        if not re.match(r"\w+:", written):
            file, _, anchor = written.partition("#")
            folder = posixpath.dirname(name)
            yield posixpath.normpath(posixpath.join(folder, file)) if file else name, anchor, written


def broken_links(name, text, others):
    """Links of a page that lead nowhere, one message each; `others` are all pages by name."""
    for file, anchor, written in links(name, text):
        if not (PROJECT / file).exists():
            yield f"{name} links to {written}, which is not there"
        elif anchor and anchor not in anchors(others.get(file, "")):
            yield f"{name} links to {written}, but no heading there is called so"


def test_links_lead_somewhere():
    all_pages = pages()
    faults = [fault for name, text in all_pages.items()
              for fault in broken_links(name, text, all_pages)]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize("text", ["[a](no.md)", "![a](docs/images/no.png)", "[a](#no)",
                                  "[a](docs/index.md#no)"])
def test_a_broken_link_is_seen(text):
    assert list(broken_links("README.md", text, {"docs/index.md": "# Yes"}))


def test_every_page_is_reached_from_the_index():
    all_pages = pages()
    reached, ahead = set(), ["docs/index.md"]
    while ahead:
        name = ahead.pop()
        if name in all_pages and name not in reached:
            reached.add(name)
            ahead += [file for file, _, _ in links(name, all_pages[name])]
    assert "docs/index.md" in {file for file, _, _ in links("README.md", all_pages["README.md"])}
    assert not all_pages.keys() - reached - {"README.md"}


def test_files_that_are_named_exist():
    me = "tests/program/test_house.py"  # which makes up names
    faults = [f"{name}: {named}" for name, text in files(*TEXT) if name != me
              for named in sorted(set(NAMED.findall(text))) if not (PROJECT / named).exists()]
    assert not faults, "\n".join(faults)


def test_promises_name_tests_that_exist():
    text = (PROJECT / "docs/develop/promises.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([a-z]+\.[a-z_]+)`", text))
    units = {f"{path.parent.name}.{path.stem.removesuffix('_test')}"
             for path in PROJECT.glob("tests/unit/*/*.cpp")}
    programs = {f"program.{path.stem.removeprefix('test_')}"
                for path in PROJECT.glob("tests/program/test_*.py")}
    other = {"extremes.fast", "extremes.kills", "fuzz.answers", "fuzz.readers"}
    assert len(named) > 20 and named <= units | programs | other, named - units - programs - other
