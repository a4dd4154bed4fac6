#pragma once
#include <string>
#include <vector>

#include "repose/model/motion.h"
#include "repose/tools/check/comparison.h"

namespace repose::tools::check {

/// Returns the elements of a term; null where the model has none.
const model::TermElements* elements_of(const model::Model& model, const std::string& term);

/// Adhesion of one point to the plane at its nearest tooth, found by Model::adhesion and the
/// bones' triangles (docs/reference/formats.md). Nothing is shared with the term of the solver.
struct Film {
  int64_t point;
  int32_t bone;
  Vec3 normal;      ///< unit, out of the tooth, at load 0
  double distance;  ///< mm, of the point from the tooth
  double tension;   ///< N, the largest
};

/// Returns the films of a model in the order of their points.
std::vector<Film> find_films(const model::Model& model);

/// Compares the model's elements of adhesion with the films.
void check_adhesion(const model::Model& model, const std::vector<Film>& films,
                    Comparison& comparison);

/// An energy of the position of one point, and its force.
struct PointForce {
  int64_t point;
  double energy;  ///< N mm
  Vec3 force;     ///< N, on the point
  double noise;   ///< N; times the relative rounding of positions, that of the force
};
/// Evaluates the films at a load and the positions of all points (mm).
std::vector<PointForce> evaluate(const model::Model& model, const std::vector<Film>& films,
                                 const model::PrescribedMotion& motion, double load,
                                 const std::vector<Vec3>& position);

/// Evaluates a model's elastic supports, from their numbers alone, at a load and the positions of
/// all points (mm).
std::vector<PointForce> evaluate_supports(const model::Model& model,
                                          const model::PrescribedMotion& motion, double load,
                                          const std::vector<Vec3>& position);

/// States whether elastic supports hold points of soft tissue where these begin.
void check_supports(const model::Model& model, Comparison& comparison);

}  // namespace repose::tools::check
