#pragma once
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "repose/base/error.h"
#include "repose/surface/surface.h"

/// Small surfaces with known answers, and files in a folder of their own.
namespace repose::surface {

inline Surface tetrahedron() {
  return {"tetrahedron",
          {{0, 0, 0}, {100, 0, 0}, {0, 100, 0}, {0, 0, 100}},
          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

/// An axis-parallel cube from `low` to `low` + `side`, outwards.
inline Surface cube(const Vec3& low = Vec3::Zero(), double side = 100) {
  Surface s{"cube", {}, {}};
  for (int i = 0; i < 8; ++i)
    s.points.push_back(low + side * Vec3(i & 1, (i >> 1) & 1, (i >> 2) & 1));
  s.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                 {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return s;
}

/// An open sheet of n × n squares of 10 mm in z = 0, two triangles each, looking up.
inline Surface patch(int n = 4) {
  Surface s{"patch", {}, {}};
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) s.points.emplace_back(10 * i, 10 * j, 0);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int64_t a = j * (n + 1) + i, b = a + n + 1;
      s.triangles.push_back({a, a + 1, b + 1});
      s.triangles.push_back({a, b + 1, b});
    }
  return s;
}

/// Both surfaces in one, nothing shared.
inline Surface both(Surface a, const Surface& b) {
  const auto shift = static_cast<int64_t>(a.points.size());
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  for (const auto& t : b.triangles)
    a.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  return a;
}

inline void turn(Triangle& triangle) { std::swap(triangle[1], triangle[2]); }

inline double volume(const Surface& s) {
  double six = 0;
  for (const auto& t : s.triangles) six += s.points[t[0]].dot(s.points[t[1]].cross(s.points[t[2]]));
  return six / 6;
}

/// Returns the message of an InputError; empty if none is thrown.
inline std::string refusal(const std::function<void()>& work) {
  try {
    work();
  } catch (const base::InputError& error) {
    return error.what();
  }
  return {};
}

/// A folder that lives as long as the test.
class SurfaceFiles : public ::testing::Test {
 protected:
  SurfaceFiles() {
    std::string name = std::filesystem::temp_directory_path() / "surface_XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~SurfaceFiles() override { std::filesystem::remove_all(folder_); }

  /// Removed first: to overwrite a file can wait for the disk.
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::filesystem::remove(folder_ / name);
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

  std::filesystem::path folder_;
};

/// Triangles of a ball of n × n − 1 points by longitude and latitude, its two poles first.
inline std::vector<Triangle> longitude_latitude(int n) {
  const auto at = [n](int i, int j) -> int64_t { return 2 + (j - 1) * n + i % n; };
  std::vector<Triangle> triangles;
  for (int i = 0; i < n; ++i) {
    triangles.push_back({0, at(i, 1), at(i + 1, 1)});
    triangles.push_back({1, at(i + 1, n - 1), at(i, n - 1)});
    for (int j = 1; j + 1 < n; ++j) {
      triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return triangles;
}

}  // namespace repose::surface
