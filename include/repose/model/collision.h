#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

/// Bones that touch on their way.
namespace repose::model {

/// Two bones that move differently. Positions and distances in mm.
struct BonePair {
  int32_t a, b;            ///< rows of the scene's bones
  double gap;              ///< between them before all moves, −depth where they overlap
  double ignored = 0;      ///< mm² of their surfaces that touch from the start and are left out
  double load = 2;         ///< of first contact, 0 … 1; greater: none
  Vec3 at = Vec3::Zero();  ///< where, at that load
  int64_t crossings = 0;   ///< pairs of triangles that intersect at the end of the moves
  double depth = 0;        ///< how deep the deepest vertex of one is inside the other there
  bool contact() const { return load <= 1; }
};

struct CollisionReport {
  std::vector<BonePair> pairs;
  double safe_load = 1;  ///< all bones can move so far together without a contact
};

/// Returns whether two bones keep their places towards each other, to rounding.
bool move_alike(const scene::RigidMotion& a, const scene::RigidMotion& b);

/// Follows the moves, screw motions from load 0 to 1, of all pairs of bones that move differently
/// by conservative advancement, so that no contact on the way is missed. A contact is two triangles
/// within clearance + tolerance of each other; it is found before they are within the clearance.
/// Triangles of both bones that lie within clearance + 2 tolerance of the other bone at the start
/// (there split to 1 mm, more in a large bone) are not counted against each other. `bones` and
/// `moves` in the order of the scene.
CollisionReport follow_moves(const std::vector<surface::Surface>& bones,
                             const std::vector<scene::RigidMotion>& moves,
                             const scene::Collision& requested);

/// Resolves contacts as the scene requests: shortens moves, and adds a remark on each pair. Adds
/// warnings of bones that lie more than 2 mm inside one another before all moves. Returns warnings
/// of the moves: that they are shortened, or as describe_overlaps_at_end(). Throws InputError
/// naming the scene and the first contact in mode stop.
std::vector<std::string> resolve_collisions(const std::vector<surface::Surface>& bones,
                                            scene::Scene& scene, std::vector<std::string>& remarks,
                                            std::vector<std::string>& warnings);

/// Returns a warning of each pair of bones that move differently and end more than 1 mm inside one
/// another.
std::vector<std::string> describe_overlaps_at_end(const std::vector<surface::Surface>& bones,
                                                  const scene::Scene& scene);

/// One line a pair, for a person.
std::vector<std::string> describe(const CollisionReport& report, const scene::Scene& scene,
                                  const scene::Collision& requested);

}  // namespace repose::model
