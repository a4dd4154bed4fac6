#pragma once
#include <optional>
#include <type_traits>

#include "repose/model/step.h"
#include "repose/results/merged_bones.h"
#include "shared_part.h"
#include "step_views.h"
#include "writer.h"

namespace repose::results {

/// Returns the group of a step, from the root.
std::string group_of(size_t step);

/// Writes the numbers of a step as attributes (model::for_each_number).
struct WriteAttribute {
  hid_t group;
  void operator()(const char* name, bool value) const {
    write_attribute(group, name, static_cast<int64_t>(value));
  }
  void operator()(const char* name, double value) const;
  template <class Choice>
  requires std::is_enum_v<Choice>
  void operator()(const char* name, const Choice& value) const {
    write_attribute(group, name, std::string(word(value)));
  }
  template <class Value>
  void operator()(const char* name, const Value& value) const {
    write_attribute(group, name, value);
  }
};

/// Writes steps to the open part of a result, and notes them for the viewers. All members
/// collective but bytes().
class StepWriter {
 public:
  /// `slabs` are those of the model; `bones` and `motion` are on rank 0.
  StepWriter(const SharedPart& part, StepViews& views, const model::ModelRows& slabs,
             MergedBones bones, std::optional<model::PrescribedMotion> motion);

  /// Returns enough bytes for a step with the fields that `rows` hold, its descriptions included.
  int64_t bytes(const model::StepRows& rows) const;
  /// Writes the next step; the numbers are the same on all ranks. Throws InternalError where an
  /// array is not this rank's slab.
  void write(const model::StepNumbers& numbers, const model::StepRows& rows);

 private:
  void write_field(hid_t group, const model::PointField& field);
  void write_points(hid_t step, const model::StepRows& rows);
  void write_elements(hid_t step, const model::StepRows& rows) const;
  bool write_bones(hid_t step, double load) const;

  const SharedPart& part_;
  StepViews& views_;
  MergedBones bones_;
  std::optional<model::PrescribedMotion> motion_;
  std::vector<Vec3> initial_, outward_;  // this rank's slab of positions and of the skin's normals
};

}  // namespace repose::results
