#pragma once
#include <string>
#include <vector>

#include <fmt/format.h>

#include "front_map.h"
#include "repose/anatomy/propose.h"
#include "repose/scene/landmark_names.h"
#include "scan_end.h"

namespace repose::anatomy {

/// A search for landmarks: what is known so far, in one head frame.
class Search {
 public:
  Search(const HeadFrame& frame, const Landmarks& given) : frame_(frame), given_(given) {}

  const HeadFrame& frame() const { return frame_; }

  /// Takes a landmark found at a place of the frame, unless it is given.
  void put(const std::string& name, const Vec3& place) {
    if (!given_.contains(name)) found_[name] = place;
  }
  /// Takes a point of the profile at x = `aside`, the midline by default.
  void put(const std::string& name, const std::optional<ProfilePoint>& point,
           const std::string& otherwise, double aside = 0) {
    if (point)
      put(name, Vec3(aside, point->x(), point->y()));
    else
      lack(name, otherwise);
  }
  void lack(const std::string& name, const std::string& why) {
    if (!given_.contains(name) && !found_.contains(name)) missing_[name] = why;
  }
  void lack(std::initializer_list<const char*> names, const std::string& why) {
    for (const char* name : names) lack(name, why);
  }

  /// In the frame; nothing where it is neither given nor found.
  std::optional<Vec3> find(const std::string& name) const {
    if (const auto known = given_.find(name); known != given_.end())
      return frame_.to_frame(known->second);
    if (const auto found = found_.find(name); found != found_.end()) return found->second;
    return std::nullopt;
  }
  std::optional<ProfilePoint> profile_point(const std::string& name) const {
    const auto place = find(name);
    return place ? std::optional(ProfilePoint(place->y(), place->z())) : std::nullopt;
  }

  void remark(const std::string& line) { remarks_.push_back(line); }

  Proposal proposal() const {
    Proposal result{frame_, given_, missing_, remarks_};
    for (const auto& [name, place] : found_) result.found[name] = frame_.to_scan(place);
    for (const scene::LandmarkName& landmark : scene::landmark_names())
      if (!result.found.contains(landmark.name))
        result.missing.try_emplace(landmark.name, "landmarks that it follows were not found");
    return result;
  }

 private:
  HeadFrame frame_;
  Landmarks given_, found_;
  std::map<std::string, std::string> missing_;
  std::vector<std::string> remarks_;
};

/// The mandible, all vertices of which triangles use, with where its scan ended.
struct Mandible {
  explicit Mandible(const surface::Surface& surface);

  const surface::Surface& surface;
  std::vector<char> at_rim;  ///< [points of the surface]
  ScanEnd end;
};

void search_bones(const surface::Surface& skull, const Mandible& mandible, Search& search);
/// Finds the landmarks of skin, after those of bone.
void search_skin(const surface::Surface& skin, Search& search);

}  // namespace repose::anatomy
