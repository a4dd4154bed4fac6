#pragma once
#include <random>

#include "../discrete/models.h"
#include "repose/model/material.h"
#include "repose/solve/repose.h"

namespace repose::testing {

inline solve::Settings settings(double accuracy, int load_steps = 0) {
  solve::Settings s;
  s.weights = {1, mechanics::VolumeTerm::material, 1};
  s.path.accuracy = accuracy;
  s.path.load_steps = load_steps;
  return s;
}

/// The block as a solid; its inner points are moved by up to `uneven` mm.
inline model::Model solid_block(int columns, int rows, int layers, double poisson, double uneven,
                                const std::function<model::PointSet(int, int, int)>& set) {
  model::Model m = block(columns, rows, layers, 0, set);
  m.springs = {};
  m.spring_sets.clear();
  std::mt19937 random(5);
  for (size_t i = 0; i < m.points.position.size(); ++i)
    for (double& x : m.points.position[i]) {
      const double noise = uneven * (random() / 2147483648.0 - 1.0);
      if (m.points.set[i] == model::PointSet::soft_tissue) x += noise;
    }
  m.points.target = m.points.position;
  const model::Moduli moduli = model::moduli({0.015, poisson});
  for (size_t p = 0; p < m.prisms.points.size(); ++p) {
    Vec3 corners[6];
    for (int c = 0; c < 6; ++c) corners[c] = m.points.position[m.prisms.points[p][c]];
    m.prisms.rest_volume[p] = model::prism_volume(corners);
    m.prisms.shear_modulus.push_back(moduli.shear);
    m.prisms.modulus.push_back(moduli.volume);
    m.prisms.target_volume.push_back(m.prisms.rest_volume[p] * (1 + moduli.shear / moduli.volume));
  }
  model::assemble_edges("block", m);
  return m;
}

/// Lets free points, or those of the skin alone, touch the first body; each stands for `area` mm².
inline void add_touching_points(model::Model& m, double area, bool skin_alone = true) {
  for (size_t i = 0; i < m.points.position.size(); ++i) {
    if (m.points.set[i] != model::PointSet::soft_tissue) continue;
    if (skin_alone && m.points.layer[i] != 0) continue;
    m.contact.pairs.point.push_back(static_cast<int64_t>(i));
    m.contact.pairs.body.push_back(0);
    m.contact.pairs.binding.push_back(model::Binding::touches);
    m.contact.pairs.area.push_back(area);
  }
}

}  // namespace repose::testing
