#include "repose/scene/landmark_names.h"

#include <algorithm>

#include "repose/base/error.h"
#include "repose/base/text.h"

namespace repose::scene {

const std::vector<LandmarkName>& landmark_names() {
  static const std::vector<LandmarkName> names{
      {"nasion_bone", {"nasion", "n", "na"}, false},
      {"nasal_spine", {"anterior nasal spine", "ans", "sp"}, false},
      {"a_point", {"a", "point a", "subspinale", "ss"}, false},
      {"upper_incisor_edge", {"upper incisal edge", "upper incisor", "u1", "is"}, false},
      {"lower_incisor_edge", {"lower incisal edge", "lower incisor", "l1", "ii"}, false},
      {"b_point", {"b", "point b", "supramentale", "sm"}, false},
      {"pogonion_bone", {"pogonion", "pog", "pg"}, false},
      {"menton_bone", {"menton", "me"}, false},
      {"condyle_right_center",
       {"condyle right", "right condyle", "condylion right", "co r"},
       false},
      {"condyle_left_center", {"condyle left", "left condyle", "condylion left", "co l"}, false},
      {"gonion_right", {"right gonion", "go r"}, false},
      {"gonion_left", {"left gonion", "go l"}, false},
      {"nasion_soft", {"nasion'", "n'", "soft nasion"}, true},
      {"pronasale", {"prn", "pn"}, true},
      {"subnasale", {"sn"}, true},
      {"upper_lip", {"labrale superius", "ls", "upper lip point"}, true},
      {"stomion", {"sto", "stm", "st"}, true},
      {"lower_lip", {"labrale inferius", "li", "lower lip point"}, true},
      {"mouth_right", {"mouth corner right", "right mouth corner", "cheilion right", "ch r"}, true},
      {"mouth_left", {"mouth corner left", "left mouth corner", "cheilion left", "ch l"}, true},
      {"b_soft", {"b'", "si", "sublabiale", "sl", "mentolabial sulcus"}, true},
      {"pogonion_soft",
       {"pogonion'", "pog'", "pg'", "soft pogonion", "soft tissue pogonion"},
       true},
      {"menton_soft", {"menton'", "me'", "soft menton", "soft tissue menton"}, true}};
  return names;
}

namespace {

/// Lower case, with single blanks between words and ' for a prime.
std::string plain(const std::string& text) {
  constexpr std::string_view prime = "\xE2\x80\xB2";
  const std::string small = base::lower(text);
  std::string result;
  bool blank = false;
  for (size_t i = 0; i < small.size(); ++i) {
    const bool primed = std::string_view(small).substr(i).starts_with(prime);
    const char c = primed ? '\'' : small[i];
    if (primed) i += prime.size() - 1;
    if (std::string_view(" _-.\t").find(c) != std::string_view::npos) {
      blank = !result.empty();
      continue;
    }
    if (blank) result.push_back(' ');
    blank = false;
    result.push_back(c);
  }
  return result;
}

}  // namespace

std::string standard_name(const std::string& spelling) {
  const std::string expected = plain(spelling);
  for (const LandmarkName& landmark : landmark_names()) {
    if (plain(landmark.name) == expected) return landmark.name;
    const auto& aliases = landmark.aliases;
    if (std::find(aliases.begin(), aliases.end(), expected) != aliases.end()) return landmark.name;
  }
  return "";
}

std::string misspelled_name(const std::string& name, const Landmarks& landmarks) {
  constexpr size_t misspelled = 2, shortest = 8;  // letters
  if (!standard_name(name).empty()) return "";
  for (const LandmarkName& standard : landmark_names())
    if (standard.name.size() >= shortest && name.starts_with(standard.name[0]) &&
        !find(landmarks, standard.name.c_str()) &&
        base::edit_distance(name, standard.name) <= misspelled)
      return standard.name;
  return "";
}

const Vec3* find(const Landmarks& landmarks, const char* name) {
  const auto found = landmarks.find(name);
  return found == landmarks.end() ? nullptr : &found->second;
}

Landmarks with_standard_names(const Landmarks& landmarks, const std::string& file) {
  constexpr double same = 1e-3;  // mm
  Landmarks renamed;
  std::map<std::string, std::string> spelling;
  for (const auto& [name, position] : landmarks) {
    const std::string standard = standard_name(name), key = standard.empty() ? name : standard;
    const auto [entry, added] = renamed.try_emplace(key, position);
    if (!added && (entry->second - position).norm() > same)
      base::refuse("{}: landmarks {} and {} are both {}, {:.1f} mm apart; remove one of them", file,
                   base::quote(spelling[key]), base::quote(name), key,
                   (entry->second - position).norm());
    spelling[key] = name;
  }
  return renamed;
}

}  // namespace repose::scene
