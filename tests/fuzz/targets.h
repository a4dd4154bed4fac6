#pragma once
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "../../src/live/request.h"
#include "repose/imaging/volume.h"
#include "repose/results/model_file.h"
#include "repose/scene/landmarks.h"
#include "repose/scene/scene.h"
#include "repose/scene/transform_file.h"
#include "repose/surface/read.h"
#include "seeds.h"

/// Every reader of files and requests, with valid files to begin with.
namespace repose::fuzz {

struct Target {
  std::string name, file;  ///< what is read is called, in a folder
  std::vector<std::string> seeds;
  std::function<void(const std::filesystem::path&)> read;
  double share = 1;  ///< of the inputs
};

/// Tells if a file is taken, and not refused in one line; any other way out ends the process.
inline bool taken(const Target& target, const std::filesystem::path& file) {
  try {
    target.read(file);
    return true;
  } catch (const base::InputError& refusal) {
    if (std::string(refusal.what()).find('\n') == std::string::npos) return false;
    std::fprintf(stderr, "refused in several lines: %s\n", refusal.what());
    std::abort();
  }
}

inline void read_result(const std::filesystem::path& file) {
  const model::Model model = results::read_model(file);
  for (int64_t step = 0; step < results::step_count(file); ++step)
    results::read_step(file, step, model);
}

inline void read_line(const std::filesystem::path& file) {
  live::read_request(live::parse_line(content_of(file)));
}

inline std::vector<Target> targets(const std::filesystem::path& folder) {
  using surface::ply_binary;
  const auto surface = [](const auto& file) { surface::read_surface(file); };
  const auto volume = [](const auto& file) { imaging::read_volume(file); };
  const auto landmarks = [](const auto& file) { scene::read_landmarks(file); };
  const auto transform = [](const auto& file) { scene::read_transform(file); };
  const auto slices = [](const auto& file) { imaging::read_volume(file.parent_path()); };
  const auto painting = [](const auto& file) { surface::read_vertex_values(file); };
  const surface::Surface s = tetrahedron();
  const std::vector<std::string> plies = {ply_text(s), ply_binary(s, false), ply_binary(s, true),
                                          painted()};
  const std::vector<std::string> hdf5 = {hdf5_transform(folder / "seed.h5", 1),
                                         hdf5_transform(folder / "seed.h5", 2)};
  return {
      {"scene", "x.yaml", shipped(".yaml"), [](const auto& file) { scene::read_scene(file); }, 0.5},
      {"ply", "x.ply", plies, surface},
      {"stl", "x.stl", {surface::stl_text(s), surface::stl_binary(s)}, surface},
      {"obj", "x.obj", {obj_text(s) + "f -4/1/1 -3//2 -2 -1\n"}, surface},
      {"off", "x.off", {off_text(s), off_binary(s)}, surface},
      {"transform", "x.tfm", transforms(), transform},
      {"markups", "x.mrk.json", shipped(".json"), landmarks, 0.5},
      {"fcsv", "x.fcsv", tables_of_landmarks(), landmarks},
      {"model", "x.h5", models(folder), read_result, 0.1},
      {"meta", "x.mha", metas(), volume},
      {"nrrd", "x.nrrd", nrrds(), volume},
      {"nifti", "x.nii", niftis(), volume},
      {"dicom", "slices/2.dcm", {slice(2)}, slices, 0.2},
      {"hdf5", "x.h5", hdf5, transform, 0.2},
      {"painted", "x.ply", plies, painting},
      {"requests", "x.json", requests(), read_line},
  };
}

/// Adds the files that inputs name, and a slice beside the one that is damaged.
inline void add_neighbors(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(REPOSE_MESHES))
    std::filesystem::create_symlink(entry.path(), folder / entry.path().filename());
  std::filesystem::create_directory(folder / "slices");
  write(folder / "slices/1.dcm", slice(1));
}

}  // namespace repose::fuzz
