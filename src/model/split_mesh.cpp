#include "split_mesh.h"

#include <algorithm>

namespace repose::model {

SplitMesh::SplitMesh(surface::Surface& surface)
    : surface_(surface), around_(surface.points.size()) {
  for (size_t row = 0; row < surface.triangles.size(); ++row)
    for (const int64_t v : surface.triangles[row]) around_[v].push_back(static_cast<int64_t>(row));
}

std::vector<int64_t> SplitMesh::triangles_of_edge(int64_t a, int64_t b) const {
  std::vector<int64_t> rows;
  for (const int64_t row : around_[a]) {
    const Triangle& t = triangle(row);
    if (std::find(t.begin(), t.end(), b) != t.end()) rows.push_back(row);
  }
  return rows;
}

bool SplitMesh::on_border(int64_t vertex) const {
  for (const int64_t row : around_[vertex])
    for (const int64_t other : triangle(row))
      if (other != vertex && triangles_of_edge(vertex, other).size() < 2) return true;
  return false;
}

double SplitMesh::edge_length(int64_t row) const {
  const auto& [a, b, c] = triangle(row);
  return ((point(b) - point(a)).norm() + (point(c) - point(b)).norm() +
          (point(a) - point(c)).norm()) /
         3;
}

int64_t SplitMesh::add_vertex(const Vec3& at) {
  surface_.points.push_back(at);
  around_.emplace_back();
  return static_cast<int64_t>(surface_.points.size()) - 1;
}

void SplitMesh::remove(int64_t row) {
  for (const int64_t v : triangle(row)) std::erase(around_[v], row);
}

void SplitMesh::put(int64_t row, const Triangle& corners) {
  if (row < static_cast<int64_t>(surface_.triangles.size()))
    surface_.triangles[row] = corners;
  else
    surface_.triangles.push_back(corners);
  for (const int64_t v : corners) around_[v].push_back(row);
}

int64_t SplitMesh::split_edge(int64_t a, int64_t b, const Vec3& at) {
  const std::vector<int64_t> rows = triangles_of_edge(a, b);
  const int64_t middle = add_vertex(at);
  for (const int64_t row : rows) {
    Triangle near_a = triangle(row), near_b = near_a;
    remove(row);
    std::replace(near_a.begin(), near_a.end(), b, middle);
    std::replace(near_b.begin(), near_b.end(), a, middle);
    put(row, near_a);
    put(static_cast<int64_t>(surface_.triangles.size()), near_b);
  }
  return middle;
}

int64_t SplitMesh::split_triangle(int64_t row, const Vec3& at) {
  const Triangle whole = triangle(row);
  const int64_t middle = add_vertex(at);
  remove(row);
  for (int corner = 0; corner < 3; ++corner) {
    Triangle part = whole;
    part[corner] = middle;
    put(corner == 0 ? row : static_cast<int64_t>(surface_.triangles.size()), part);
  }
  return middle;
}

}  // namespace repose::model
