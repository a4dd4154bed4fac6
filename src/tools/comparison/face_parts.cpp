#include "repose/tools/comparison/face_parts.h"

#include <cmath>

#include "repose/base/error.h"

namespace repose::tools::comparison {

namespace {

constexpr double nose_width = 20, lip_width = 30, cheek_width = 70, cheek_depth = 70;  // mm
constexpr double nose_height = 50, chin_height = 15, below_menton = 5, above_tip = 15;

}  // namespace

FaceParts::FaceParts(const std::map<std::string, Vec3>& landmarks, const std::string& file) {
  const auto find = [&](const char* name) {
    const auto found = landmarks.find(name);
    if (found == landmarks.end())
      base::refuse(
          "{}: landmark {} is missing; the parts of the face need pronasale, subnasale, upper_lip, "
          "lower_lip and pogonion_soft",
          file, name);
    return found->second;
  };
  const auto height_of = [&](const char* name, double otherwise) {
    const auto found = landmarks.find(name);
    return found == landmarks.end() ? otherwise : found->second.z();
  };
  const Vec3 tip = find("pronasale"), base = find("subnasale"), upper = find("upper_lip"),
             lower = find("lower_lip"), chin = find("pogonion_soft");
  middle_ = (tip.x() + base.x() + upper.x() + lower.x() + chin.x()) / 5;
  tip_ = tip.z();
  depth_ = tip.y();
  subnasale_ = base.z();
  between_lips_ = (upper.z() + lower.z()) / 2;
  under_lip_ = (lower.z() + chin.z()) / 2;
  pogonion_ = chin.z();
  nasion_ = height_of("nasion_soft", tip_ + nose_height);
  menton_ = height_of("menton_soft", pogonion_ - chin_height) - below_menton;
  if (!(nasion_ > subnasale_ && subnasale_ > upper.z() && upper.z() > lower.z() &&
        lower.z() > pogonion_ && pogonion_ > menton_))
    base::refuse(
        "{}: nasion, subnasale, lips, pogonion and menton do not follow each other downwards "
        "along −z; turn the head upright",
        file);
}

std::string FaceParts::at(const Vec3& point) const {
  const double side = point.x() - middle_, aside = std::abs(side), z = point.z();
  if (point.y() > depth_ + cheek_depth) return "";
  if (z > subnasale_ && z <= nasion_ && aside <= nose_width) return "nose";
  if (aside <= lip_width && z <= subnasale_) {
    if (z > between_lips_) return "upper lip";
    if (z > under_lip_) return "lower lip";
    return z > menton_ ? "chin" : "";
  }
  const bool beside = aside > (z > subnasale_ ? nose_width : lip_width) && aside <= cheek_width;
  if (!beside || z <= pogonion_ || z > tip_ + above_tip) return "";
  return side > 0 ? "left cheek" : "right cheek";
}

}  // namespace repose::tools::comparison
