#pragma once
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "repose/scene/placement.h"
#include "repose/scene/scene.h"

namespace repose::live {

/// Longest line of a request, bytes.
constexpr size_t longest_line = 1 << 20;

enum class Verb { describe, solve, change, write, quit };

/// Motions of pieces by name; those without an entry stay.
using PlanMoves = std::map<std::string, scene::Placement>;

/// A request (docs/guide/live.md) whose members have the right types and ranges. Names of pieces
/// are not checked.
struct Request {
  Verb verb = Verb::quit;
  std::optional<PlanMoves> plan;
  std::optional<double> accuracy;  ///< mm
  bool tangents = false;
  std::vector<std::pair<int64_t, Vec3>> gradient_of;  ///< points of the answer and their weights
  bool from_rest = false;         ///< the search begins at the state before the bones move, …
  std::optional<PlanMoves> base;  ///< … or at this plan, else at the scene's
  bool other_rest = false;        ///< searched for where contact allows several; implies from_rest
  bool summary = false;           ///< the answer has the summary of its face
  bool all_points = false;        ///< the answer has all points, not those of the skin alone
  scene::SceneChanges changes;    ///< in place of those before
  std::string output;             ///< path of the result without ending
};

/// Returns the JSON object on a line. Throws InputError where the line is too long, nests deeper
/// than a request can, or is no object.
nlohmann::json parse_line(const std::string& line);

/// Reads a request from its object by one table of members. Throws InputError, one line, for an
/// unknown verb or member, a missing member, a wrong type or a value out of range.
Request read_request(const nlohmann::json& object);

}  // namespace repose::live
