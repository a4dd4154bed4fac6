#pragma once
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "../../layered_patch.h"
#include "repose/model/material.h"

/// A small piece of tissue with uneven springs, and the states it is tried in.
namespace repose::test {

/// Numbers in [−1, 1], the same on every machine.
class Random {
 public:
  explicit Random(uint32_t seed) : engine_(seed) {}
  double operator()() { return static_cast<double>(engine_()) / 2147483647.5 - 1.0; }
  Vec3 vector() {
    const double x = (*this)(), y = (*this)();
    return {x, y, (*this)()};
  }

 private:
  std::mt19937 engine_;
};

/// A patch whose springs differ in law, stiffness, rest length and reference length. One prism is
/// left out, so that their number, 23, is odd.
inline model::Model uneven_patch() {
  model::Model model = layered_patch({});
  Random random(7);
  for (size_t e = 0; e < model.springs.points.size(); ++e) {
    model.springs.exponent[e] = static_cast<int8_t>(e % 3);
    model.springs.stiffness[e] = 1.0 + 0.8 * random();
    model.springs.rest_length[e] *= 1.0 + 0.2 * random();
    if (e % 2 == 0) model.springs.reference[e] = 1.0;
  }
  model.prisms.points.erase(model.prisms.points.begin());
  model.prisms.rest_volume.erase(model.prisms.rest_volume.begin());
  for (double& volume : model.prisms.rest_volume) volume *= 1.0 + 0.2 * random();
  return model;
}

/// The patch without springs, as a solid whose moduli differ from prism to prism.
inline model::Model uneven_solid() {
  model::Model model = layered_patch({});
  model.springs = {};
  Random random(8);
  for (const double volume : model.prisms.rest_volume) {
    model.prisms.shear_modulus.push_back(1.0 + 0.8 * random());
    model.prisms.modulus.push_back(5.0 + 4 * random());
    model.prisms.target_volume.push_back(volume * (1.2 + 0.1 * random()));
  }
  model::assemble_edges("patch", model);
  return model;
}

/// Returns uneven_solid() with its volumes averaged around points.
inline model::Model averaged_solid() {
  model::Model model = uneven_solid();
  Random random(9);
  for (const double modulus : model.prisms.modulus)
    model.prisms.nodal_modulus.push_back(modulus * (0.6 + 0.3 * random()));
  return model;
}

enum class State { mild, compressed, stretched, inverted, flat, far, nearly_coincident };

struct StateInfo {
  State state;
  const char* name;
  double step;  ///< mm, a displacement small against what bends the energy
};
constexpr std::array<StateInfo, 7> all_states = {{
    {State::mild, "mild", 1.0 / 64},
    {State::compressed, "compressed", 1.0 / 1024},
    {State::stretched, "stretched", 1.0 / 16},
    {State::inverted, "inverted", 1.0 / 64},
    {State::flat, "flat", 1.0 / 64},
    {State::far, "far from the origin", 1.0 / 64},
    {State::nearly_coincident, "nearly coincident points", 1.0 / 32768},
}};

/// Rounded to what is exact at 1e6 mm too, so that moving the tissue there changes nothing else.
inline Vec3 snapped(const Vec3& x, double unit) { return (x / unit).array().round() * unit; }

inline Vec3 deformed(State state, const Vec3& x, const Vec3& noise, int32_t layer) {
  switch (state) {
    case State::compressed:
      return 0.1 * x + 0.02 * noise;
    case State::stretched:
      return 6.0 * x + 0.3 * noise;
    case State::inverted:
      return Vec3(x.x(), x.y(), -x.z()) + 0.1 * noise;
    case State::flat:
      return {x.x() + 0.3 * layer + 0.1 * noise.x(), x.y() + 0.2 * layer + 0.1 * noise.y(), 0.0};
    case State::far:
      return x + 0.1 * noise + Vec3(1e6, -1e6, 1e6);
    default:
      return x + 0.1 * noise;
  }
}

inline std::vector<Vec3> positions(const model::Model& model, State state, uint32_t seed = 1) {
  Random random(seed);
  std::vector<Vec3> moved;
  for (size_t i = 0; i < model.points.position.size(); ++i)
    moved.push_back(
        snapped(deformed(state, model.points.position[i], random.vector(), model.points.layer[i]),
                std::ldexp(1.0, -26)));
  if (state == State::nearly_coincident)  // one spring of each law
    for (int i : {0, 3, 6}) moved[i + 1] = moved[i] + Vec3(1e-3, 5e-4, -2e-4);
  return moved;
}

inline std::vector<Vec3> random_directions(size_t count, uint32_t seed = 2) {
  Random random(seed);
  std::vector<Vec3> directions(count);
  for (Vec3& d : directions) d = snapped(random.vector(), std::ldexp(1.0, -10));
  return directions;
}

}  // namespace repose::test
