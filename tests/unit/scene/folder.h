#pragma once
#include "../../folder.h"

namespace repose::scene {

/// A folder of a test's own with the files of a scene in it.
class Folder : public test::Folder {
 public:
  Folder() {
    std::filesystem::create_directories(path("sub"));
    for (const char* file : {"face.ply", "skull.ply", "mandible.ply"}) write(file, "ply\n");
  }
};

using test::refusal;

}  // namespace repose::scene
