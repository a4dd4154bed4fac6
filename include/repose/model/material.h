#pragma once
#include <array>
#include <optional>
#include <string>

#include "repose/model/model.h"
#include "repose/scene/scene.h"

/// Tissue as a neo-Hookean solid on the model's prisms (docs/theory/continuum.md).
namespace repose::model {

/// Moduli of the energy of a solid, N/mm².
struct Moduli {
  double shear;   ///< μ = E / (2 (1 + ν))
  double volume;  ///< κ = E ν / ((1 + ν)(1 − 2 ν)) + μ
};
Moduli moduli(const scene::Elasticity& elasticity);
double young_modulus(const Moduli& moduli);  ///< N/mm²

/// Share of the depth between a prism's triangles, mm, that each stratum takes; the last is what
/// lies below all.
std::vector<double> strata_shares(const std::vector<double>& thickness,
                                  const std::array<double, 2>& depth);

/// Depth of a prism's upper and lower triangle below the skin, mm; `skin` [points] is the row of
/// the point at the top of the column.
std::array<double, 2> depth_of(const Model& model, const std::array<int64_t, 6>& prism,
                               const std::vector<int64_t>& skin);

/// [points] The row of the point at the top of the column of each.
std::vector<int64_t> skin_rows(const Points& points);

/// [prisms] 1 where a region of a material holds a prism. Reads the regions' meshes and volumes.
std::vector<char> in_regions(const std::vector<scene::MaterialRegion>& regions, const Model& model);

/// Returns by how much each elastic support of a part of a model stiffens with the stiffness of
/// each stratum of its material: [elements][strata, the last below all] ∂ ln k/∂ ln E. Reads the
/// regions' meshes and volumes.
std::vector<std::vector<double>> support_shares(const scene::Material& material,
                                                const Model& model);

/// Initial positions of a prism's points, mm.
std::array<Vec3, 6> corners_of(const Model& model, size_t prism);

/// The pairs of a prism's six points, in the order of their weights.
inline constexpr std::array<std::array<int, 2>, 15> prism_pairs = {{{0, 1},
                                                                    {0, 2},
                                                                    {1, 2},
                                                                    {3, 4},
                                                                    {3, 5},
                                                                    {4, 5},
                                                                    {0, 3},
                                                                    {1, 4},
                                                                    {2, 5},
                                                                    {0, 4},
                                                                    {1, 3},
                                                                    {1, 5},
                                                                    {2, 4},
                                                                    {0, 5},
                                                                    {2, 3}}};

/// −∫ ∇N_i · A ∇N_j dV (mm) over a prism for the pairs of its points, N the wedge's shape
/// functions, A symmetric, by 3 × 2 Gauss points. Empty where the map of the wedge is not
/// invertible at one of them.
std::optional<std::array<double, 15>> pair_weights(const std::array<Vec3, 6>& corners,
                                                   const Mat3& A = Mat3::Identity());

/// A prism's deformation gradient in the middle, from its corners before and now.
Mat3 deformation_gradient(const std::array<Vec3, 6>& before, const std::array<Vec3, 6>& now);

/// Gives every prism of make_layers its moduli, a target volume t = V (1 + μ/κ), at which it is
/// free of stress as it is, and the model the edges of all (C2), in place of springs. A prism takes
/// the means of the strata that it crosses, by the share of its depth, and the material of the last
/// region that its middle lies in. Where volumes are averaged, λ = κ − μ is. Turgor stretches the
/// first stratum, in both directions of the skin: its tension τ_s = E τ h / (1 − ν), N/mm, adds ½
/// τ_s ∫ |∇x|² over the skin, which is quadratic too (cotangent weights: Pinkall & Polthier 1993).
/// Reads the regions' meshes and volumes. Throws InputError naming `file` and the place of a prism
/// too distorted, or turgor without a stratum. Serial.
/// Returns for each region how many prisms it holds; none is for the caller to refuse.
std::vector<int64_t> set_material(const scene::Tissue& tissue, const std::string& file,
                                  Model& model);

/// The edges again from the prisms and their shear moduli, sorted by their points. InputError as
/// above. Serial, O(prisms).
void assemble_edges(const std::string& file, Model& model);
/// Adds to the weight of the edge between two points; nothing where there is none.
void add_to_edge(int64_t p, int64_t q, double weight, Edges& edges);

/// The ring muscle of the mouth (orbicularis oris), by landmarks.
struct RingMuscle {
  double tone = 0;  ///< N/mm², stress along the fibers at the line between the lips; 0: no muscle
  Vec3 right = Vec3::Zero(), left = right,
       stomion = right;          ///< corners and middle of that line, mm
  double top = 0, bottom = 0;    ///< z, mm, where the tone is 0
  Mat3 axes = Mat3::Identity();  ///< rows left, back and up, along which all coordinates are
};

/// The ring muscle of a scene: of no tone where the scene has no anatomy, no solid, or lacks one of
/// the landmarks stomion, mouth_right, mouth_left, subnasale and b_soft.
RingMuscle ring_muscle(const scene::Scene& scene);

/// Gives the ring muscle its tone, balanced as the tissue is: adds ½ ∫ τ |F f − f|² dV, τ = σ (1 −
/// ρ²), to the edges and, what is linear in the displacements, to the external forces of soft
/// tissue, of a part of a model. Its points have the given rows [points] in the whole, so that sums
/// are taken in the same order; forces on its first `owned` points alone.
void add_tone(const RingMuscle& muscle, const std::vector<int64_t>& row, int64_t owned,
              Model& model);
/// Does so for the ring muscle of a scene and a whole model, which may be of springs, without tone.
/// Serial.
void add_tone(const scene::Scene& scene, Model& model);

}  // namespace repose::model
