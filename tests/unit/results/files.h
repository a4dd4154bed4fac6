#pragma once
#include "../../folder.h"
#include "../../layered_patch.h"
#include "repose/results/result_file.h"

/// A small model with everything a file can hold, and a result of it.
namespace repose::results {

using test::Folder;
using test::refusal;

/// Two bones with surfaces; the second moves 2 mm up.
inline model::Model small_model() {
  model::Model m = test::layered_patch({.columns_x = 3, .columns_y = 2, .layers = 2});
  m.gravity = {0, 0, -9.80665};
  m.bones = {"skull", "mandible"};
  for (size_t i = 0; i < m.points.position.size(); ++i) {
    m.points.mass[i] = 1e-4 * static_cast<double>(i);
    m.points.external_force[i] = {0.5, 0, static_cast<double>(i)};
    if (m.points.set[i] != model::PointSet::bone || i < 6) continue;
    m.points.bone[i] = 1;
    m.points.target[i].z() += 2;
  }
  m.points.set[0] = model::PointSet::boundary;
  m.points.set[2] = model::PointSet::held;
  m.skin = {{0, 2, 6}, {2, 8, 6}};
  for (int b = 0; b < 2; ++b) {
    const Vec3 corner(3.0 * b, 0, -5);
    m.bone_surfaces.push_back(
        {m.bones[b], {corner, corner + Vec3(2, 0, 0), corner + Vec3(0, 2, 0)}, {{0, 1, 2}}});
  }
  m.bone_transform.assign(2, Mat4::Identity());
  m.bone_transform[1](2, 3) = 2;
  return m;
}

/// A step at `load` of one rank with numbers that can be told apart.
inline model::StepRows small_rows(const model::Model& m, double load) {
  model::StepRows rows;
  for (size_t i = 0; i < m.points.position.size(); ++i) {
    rows.position.push_back(m.points.position[i] + load * Vec3(0.25, 0.5, 1));
    rows.residual_force.push_back(Vec3(1, 2, 3) * static_cast<double>(i));
  }
  for (size_t j = 0; j < m.springs.points.size(); ++j) {
    rows.elongation.push_back(0.125 * static_cast<double>(j));
    rows.tension.push_back(0.25 * static_cast<double>(j));
  }
  for (size_t k = 0; k < m.prisms.points.size(); ++k)
    rows.volume_ratio.push_back(1 + 0.5 * static_cast<double>(k));
  return rows;
}

inline model::StepNumbers small_numbers(double load) {
  model::StepNumbers n;
  n.load = load;
  n.volume = model::VolumeTerm::penalty;
  n.lambda = 0.5;
  n.bulk_modulus = 0.25;
  n.epsilon = 1e-6;
  if (load > 0) n.smallest_eigenvalue = 0.125, n.largest_eigenvalue = 3;
  n.f_e = 3;
  n.potential = -4;
  n.f_f = 5;
  n.f_v = 6;
  n.penalty = 7;
  n.objective = 8;
  n.gradient_max = 9;
  n.volume_error_max = 10;
  n.inverted_prisms = 11;
  n.displacement_error = 12;
  n.iterations = 13;
  n.evaluations = 14;
  n.seconds = 15;
  n.reason = "near enough";
  n.converged = true;
  return n;
}

/// Writes NAME.h5 and its XDMF files with steps at loads 0 and 1.
inline void write_small_result(const std::filesystem::path& name, const model::Model& m) {
  ResultFile file(MPI_COMM_SELF, name, m, model::all_rows(m));
  for (const double load : {0.0, 1.0}) file.append(small_numbers(load), small_rows(m, load));
  file.commit();
}

}  // namespace repose::results
