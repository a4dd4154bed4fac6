#include "repose/model/stiffness.h"

#include <algorithm>

#include "repose/base/error.h"
#include "repose/model/build.h"

namespace repose::model {
namespace {

constexpr double default_stiffness = 1.0, default_reference = 1.0;  // N/mm, mm
constexpr int springs_of_prism = 15;

/// The rule that holds for a set once everything less specific is filled in.
struct FullRule {
  std::optional<double> modulus;
  double stiffness = default_stiffness;
  scene::Law law = scene::Law::quartic;
  double reference = default_reference;

  void refine(const scene::SpringRule& rule) {
    if (rule.stiffness) {
      stiffness = *rule.stiffness;
      modulus.reset();
    }
    if (rule.modulus) modulus = rule.modulus;
    law = rule.law.value_or(law);
    reference = rule.reference.value_or(reference);
  }
};

std::string kind_of(const std::string& set) { return set.substr(0, set.find(' ')); }

FullRule rule_of(const std::map<std::string, scene::SpringRule>& rules, const std::string& set) {
  FullRule full;
  for (const std::string& name : {std::string("default"), kind_of(set), set})
    if (const auto found = rules.find(name); found != rules.end()) full.refine(found->second);
  return full;
}

void refuse_unknown_sets(const std::map<std::string, scene::SpringRule>& rules,
                         const std::vector<std::string>& sets) {
  for (const auto& [name, rule] : rules) {
    const bool known = name == "default" || std::any_of(sets.begin(), sets.end(), [&](auto& set) {
                         return set == name || kind_of(set) == name;
                       });
    if (!known)
      base::refuse(
          "tissue.springs: no spring set is called '{}'; with these layers the sets are default, "
          "layer, connecting, diagonal and '{}' to '{}'",
          name, sets.front(), sets.back());
  }
}

}  // namespace

std::vector<double> spring_volumes(const SkinMesh& mesh, const std::vector<double>& prism_volumes) {
  const auto edges = static_cast<int64_t>(mesh.edges.size());
  const auto columns = static_cast<int64_t>(mesh.points.size());
  const auto triangles = static_cast<int64_t>(mesh.triangles.size());
  const auto gaps = static_cast<int64_t>(prism_volumes.size()) / triangles;
  const int64_t connecting = (gaps + 1) * edges, diagonal = connecting + gaps * columns;
  std::vector<double> volumes(diagonal + gaps * 2 * edges, 0);
  for (int64_t gap = 0; gap < gaps; ++gap)
    for (int64_t f = 0; f < triangles; ++f) {
      const double share = prism_volumes[gap * triangles + f] / springs_of_prism;
      for (const int64_t e : mesh.triangle_edges[f])
        for (const int64_t spring :
             {gap * edges + e, (gap + 1) * edges + e, diagonal + 2 * (gap * edges + e),
              diagonal + 2 * (gap * edges + e) + 1})
          volumes[spring] += share;
      for (const int64_t c : mesh.triangles[f]) volumes[connecting + gap * columns + c] += share;
    }
  return volumes;
}

void set_stiffness(const scene::Tissue& tissue, const SkinMesh& mesh, Model& model) {
  refuse_unknown_sets(tissue.springs, model.spring_sets);
  std::vector<FullRule> rules;
  for (const std::string& set : model.spring_sets) rules.push_back(rule_of(tissue.springs, set));
  std::vector<double> volumes;
  if (std::any_of(rules.begin(), rules.end(), [](const FullRule& r) { return r.modulus; }))
    volumes = spring_volumes(mesh, model.prisms.rest_volume);
  Springs& springs = model.springs;
  for (size_t j = 0; j < springs.points.size(); ++j) {
    const FullRule& rule = rules[springs.set[j]];
    const auto [p, q] = springs.points[j];
    const double r0 = (model.points.position[q] - model.points.position[p]).norm();
    springs.stiffness[j] = rule.modulus ? *rule.modulus * volumes[j] / (r0 * r0) : rule.stiffness;
    springs.exponent[j] = static_cast<int8_t>(rule.law);
    springs.reference[j] = rule.reference > 0 ? rule.reference : r0;
  }
}

double effective_modulus(const Model& model) {
  double stiffness = 0, volume = 0;
  for (size_t m = 0; m < model.prisms.modulus.size(); ++m) {
    const double shear = model.prisms.shear_modulus[m], lame = model.prisms.modulus[m] - shear;
    stiffness += model.prisms.rest_volume[m] * shear * (3 * lame + 2 * shear) / (lame + shear);
  }
  for (size_t j = 0; j < model.springs.points.size(); ++j) {
    const auto [p, q] = model.springs.points[j];
    stiffness += model.springs.stiffness[j] *
                 (model.points.position[q] - model.points.position[p]).squaredNorm();
  }
  for (const double v : model.prisms.rest_volume) volume += v;
  return volume > 0 ? stiffness / volume : 0;
}

}  // namespace repose::model
