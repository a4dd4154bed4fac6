#pragma once
#include <functional>

#include "quadric.h"
#include "repose/tools/decimation/decimate.h"
#include "tolerance.h"

namespace repose::tools::decimation {

/// Edge collapse on a manifold surface, open or closed, step by step. A step is taken only where
/// the topology stays (link condition), no triangle turns over or loses its shape, all new
/// triangles are proven to lie within the tolerance, and none meets another triangle of the
/// surface (exact predicates). So the surface is in order after every step.
class Collapser {
 public:
  /// Locked vertices are neither moved nor removed.
  Collapser(const Surface& surface, const std::vector<char>& locked);

  int64_t triangles() const { return alive_; }

  /// Collapses edges, that of the least quadric error first, until `target` triangles are left or
  /// no edge can be collapsed within the tolerance (null: none). `report` is called now and then.
  /// May be called again with a wider tolerance.
  void run(int64_t target, const Tolerance* tolerance, const std::function<void()>& report);

  Surface result() const;

 private:
  struct Candidate {
    double cost;
    int64_t kept, removed;
    uint32_t kept_version, removed_version;
    bool operator<(const Candidate& other) const { return cost > other.cost; }
  };
  struct Vertex {
    bool locked;
    std::vector<int64_t> triangles = {};  ///< around it
    Quadric quadric = {};
    uint32_t version = 0;  ///< of its edges' costs
    uint64_t changed = 1;  ///< the step that last changed its triangles
  };
  /// The triangles around an edge: those that go with it, and those that stay.
  struct Star {
    std::vector<int64_t> dying, staying;
  };

  Candidate candidate(int64_t a, int64_t b) const;
  std::vector<int64_t> neighbors(int64_t vertex) const;
  bool gather(int64_t kept, int64_t removed, Star& star) const;
  bool attempt(const Candidate& candidate);
  std::vector<Vec3> placements(int64_t kept, int64_t removed) const;
  bool fits(const Star& star, int64_t kept, int64_t removed, const Vec3& at, Vec3* outside);
  bool shapes_stay(const Star& star) const;
  bool within(Vec3* outside) const;
  bool meets_another(const Star& star) const;
  Vec3 pulled(int64_t kept, const Vec3& at, const Vec3& outside) const;
  void collapse(const Star& star, int64_t kept, int64_t removed, const Vec3& at);
  int64_t pass(int64_t target, uint64_t since, const std::function<void()>& report);

  Surface surface_;
  const Tolerance* tolerance_ = nullptr;
  TriangleTree tree_;
  std::vector<Vertex> vertices_;
  std::vector<bool> dead_;  ///< [triangles]
  int64_t alive_;
  uint64_t steps_ = 0;
  Vec3 origin_;
  std::vector<Triangle> new_triangles_;  ///< of the step at hand
  std::vector<Corners> new_corners_;
};

}  // namespace repose::tools::decimation
