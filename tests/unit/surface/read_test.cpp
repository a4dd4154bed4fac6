#include "repose/surface/read.h"

#include "formats.h"
#include "repose/surface/defects.h"

namespace repose::surface {
namespace read_test {

using Corners = std::vector<std::array<Vec3, 3>>;

/// Triangles by place, whatever the numbering of points (STL has none).
Corners corners(const Surface& s) {
  Corners all;
  for (const auto& t : s.triangles) all.push_back({s.points[t[0]], s.points[t[1]], s.points[t[2]]});
  return all;
}

class Read : public SurfaceFiles {
 protected:
  /// The one line that refuses these bytes; it must name the file.
  std::string refused(const std::string& name, const std::string& bytes) const {
    const auto file = write(name, bytes);
    const std::string message = refusal([&] { read_surface(file); });
    EXPECT_NE(message.find(name), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }
};

std::string with(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string crlf(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '\n' ? std::string("\r\n") : std::string(1, c);
  return result;
}

TEST_F(Read, every_format_gives_the_same_triangles) {
  for (const Surface& s : {tetrahedron(), cube(), patch()})
    for (const auto& [what, ending, bytes] : every_format(s)) {
      const Surface read = read_surface(write("mesh" + ending, bytes));
      EXPECT_EQ(corners(read), corners(s)) << s.name << " as " << what;
      EXPECT_EQ(read.points.size(), s.points.size()) << what;
      EXPECT_EQ(read.name, (folder_ / ("mesh" + ending)).string());
    }
}

TEST_F(Read, content_decides_when_the_ending_is_wrong_or_upper_case) {
  for (const auto& [what, right, bytes] : every_format(cube()))
    for (const std::string ending : {".STL", ".Ply", ".obj", ".OFF", ".dat", ""})
      EXPECT_EQ(corners(read_surface(write("mesh" + ending, bytes))), corners(cube()))
          << what << " called " << ending;
}

TEST_F(Read, windows_and_old_mac_line_ends) {
  for (const auto& [what, ending, bytes] : every_format(patch())) {
    if (bytes.find('\0') != std::string::npos) continue;
    std::string mac = bytes;
    std::replace(mac.begin(), mac.end(), '\n', '\r');
    EXPECT_EQ(corners(read_surface(write("w" + ending, crlf(bytes)))), corners(patch())) << what;
    EXPECT_EQ(corners(read_surface(write("m" + ending, mac))), corners(patch())) << what;
  }
  const std::string binary = ply_binary(cube(), false);
  const size_t body = binary.find("end_header\n") + 11;
  const std::string mixed = crlf(binary.substr(0, body)) + binary.substr(body);
  EXPECT_EQ(corners(read_surface(write("w.ply", mixed))), corners(cube()));
}

TEST_F(Read, ply_with_comments_first_other_types_and_more_elements) {
  const std::string text =
      "ply\ncomment first\nformat ascii 1.0\nelement junk 2\nproperty list int int source\n"
      "property float u\nelement vertex 3\nproperty uchar red\nproperty float64 z\n"
      "property double y\nproperty float32 x\nelement nothing 99999999999\nelement face 1\n"
      "property float green\nproperty list uint8 uint32 vertex_index\nend_header\n"
      "2 5 6 0.5\n0 1\n255 3 2 1\n0 30 2 1\n0 3 20 1\n0.5 3 0 1 2\n";
  const Surface read = read_surface(write("mesh.ply", text));
  const Corners requested = {{Vec3(1, 2, 3), Vec3(1, 2, 30), Vec3(1, 20, 3)}};
  EXPECT_EQ(corners(read), requested);
}

TEST_F(Read, rows_of_nothing_are_not_walked) {
  const std::string endless = "element nothing 9000000000000000000\nelement vertex";
  const std::string painted = with(ply_text(cube()), "element vertex", endless);
  EXPECT_EQ(read_vertex_values(write("painted.ply", painted)).points.size(), 8u);
}

TEST_F(Read, polygons_become_triangles_of_the_same_area) {
  const std::string points = "v 0 0 0\nv 20 0 0\nv 20 20 0\nv 10 1 0\nv 0 20 0\n";
  for (const char* face :
       {"f 1 2 3 4 5\n", "f 2 3 4 5 1\n", "f 3 4 5 1 2\n", "f 4 5 1 2 3\n", "f 5 1 2 3 4\n"}) {
    const Surface arrow = read_surface(write("arrow.obj", points + face));
    ASSERT_EQ(arrow.triangles.size(), 3u);
    double area = 0;
    for (const auto& [a, b, c] : corners(arrow)) {
      const double twice = (b - a).cross(c - a).z();
      EXPECT_GT(twice, 0) << face;
      area += twice / 2;
    }
    EXPECT_NEAR(area, 400 - 0.5 * 20 * 19, 1e-12);
  }
  EXPECT_EQ(
      read_surface(write("square.obj", points + "f -5\t-4 -3 -1 # all\nl 1 2\n")).triangles.size(),
      2u);
}

TEST_F(Read, lines_of_an_obj_go_on_behind_a_backslash) {
  const std::string points = "v 0 0 0\nv 20 0 \\\n0\nv 20 20 0\n# no end \\\nv 0 20 0\n";
  EXPECT_EQ(read_surface(write("square.obj", points + "f 1 2\\\r\n 3 4\n")).triangles.size(), 2u);
  EXPECT_NE(refused("part.obj", points + "f 1 2 3\\\n").find("part.obj: truncated"),
            std::string::npos);
}

TEST_F(Read, stl_in_capitals_with_keywords_as_name) {
  std::string text = with(stl_text(cube()), "solid by hand", "solid facet solid");
  for (char& c : text) c = static_cast<char>(std::toupper(c));
  EXPECT_EQ(corners(read_surface(write("mesh.stl", text))), corners(cube()));
}

TEST_F(Read, files_that_are_no_surface) {
  EXPECT_NE(refused("empty.ply", "").find("empty"), std::string::npos);
  EXPECT_NE(refused("text.stl", "what a nice day").find("STL"), std::string::npos);
  EXPECT_NE(refused("picture.png", "\x89PNG\r\n").find("none of PLY"), std::string::npos);
  const std::string missing = refusal([&] { read_surface(folder_ / "none.ply"); });
  EXPECT_NE(missing.find("none.ply: no such file"), std::string::npos) << missing;
  EXPECT_NE(refusal([&] { read_surface(folder_); }).find("not a file"), std::string::npos);
  Surface bare = cube();
  bare.triangles.clear();
  for (const auto& [what, ending, bytes] : every_format(bare))
    EXPECT_NE(refused("bare" + ending, bytes), "") << what;
  EXPECT_NE(refused("bare.ply", ply_text(bare)).find("no faces"), std::string::npos);
}

TEST_F(Read, numbers_that_are_none_or_not_finite) {
  Surface bad = cube();
  bad.points[5].y() = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [what, ending, bytes] : every_format(bad))
    EXPECT_NE(refused("nan" + ending, bytes), "") << what;
  EXPECT_NE(refused("nan.ply", ply_binary(bad, false)).find("vertex 5"), std::string::npos);
  EXPECT_NE(refused("nan.ply", ply_text(bad)).find("nan.ply:16: "), std::string::npos);
  EXPECT_NE(refused("nan.off", off_text(bad)).find("nan.off:10: 'nan'"), std::string::npos);
  EXPECT_NE(refused("nan.obj", obj_text(bad)).find("nan.obj:8: "), std::string::npos);
  EXPECT_NE(refused("nan.stl", stl_text(bad)).find("nan.stl:"), std::string::npos);
  EXPECT_NE(refused("word.obj", "v 0 0 1x\n").find("word.obj:1: '1x'"), std::string::npos);
  EXPECT_NE(refused("two.stl", "solid\nfacet\nvertex 0 1\n").find("two.stl:3: three"),
            std::string::npos);
  EXPECT_NE(refused("short.stl", "solid\nfacet\nvertex 0 1 1\n").find("no endsolid"),
            std::string::npos);
  bad.points[5].y() = 1e13;
  for (const auto& [what, ending, bytes] : every_format(bad))
    EXPECT_NE(refused("far" + ending, bytes).find("finite and within"), std::string::npos) << what;
}

TEST_F(Read, indices_out_of_range) {
  for (const int64_t index : {8, -1, 2000000000}) {
    Surface bad = cube();
    bad.triangles[7][1] = index;
    for (const auto& bytes : {ply_text(bad), ply_binary(bad, true)})
      EXPECT_NE(refused("bad.ply", bytes).find(fmt::format("face 7 names vertex {}", index)),
                std::string::npos);
    EXPECT_NE(refused("bad.off", off_text(bad)).find("face 7"), std::string::npos);
    EXPECT_NE(refused("bad.off", off_binary(bad)).find("face 7"), std::string::npos);
  }
  Surface beyond = cube();
  beyond.triangles[7][1] = 2000000000;
  EXPECT_NE(refused("bad.ply", with(ply_text(beyond), "2000000000", "1e308"))
                .find("7 of 12 holds no number"),
            std::string::npos);
  for (const std::string face : {"f 1 2 9", "f 1 2 0", "f 1 2 -9", "f 1 2 99999999999"})
    EXPECT_NE(refused("bad.obj", obj_text(cube()) + face + "\n"), "") << face;
  EXPECT_NE(refused("two.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n").find("face 0 has 2 corners"),
            std::string::npos);
}

TEST_F(Read, headers_that_promise_more_than_the_file_holds) {
  for (const std::string count : {"9", "4000000000", "9000000000000000000"}) {
    for (const auto& bytes : {ply_text(cube()), ply_binary(cube(), false)})
      for (const std::string element : {"vertex 8", "face 12"}) {
        const std::string longer = element.substr(0, element.find(' ') + 1) + count + "9";
        EXPECT_NE(refused("long.ply", with(bytes, element, longer)), "") << longer;
      }
    EXPECT_NE(refused("long.off", with(off_text(cube()), "8 12 0", count + " 12 0")), "");
    EXPECT_NE(refused("long.off", with(off_text(cube()), "8 12 0", "8 " + count + "9 0")), "");
  }
  const std::string rows = with(ply_text(cube()), "vertex 8", "vertex 4000000000");
  EXPECT_NE(refused("long.ply", rows).find("promises 4000000000 rows"), std::string::npos);
  std::string list = with(ply_binary(tetrahedron(), false), "list uchar int", "list uint int");
  list.resize(list.size() - 4 * 13);
  const std::string huge = list + bytes_of(uint32_t{4000000000}) + std::string(48, '\0');
  EXPECT_NE(refused("list.ply", huge).find("face' 0 of 4"), std::string::npos);
  list = with(ply_text(cube()), "list uchar int", "list uint int");
  EXPECT_NE(refused("list.ply", with(list, "3 0 2 3", "4000000000 0 2 3")), "");
  std::string stl = stl_binary(cube());
  stl.replace(80, 4, "\xff\xff\xff\xff");
  EXPECT_NE(refused("long.stl", stl).find("4294967295 triangles"), std::string::npos);
  std::string off = off_binary(cube());
  EXPECT_NE(refused("long.off", off.replace(11, 4, "\x7f\xff\xff\xff")), "");
}

TEST_F(Read, ply_types_that_cannot_be_used) {
  const std::string text = ply_text(cube());
  EXPECT_NE(refused("a.ply", with(text, "float y", "int y")).find("property y is int"),
            std::string::npos);
  EXPECT_NE(refused("a.ply", with(text, "float y", "float w")).find("no property y"),
            std::string::npos);
  EXPECT_NE(refused("a.ply", with(text, "float y", "quad y")).find("a.ply:6: unknown type 'quad'"),
            std::string::npos);
  EXPECT_NE(refused("a.ply", with(text, "list uchar int", "list uchar float")), "");
  EXPECT_NE(refused("a.ply", with(text, "list uchar int vertex_indices", "int vertex_indices")),
            "");
  EXPECT_NE(refused("a.ply", with(text, "format ascii", "format utf8")), "");
  EXPECT_NE(refused("a.ply", with(text, "vertex_indices", "strips")), "");
}

TEST_F(Read, truncation_is_refused_or_harmless_at_every_length) {
  for (const auto& [what, ending, bytes] : every_format(tetrahedron()))
    for (size_t length = 0; length < bytes.size(); ++length) {
      const auto file = write("cut" + ending, bytes.substr(0, length));
      Surface read;
      const std::string message = refusal([&] { read = read_surface(file); });
      const bool binary = bytes.find('\0') != std::string::npos;
      EXPECT_TRUE(!binary || !message.empty()) << what << " cut to " << length;
      EXPECT_LE(read.triangles.size(), 4u) << what << " cut to " << length;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
}

TEST_F(Read, flipped_bytes_never_crash) {
  uint32_t random = 1;
  const auto next = [&] { return (random = 1664525 * random + 1013904223) >> 8; };
  for (const auto& [what, ending, bytes] : every_format(tetrahedron()))
    for (int round = 0; round < 400; ++round) {
      std::string damaged = bytes;
      for (unsigned flips = 1 + next() % 3; flips > 0; --flips)
        damaged[next() % damaged.size()] = static_cast<char>(next());
      const auto file = write("hurt" + ending, damaged);
      const std::string message = refusal([&] { inspect(weld_and_orient(read_surface(file))); });
      EXPECT_EQ(message.find('\n'), std::string::npos) << what << ": " << message;
    }
}

TEST_F(Read, written_ply_reads_back_exactly) {
  Surface s = cube(Vec3(1e6 / 3, -0.1, 1e-3));
  const auto file = folder_ / "out.ply";
  write_ply(file, s);
  const Surface read = read_surface(file);
  EXPECT_EQ(read.points, s.points);
  EXPECT_EQ(read.triangles, s.triangles);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out.ply.part"));
}

TEST_F(Read, writing_into_a_missing_folder_is_refused) {
  const auto file = folder_ / "none" / "out.ply";
  const std::string message = refusal([&] { write_ply(file, cube()); });
  EXPECT_NE(message.find("out.ply: cannot be written"), std::string::npos) << message;
}

}  // namespace read_test
}  // namespace repose::surface
