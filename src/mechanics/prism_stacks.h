#pragma once
#include "repose/mechanics/nodal_volumes.h"
#include "repose/mechanics/prism_volume.h"

/// Volumes of the prisms of two stacks at a time, in the two halves of a register. A triangle is
/// gathered once for the prism above it and the one below it, and so are forces scattered.
namespace repose::mechanics {

/// A triangle between two prisms, by one corner and the edges from it.
struct Face {
  Triple<Pair> corner, edge1, edge2;
};

/// Forces on a triangle's edges and on the triangle as a whole.
struct FaceForce {
  Triple<Pair> edge1{}, edge2{}, whole{};
  void add(const FaceForce& o) {
    edge1 = edge1 + o.edge1, edge2 = edge2 + o.edge2, whole = whole + o.whole;
  }
};

/// Its sides: A1×A2, and how that changes when the edges do.
inline Triple<Pair> normal(const Face& f) { return f.edge1.cross(f.edge2); }
inline Triple<Pair> normal_change(const Face& f, const Face& move) {
  return move.edge1.cross(f.edge2) + f.edge1.cross(move.edge2);
}

/// The prism between triangles a and b (prism_volume.h), whose volume is
///     36 v = d · (A1×A2 + B1×B2 + S1×S2),   S = A + B.
struct StackedPrism {
  Triple<Pair> d;             ///< 3 D
  Triple<Pair> side1, side2;  ///< S1 S2
  StackedPrism(const Face& a, const Face& b)
      : d(3.0 * (b.corner - a.corner) + (b.edge1 - a.edge1) + (b.edge2 - a.edge2)),
        side1(a.edge1 + b.edge1),
        side2(a.edge2 + b.edge2) {}
};

/// Stacks s and s + 1 of some, or the last one twice.
class TwoStacks {
 public:
  TwoStacks(const NodalVolumes& nodal, const PrismStacks& of, int64_t s)
      : count_(s + 1 < of.count ? 2 : 1),
        prism_{of.first_prism + s * of.prisms, of.first_prism + (s + count_ - 1) * of.prisms} {
    const int32_t* const first = nodal.points.data() + of.first_point;
    const int64_t size = 3 * (of.prisms + 1);
    point_ = {first + s * size, first + (s + count_ - 1) * size};
  }
  /// Values of prism k of each, from the top.
  Pair of_prism(std::span<const double> values, int64_t k) const {
    return Pair{values[prism_[0] + k], values[prism_[1] + k]};
  }
  void set_prism(int64_t k, Pair value, std::span<double> values) const {
    for (int i = 0; i < 2; ++i) values[prism_[i] + k] = value[i];
  }
  Face face(std::span<const Vec3> values, int64_t k) const {
    const Triple<Pair> corner = at(values, 3 * k);
    return {corner, at(values, 3 * k + 1) - corner, at(values, 3 * k + 2) - corner};
  }
  /// Σ over the corners of triangle k.
  Pair sum_over_face(std::span<const double> values, int64_t k) const {
    const int32_t *p = point_[0] + 3 * k, *q = point_[1] + 3 * k;
    return Pair{values[p[0]] + values[p[1]] + values[p[2]],
                values[q[0]] + values[q[1]] + values[q[2]]};
  }
  void add_to_face(int64_t k, Pair value, std::span<double> sums) const {
    const int32_t* p = point_[0] + 3 * k;
    for (int c = 0; c < 3; ++c) sums[p[c]] += value[0];
    if (count_ == 1) return;
    p = point_[1] + 3 * k;
    for (int c = 0; c < 3; ++c) sums[p[c]] += value[1];
  }
  void add_to_face(int64_t k, const FaceForce& force, std::span<Vec3> sums) const {
    add(3 * k, force.whole - force.edge1 - force.edge2, sums);
    add(3 * k + 1, force.whole + force.edge1, sums);
    add(3 * k + 2, force.whole + force.edge2, sums);
  }

  double sum(Pair values) const { return count_ == 2 ? values[0] + values[1] : values[0]; }

 private:
  Triple<Pair> at(std::span<const Vec3> values, int64_t c) const {
    const Vec3 &a = values[point_[0][c]], &b = values[point_[1][c]];
    return {Pair{a.x(), b.x()}, Pair{a.y(), b.y()}, Pair{a.z(), b.z()}};
  }
  void add(int64_t c, const Triple<Pair>& force, std::span<Vec3> sums) const {
    add_halves(Pair{force.x[0], force.y[0]}, force.z[0], sums[point_[0][c]]);
    if (count_ == 1) return;
    add_halves(Pair{force.x[1], force.y[1]}, force.z[1], sums[point_[1][c]]);
  }

  int count_;
  std::array<int64_t, 2> prism_;
  std::array<const int32_t*, 2> point_;
};

/// Calls visit(two stacks, prisms in each) for all stacks.
template <class Visit>
void for_each_two_stacks(const NodalVolumes& nodal, Visit&& visit) {
  for (const PrismStacks& of : nodal.stacks)
    for (int64_t s = 0; s < of.count; s += 2) visit(TwoStacks(nodal, of, s), of.prisms);
}

}  // namespace repose::mechanics
