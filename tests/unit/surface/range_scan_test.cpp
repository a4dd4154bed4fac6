#include "repose/tools/range_scan/range_scan.h"

#include <fmt/format.h>

#include "repose/surface/defects.h"
#include "shapes.h"

namespace repose::tools::range_scan {
using namespace surface;
namespace range_scan_test {

/// A text range grid of a relief z(x, y), 1 mm apart; nothing where `hole` says so.
struct Relief {
  int columns = 9, rows = 7;
  std::function<double(int, int)> height = [](int, int) { return 0; };
  std::function<bool(int, int)> hole = [](int, int) { return false; };
  bool colors = false;

  std::string text() const {
    std::string vertices, cells;
    int points = 0;
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i) {
        if (hole(i, j)) {
          cells += "0\n";
          continue;
        }
        vertices += fmt::format("{} {} {}", i, j, height(i, j));
        if (colors) vertices += fmt::format(" {} {} 7 0.5", 10 * i, 10 * j);
        vertices += "\n";
        cells += fmt::format("1 {}\n", points++);
      }
    return fmt::format(
               "ply\nformat ascii 1.0\nobj_info is_mesh 0\nobj_info num_cols {}\n"
               "obj_info num_rows {}\nelement vertex {}\nproperty float x\nproperty float y\n"
               "property float z\n{}element range_grid {}\n"
               "property list uchar int vertex_indices\nend_header\n",
               columns, rows, points,
               colors ? "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                        "property float confidence\n"
                      : "",
               columns * rows) +
           vertices + cells;
  }
};

class RangeScan : public SurfaceFiles {
 protected:
  ScanMesh mesh(const Relief& relief, const ScanOptions& options = {}) {
    return mesh_of(read_range_grid(write("range.ply", relief.text())), options);
  }
};

TEST_F(RangeScan, a_full_grid_faces_the_scanner) {
  const ScanMesh flat = mesh({});
  EXPECT_EQ(flat.surface.triangles.size(), 2u * 8 * 6);
  for (const auto& [a, b, c] : flat.surface.triangles) {
    const auto& p = flat.surface.points;
    EXPECT_GT((p[b] - p[a]).cross(p[c] - p[a]).z(), 0);
  }
  EXPECT_EQ(flat.longest_edge, 4);
  EXPECT_EQ(flat.cut_long + flat.cut_steep + flat.split + flat.unused, 0);
  EXPECT_TRUE(hole_lengths(flat.surface).empty());
}

TEST_F(RangeScan, a_step_in_depth_is_cut_by_length_or_by_slope) {
  Relief step;
  step.height = [](int i, int) { return i > 4 ? 6 : 0; };
  const ScanMesh by_length = mesh(step);
  EXPECT_EQ(by_length.cut_long, 2 * 6);
  EXPECT_EQ(by_length.cut_steep, 0);
  EXPECT_EQ(inspect(by_length.surface).components, 2);
  ScanOptions wide;
  wide.longest_edge = 10;
  EXPECT_EQ(mesh(step, wide).cut_steep, 2 * 6) << "80.5 degrees";
  wide.steepest = 81;
  EXPECT_EQ(inspect(mesh(step, wide).surface).components, 1);
}

TEST_F(RangeScan, holes_are_counted_with_their_length) {
  Relief holed;
  holed.hole = [](int i, int j) { return (i == 2 && j == 3) || (i == 5 && (j == 2 || j == 3)); };
  const auto holes = hole_lengths(mesh(holed).surface);
  ASSERT_EQ(holes.size(), 2u);
  EXPECT_NEAR(holes[0], 4 * std::sqrt(2) + 2, 1e-6);
  EXPECT_NEAR(holes[1], 4 * std::sqrt(2), 1e-6);
}

TEST_F(RangeScan, sheets_that_meet_in_a_point_are_parted) {
  Relief cross;
  cross.hole = [](int i, int j) {
    const bool below = i <= 4 && j <= 3, above = i >= 4 && j >= 3;  // both hold (4, 3)
    return (!below && !above) || (i == 4 && j != 3);
  };
  const ScanMesh parted = mesh(cross);
  const Defects defects = inspect(parted.surface);
  EXPECT_EQ(defects.non_manifold_vertices, 0);
  EXPECT_EQ(defects.components, parted.split + 1);
  EXPECT_EQ(parted.split, 1);
  ScanOptions largest;
  largest.largest = true;
  EXPECT_EQ(inspect(mesh(cross, largest).surface).components, 1);
  EXPECT_EQ(mesh(cross, largest).surface.triangles.size() + mesh(cross, largest).dropped,
            parted.surface.triangles.size());
}

TEST_F(RangeScan, colors_and_other_numbers_are_kept) {
  Relief colored;
  colored.colors = true;
  colored.hole = [](int i, int j) { return i < 2 && j < 2; };
  const ScanMesh kept = mesh(colored);
  ASSERT_EQ(kept.data.colors.size(), kept.surface.points.size());
  for (size_t i = 0; i < kept.surface.points.size(); ++i) {
    const Vec3& p = kept.surface.points[i];
    EXPECT_EQ(kept.data.colors[i][0], 10 * p.x());
    EXPECT_EQ(kept.data.colors[i][1], 10 * p.y());
    EXPECT_EQ(kept.data.colors[i][2], 7);
  }
  ASSERT_EQ(kept.data.fields.size(), 1u);
  EXPECT_EQ(kept.data.fields[0].name, "confidence");
  EXPECT_EQ(kept.data.fields[0].values.front(), 0.5);
}

TEST_F(RangeScan, a_cylinder_closes_to_a_ring_and_faces_outward) {
  std::string vertices, cells;
  const int columns = 24, rows = 5;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const double angle = 2 * M_PI * i / columns;
      vertices += fmt::format("{} {} {}\n", 80 * std::sin(angle), 20 * j, 80 * std::cos(angle));
      cells += fmt::format("1 {}\n", columns * j + i);
    }
  Relief frame;
  frame.columns = columns;
  frame.rows = rows;
  const std::string text = frame.text();
  const auto file = write(
      "ring.ply", text.substr(0, text.find("end_header")) + "end_header\n" + vertices + cells);
  ScanOptions options;
  options.cylinder = true;
  const Surface ring = mesh_of(read_range_grid(file), options).surface;
  EXPECT_EQ(ring.triangles.size(), 2u * columns * (rows - 1));
  EXPECT_EQ(inspect(ring).border_loops, 2);
  for (const auto& [a, b, c] : ring.triangles) {
    const auto& p = ring.points;
    Vec3 out = p[a] + p[b] + p[c];
    out.y() = 0;
    EXPECT_GT((p[b] - p[a]).cross(p[c] - p[a]).dot(out), 0);
  }
}

TEST_F(RangeScan, what_is_no_range_grid_is_refused) {
  const std::string good = Relief().text();
  const auto refused = [&](const std::string& text) {
    return refusal([&] { mesh_of(read_range_grid(write("bad.ply", text)), {}); });
  };
  const auto with = [&](const std::string& old, const std::string& other) {
    std::string text = good;
    return refused(text.replace(text.find(old), old.size(), other));
  };
  const auto says = [](const std::string& message, const std::string& words) {
    EXPECT_NE(message.find(words), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  };
  says(refused(good.substr(0, good.size() - 30)), "truncated or damaged: 'range_grid'");
  says(with("obj_info num_cols 9\n", ""), "no obj_info num_cols");
  says(with("num_rows 7", "num_rows 8"), "63 cells, but 9 columns × 8 rows");
  says(with("num_rows 7", "num_rows -7"), "obj_info num_rows is '-7'");
  says(with("1 62\n", "1 63\n"), "names point 63, but there are 63");
  says(with("range_grid", "other_grid"), "it has no element range_grid");
  says(with("property float x", "property float u"), "lack x, y or z");
  says(with("0 0 0\n", "0 nan 0\n"), "'vertex' 0 of 63");
  says(refused("no ply\n"), "not a PLY file");
  Relief empty;
  empty.hole = [](int i, int j) { return (i + j) % 2 == 0; };
  says(refused(empty.text()), "no two neighboring cells hold points");
}

}  // namespace range_scan_test
}  // namespace repose::tools::range_scan
