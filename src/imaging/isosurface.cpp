#include "repose/imaging/isosurface.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "cube_cases.h"
#include "repose/base/error.h"
#include "repose/imaging/volume_filter.h"
#include "repose/surface/component.h"

namespace repose::imaging {
using namespace surface;
namespace {

constexpr double nearest_to_end = 1e-3;  // of an edge; keeps triangles from being flat

/// One slice of grid points with a margin of one around it where the border is closed, and the
/// vertices on its edges; entries of edges that are not crossed are never read.
struct Slice {
  std::vector<float> values;
  std::vector<uint8_t> inside;
  std::array<std::vector<int64_t>, 3> vertex;  ///< along x, y and to the next slice
};

/// Walks the volume slice by slice, with the lower and upper slice of one layer of cubes at hand.
class Marching {
 public:
  Marching(const Volume& volume, double level, VolumeBorder border)
      : volume_(volume),
        level_(level),
        margin_(border == VolumeBorder::closed ? 1 : 0),
        columns_(volume.size[0] + 2 * margin_),
        rows_(volume.size[1] + 2 * margin_),
        left_handed_(volume.axes.determinant() < 0) {
    for (int i = 0; i < 16; ++i)
      for (int bit = 0; bit < 4; ++bit) spread_[i] |= (i >> bit & 1) << (2 * bit);
    for (Slice* slice : {&lower_, &upper_}) {
      slice->values.assign(columns_ * rows_, beyond_volume);
      slice->inside.assign(columns_ * rows_, 0);
      for (auto& vertices : slice->vertex) vertices.resize(columns_ * rows_);
    }
    codes_.resize(columns_);
  }

  Surface run(const Watch& watch) {
    const int64_t last = volume_.size[2] - 1 + margin_;
    fill(upper_, -margin_);
    for (int64_t k = 1 - margin_; k <= last; ++k) {
      std::swap(lower_, upper_);
      fill(upper_, k);
      cross_layer(k - 1);
      for (int64_t j = 0; j + 1 < rows_; ++j) march_row(j);
      if (watch) watch(static_cast<double>(k) / static_cast<double>(last));
    }
    return std::move(surface_);
  }

 private:
  int64_t at(int64_t column, int64_t row) const { return row * columns_ + column; }

  /// Values, inside or not, and vertices within slice k; beyond the volume all is outside.
  void fill(Slice& slice, int64_t k) {
    if (k < 0 || k >= volume_.size[2]) {
      std::fill(slice.values.begin(), slice.values.end(), beyond_volume);
      std::fill(slice.inside.begin(), slice.inside.end(), uint8_t{0});
      return;
    }
    for (int64_t j = 0; j < volume_.size[1]; ++j) {
      const float* source = &volume_.values[volume_.index(0, j, k)];
      float* target = &slice.values[at(margin_, j + margin_)];
      uint8_t* inside = &slice.inside[at(margin_, j + margin_)];
      for (int64_t i = 0; i < volume_.size[0]; ++i) {
        target[i] = source[i];
        inside[i] = source[i] >= level_;
      }
    }
    for (int64_t row = 0; row < rows_; ++row) cross_row(slice, row, k);
  }

  void cross_row(Slice& slice, int64_t row, int64_t k) {
    const uint8_t* inside = &slice.inside[at(0, row)];
    for (int64_t i = 0; i + 1 < columns_; ++i)
      if (inside[i] != inside[i + 1])
        slice.vertex[0][at(i, row)] =
            add(slice.values[at(i, row)], slice.values[at(i + 1, row)], 0, {i, row, k});
    if (row + 1 == rows_) return;
    for (int64_t i = 0; i < columns_; ++i)
      if (inside[i] != inside[i + columns_])
        slice.vertex[1][at(i, row)] =
            add(slice.values[at(i, row)], slice.values[at(i, row + 1)], 1, {i, row, k});
  }

  /// Vertices between the slices k and k + 1.
  void cross_layer(int64_t k) {
    for (int64_t row = 0; row < rows_; ++row)
      for (int64_t i = 0; i < columns_; ++i) {
        const int64_t here = at(i, row);
        if (lower_.inside[here] != upper_.inside[here])
          lower_.vertex[2][here] = add(lower_.values[here], upper_.values[here], 2, {i, row, k});
      }
  }

  /// A vertex on the edge along `axis` from a grid point (column, row, slice), margin included,
  /// between values.
  int64_t add(double low, double high, int axis, const std::array<int64_t, 3>& from) {
    double share = (level_ - low) / (high - low);
    if (std::isinf(low)) share = 1;
    if (std::isinf(high)) share = 0;
    Vec3 index(static_cast<double>(from[0] - margin_), static_cast<double>(from[1] - margin_),
               static_cast<double>(from[2]));
    index[axis] += std::clamp(share, nearest_to_end, 1 - nearest_to_end);
    surface_.points.push_back(volume_.origin + volume_.axes * index);
    return std::ssize(surface_.points) - 1;
  }

  /// The cubes between rows j and j + 1 of the two slices.
  void march_row(int64_t j) {
    const uint8_t *a = &lower_.inside[at(0, j)], *b = a + columns_;
    const uint8_t *c = &upper_.inside[at(0, j)], *d = c + columns_;
    uint8_t any = 0, all = 15;
    for (int64_t i = 0; i < columns_; ++i) {
      codes_[i] = static_cast<uint8_t>(a[i] | b[i] << 1 | c[i] << 2 | d[i] << 3);
      any |= codes_[i];
      all &= codes_[i];
    }
    if (any == 0 || all == 15) return;
    for (int64_t i = 0; i + 1 < columns_; ++i) {
      const int corners = spread_[codes_[i]] | spread_[codes_[i + 1]] << 1;
      if (corners == 0 || corners == 255) continue;
      if (margin_ == 0 && reaches_beyond(i, j)) continue;
      add_triangles(cases_[corners], i, j);
    }
  }

  /// Returns whether a corner of the cube counts as beyond the volume.
  bool reaches_beyond(int64_t i, int64_t j) const {
    for (const Slice* slice : {&lower_, &upper_})
      for (const int64_t row : {j, j + 1})
        for (const int64_t column : {i, i + 1})
          if (slice->values[at(column, row)] == beyond_volume) return true;
    return false;
  }

  void add_triangles(const CubeTriangles& triangles, int64_t i, int64_t j) {
    for (const auto& edges : triangles) {
      Triangle triangle;
      for (int corner = 0; corner < 3; ++corner) triangle[corner] = vertex(edges[corner], i, j);
      if (left_handed_) std::swap(triangle[1], triangle[2]);
      surface_.triangles.push_back(triangle);
    }
  }

  int64_t vertex(int edge, int64_t i, int64_t j) const {
    const int corner = edge_corners(edge)[0];
    const Slice& slice = corner >> 2 & 1 ? upper_ : lower_;
    return slice.vertex[edge / 4][at(i + (corner & 1), j + (corner >> 1 & 1))];
  }

  const Volume& volume_;
  const double level_;
  const int64_t margin_, columns_, rows_;
  const bool left_handed_;
  const std::array<CubeTriangles, 256>& cases_ = cube_cases();
  std::array<int, 16> spread_{};
  std::vector<uint8_t> codes_;
  Slice lower_, upper_;
  Surface surface_;
};

}  // namespace

Surface isosurface(const Volume& volume, double level, VolumeBorder border, const Watch& watch) {
  const auto [minimum, greatest] = value_range(volume);
  if (!(level > minimum && level <= greatest))
    base::refuse("{}: no surface at level {:g}; choose one in between: {}", volume.name, level,
                 describe_values(volume));
  Surface surface = Marching(volume, level, border).run(watch);
  if (std::find(volume.values.begin(), volume.values.end(), beyond_volume) != volume.values.end())
    surface = compact("", surface.points, std::move(surface.triangles));  // some in no triangle
  surface.name = volume.name;
  return surface;
}

}  // namespace repose::imaging
