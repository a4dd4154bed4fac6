#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// A rigid body that tissue touches: a bone, with which it moves, or a shape that is pushed.
struct Body {
  using Shape =
      std::variant<scene::Sphere, scene::Capsule, scene::Box, scene::HalfSpace, surface::Surface>;
  std::string name;
  int32_t bone = -1;         ///< row of Model::bones, whose surface it has; −1: `shape`
  Shape shape = {};          ///< at load 0, of one that is no bone
  Vec3 push = Vec3::Zero();  ///< mm from load 0 to load 1, of one that is no bone
};

/// Numbers that say what a closed form is, at most: from, to, radius of a capsule.
inline constexpr int shape_numbers = 7;

/// Binding of a point to a body (values as in the file): it may lift off but never passes, or it
/// keeps its distance and slides along.
enum class Binding : int8_t { touches = 0, slides = 1 };

/// Points that touch bodies, frictionless (docs/theory/contact.md).
struct ContactPairs {
  std::vector<int64_t> point;    ///< [C]
  std::vector<int32_t> body;     ///< [C] row of Contact::bodies
  std::vector<Binding> binding;  ///< [C]
  std::vector<double> area;      ///< [C] mm², of tissue that the point stands for
  /// [C] mm, or empty: the gap is the distance to the body less this, which is the initial one of
  /// a point that slides, and of one that touches if it began inside. Not in a file.
  std::vector<double> offset = {};
};

/// The two sides of cuts, which do not pass one another: pairs of nets of controls of smooth
/// surfaces (docs/theory/contact.md), of a first side, whose places stay off the second's surface.
/// A cut has two pairs, the other way round in the second. A net has columns along the cut and rows
/// from the skin inwards; a control is a weighted sum of points.
struct CutFaces {
  std::vector<std::array<int64_t, 2>> size;  ///< [K] columns and rows of a pair's nets
  /// [controls + 1] where a control's points begin: of each pair those of the first side, column by
  /// column, then those of the second.
  std::vector<int64_t> begin;
  std::vector<int64_t> point;  ///< rows of points; of a place that touches, first one nearest to it
  std::vector<double> weight;  ///< [points of controls]; those of a control add up to 1
  std::vector<double> area;    ///< [controls of first sides] mm²; 0: not a place that touches
  bool empty() const { return size.empty(); }
};

/// The rule by which deepest points of the lips adhere to teeth: elements of the term "adhesion"
/// (docs/theory/contact.md).
struct AdhesionRule {
  /// A jaw with teeth, and where points adhere to it.
  struct Jaw {
    int32_t bone = -1;   ///< row of Model::bones
    bool upper = false;  ///< of points below the skin above the line between the lips, or below it
    Vec3 low, high;      ///< mm, corners of the box that they lie in, along the axes
    double reach = 0;    ///< mm, largest distance to the bone
  };
  double tension = 0;            ///< N/mm², the largest
  double range = 0;              ///< mm off the plane, at which tension is 1/√2 of the largest
  Mat3 axes = Mat3::Identity();  ///< rows: left, back and up of the head
  std::array<Vec3, 3> lip_line;  ///< mm along the axes, right corner of the mouth, stomion, left
  std::vector<Jaw> jaws;         ///< the upper one first
  std::vector<int64_t> cut_columns;  ///< on the path of a cut: none of their points adheres
};

struct Contact {
  double stiffness = 0;  ///< N/mm³, of the penalty that multipliers make exact
  double spacing = 1;    ///< mm, of the grids of distances to meshes
  std::vector<Body> bodies;
  ContactPairs pairs;
  CutFaces cut_faces;
  bool empty() const { return pairs.point.empty() && cut_faces.empty(); }
};

}  // namespace repose::model
