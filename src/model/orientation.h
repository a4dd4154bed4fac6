#pragma once
#include <string>
#include <vector>

#include "bone_field.h"
#include "repose/model/skin_mesh.h"

namespace repose::model {

/// Refuses a skin and bones that are not where they belong: bounding boxes more than 200 mm apart
/// (files in different coordinates: the message says which, and whether turning LPS into RAS would
/// bring them together; InputError), or skin vertices inside bone (RefusedPlaces, skin_mesh.h).
void require_same_place(const SkinMesh& mesh, const std::string& skin_name,
                        const std::vector<surface::Surface>& bones, const BoneField& field);

/// Turns the skin round where most of it, by area, has the nearest bone on its outer side: an open
/// patch has no defined outside. Returns whether it did.
bool face_outwards(const std::vector<BoneField::Nearest>& nearest, SkinMesh& mesh);

}  // namespace repose::model
