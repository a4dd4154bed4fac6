#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/model/contact.h"
#include "repose/surface/surface.h"

/// The discrete model as flat arrays, exactly /model of the result file.
namespace repose::model {

/// Kinds of points (values as in the file).
enum class PointSet : int8_t { soft_tissue = 0, boundary = 1, bone = 2, held = 3 };

struct Points {
  std::vector<Vec3> position;        ///< [N] mm, initial
  std::vector<PointSet> set;         ///< [N]
  std::vector<Vec3> target;          ///< [N] mm, where a bone or held point goes, else = position
  std::vector<int32_t> layer;        ///< [N] 0 = skin
  std::vector<int64_t> column;       ///< [N] skin vertex of its column
  std::vector<int32_t> bone;         ///< [N] row of Model::bones, −1 for none
  std::vector<double> mass;          ///< [N] kg
  std::vector<Vec3> external_force;  ///< [N] N
};

struct Springs {
  std::vector<std::array<int64_t, 2>> points;  ///< [S]
  std::vector<int32_t> set;                    ///< [S] row of Model::spring_sets
  std::vector<double> rest_length;             ///< [S] mm, ≥ 0
  std::vector<double> stiffness;               ///< [S] k0, N/mm
  std::vector<int8_t> exponent;                ///< [S] p of the law, 0, 1 or 2
  std::vector<double> reference;               ///< [S] s_ref, mm, > 0
};

/// Prisms, and of a solid its material: of tissue of springs the last four are empty.
struct Prisms {
  std::vector<std::array<int64_t, 6>> points;  ///< [M] a0 a1 a2 b0 b1 b2
  std::vector<double> rest_volume;             ///< [M] mm³, at Points::position
  std::vector<double> shear_modulus;           ///< [M] μ, N/mm², > 0
  std::vector<double> modulus;                 ///< [M] κ = λ + μ (Lamé), N/mm², > 0
  std::vector<double> target_volume;           ///< [M] t, mm³
  /// [M] N/mm², above 0 and below κ, or empty: what of κ resists the volume averaged around points,
  /// not the prism's own (mechanics/nodal_volumes.h).
  std::vector<double> nodal_modulus;
};

/// The part of a solid's energy that is quadratic in the positions: ½ Σ w |x_i − x_j|²
/// (docs/theory/continuum.md).
struct Edges {
  std::vector<std::array<int64_t, 2>> points;  ///< [E]
  std::vector<double> weight;                  ///< [E] w, N/mm, of either sign
};

/// Elements of one energy term of mechanics/term.h.
struct TermElements {
  std::string term;  ///< its name
  int64_t points_each = 1, numbers_each = 0;
  std::vector<int64_t> points;  ///< [E, points_each]
  std::vector<double> numbers;  ///< [E, numbers_each] in the term's units
  /// Column of the numbers that holds the row of the bone with which the element moves; −1: it
  /// moves with none.
  int64_t bone_number = -1;
  size_t size() const { return points.size() / static_cast<size_t>(points_each); }
  std::span<const int64_t> points_of(size_t e) const {
    return std::span(points).subspan(e * static_cast<size_t>(points_each),
                                     static_cast<size_t>(points_each));
  }
  std::span<const double> numbers_of(size_t e) const {
    return std::span(numbers).subspan(e * static_cast<size_t>(numbers_each),
                                      static_cast<size_t>(numbers_each));
  }
  int32_t bone_of(size_t e) const {
    return bone_number < 0 ? -1 : static_cast<int32_t>(numbers_of(e)[bone_number]);
  }
  /// Appends an element, whose points and numbers lie elsewhere.
  void add(std::span<const int64_t> of_points, std::span<const double> of_numbers) {
    points.insert(points.end(), of_points.begin(), of_points.end());
    numbers.insert(numbers.end(), of_numbers.begin(), of_numbers.end());
  }
};

struct Model {
  Vec3 gravity = Vec3::Zero();  ///< N/kg
  Points points;
  Springs springs;
  Prisms prisms;
  Edges edges;                         ///< of a solid
  std::vector<TermElements> elements;  ///< of further terms
  Contact contact;
  std::optional<AdhesionRule> adhesion;  ///< unset: no lips adhere to teeth
  std::vector<Triangle> skin;            ///< [K] for drawing, may be empty
  std::vector<std::string> spring_sets;
  std::vector<std::string> bones;
  std::vector<surface::Surface> bone_surfaces;  ///< [bones] or empty; at the initial position
  std::vector<Mat4> bone_transform;             ///< [bones] or empty: recovered from targets
};

/// Returns whether the tissue is a neo-Hookean solid, not springs.
inline bool is_solid(const Model& model) { return !model.prisms.modulus.empty(); }

/// Returns the initial length of a spring, mm.
inline double length(const Model& model, size_t spring) {
  const auto& [p, q] = model.springs.points[spring];
  return (model.points.position[q] - model.points.position[p]).norm();
}

/// Returns whether an element has a point of soft tissue.
inline bool touches_soft_tissue(const Points& points, std::span<const int64_t> element) {
  return std::any_of(element.begin(), element.end(),
                     [&](int64_t row) { return points.set[row] == PointSet::soft_tissue; });
}

/// [N] of every point the outward unit normal of the skin above it, area-weighted, at the initial
/// position; zero where there is no skin above.
std::vector<Vec3> outward_normals(const Model& model);

/// Principal counts of a model.
struct Counts {
  int64_t points = 0, soft = 0, boundary = 0, bone = 0, held = 0, springs = 0, prisms = 0;
  int64_t edges = 0;
};
Counts count(const Model& model);

/// Calls visit(name, array) for each array of a group (points, springs, prisms, edges, contact
/// pairs, sides of cuts), with its name and in its order in a file; of prisms only those that they
/// have.
template <class Group, class Visit>
void for_each_array(Group& of, Visit&& visit) {
  if constexpr (requires { of.target; }) {
    visit("position", of.position);
    visit("set", of.set);
    visit("target", of.target);
    visit("layer", of.layer);
    visit("column", of.column);
    visit("bone", of.bone);
    visit("mass", of.mass);
    visit("external_force", of.external_force);
  } else if constexpr (requires { of.rest_length; }) {
    visit("points", of.points);
    visit("set", of.set);
    visit("rest_length", of.rest_length);
    visit("stiffness", of.stiffness);
    visit("exponent", of.exponent);
    visit("reference", of.reference);
  } else if constexpr (requires { of.rest_volume; }) {
    visit("points", of.points);
    visit("rest_volume", of.rest_volume);
    if (of.modulus.empty()) return;
    visit("shear_modulus", of.shear_modulus);
    visit("modulus", of.modulus);
    visit("target_volume", of.target_volume);
    if (!of.nodal_modulus.empty()) visit("nodal_modulus", of.nodal_modulus);
  } else if constexpr (requires { of.binding; }) {
    visit("point", of.point);
    visit("body_row", of.body);
    visit("binding", of.binding);
    visit("area", of.area);
  } else if constexpr (requires { of.begin; }) {
    visit("net", of.size);
    visit("begin", of.begin);
    visit("point", of.point);
    visit("weight", of.weight);
    visit("area", of.area);
  } else {
    visit("points", of.points);
    visit("weight", of.weight);
  }
}

/// Slabs (base::slab) of the arrays of a distributed model on this rank, in natural order.
struct ModelRows {
  Counts counts;              ///< of the whole
  bool solid = false;         ///< the whole is one
  int64_t contact_pairs = 0;  ///< rows of contact of the whole model
  Points points;
  Springs springs;
  Prisms prisms;
  Edges edges;
  ContactPairs pairs;         ///< without offsets
  std::vector<Vec3> outward;  ///< outward_normals()
};

/// All rows of a model, the slabs of a single rank.
ModelRows all_rows(const Model& model);

/// Refuses a model that is not one: index out of range, value not finite, negative stiffness, mass
/// or rest length, s_ref ≤ 0, unknown exponent or set, arrays of different length, a volume that is
/// not the prism's, an unattached point, no point at all. InputError naming `file`, array and row.
void validate(const Model& model, const std::string& file);

/// Returns the first point of soft tissue that no springs or edges join, directly or not, to a
/// point of another set; −1 if there is none. `ends` are their points.
int64_t find_floating(const std::vector<PointSet>& set,
                      std::initializer_list<std::span<const std::array<int64_t, 2>>> ends);

}  // namespace repose::model
