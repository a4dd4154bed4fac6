/// repose-landmarks SKIN: proposes the landmarks of a head from its surfaces.
///
///     repose-landmarks skin.ply -skull skull.ply -mandible mandible.ply -output head
///     repose-landmarks skin.ply -skull skull.ply -mandible mandible.ply -landmarks some.mrk.json
///
/// Writes NAME.mrk.json for 3D Slicer (LPS, mm) and NAME.svg, a picture to confirm them by. The
/// landmarks of -landmarks are kept, all of them, and those that it lacks are proposed. Exit
/// status: 0 done, 1 bad input (nothing written), 2 a landmark that scenes need was not found, 3
/// internal error.
#include <cstdio>

#include "repose/anatomy/picture.h"
#include "repose/anatomy/propose.h"
#include "repose/anatomy/same_head.h"
#include "repose/base/program.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"
#include "repose/scene/landmarks.h"
#include "repose/surface/read.h"

namespace {

using namespace repose;
using base::OptionKind;

std::vector<base::Option> option_table() {
  return {{"skull", OptionKind::path, "", "Surface of the skull without the mandible; required."},
          {"mandible", OptionKind::path, "", "Surface of the mandible; required."},
          {"landmarks", OptionKind::path, "",
           "Landmarks that are known (.mrk.json, .fcsv, .csv, .json): kept, and compared with."},
          {.name = "output",
           .kind = OptionKind::path,
           .default_text = "landmarks",
           .help = "Path of the files; .mrk.json, where it ends so, is left out.",
           .endings = {".mrk.json"}}};
}

/// Landmarks without which a scene gets neither the parting of the lips nor a vestibule nor a
/// hinge.
constexpr const char* needed[] = {"condyle_right_center", "condyle_left_center",
                                  "upper_incisor_edge",   "lower_incisor_edge",
                                  "nasal_spine",          "b_point",
                                  "mouth_right",          "mouth_left"};

surface::Surface read(const base::Options& options, const char* name) {
  if (!options.has(name)) base::refuse("-{} FILE is required: the surface of the {}", name, name);
  return surface::read_surface(options.text(name));
}

/// Refuses a pair of which the left one lies to the right of the other.
void require_sides(const scene::Landmarks& given, const anatomy::HeadFrame& frame,
                   const std::string& file) {
  for (const auto& [right, left] : {std::pair{"condyle_right_center", "condyle_left_center"},
                                    {"gonion_right", "gonion_left"},
                                    {"mouth_right", "mouth_left"}}) {
    const Vec3 *one = scene::find(given, right), *other = scene::find(given, left);
    if (!one || !other) continue;
    const double apart = frame.to_frame(*other).x() - frame.to_frame(*one).x();
    if (apart < 0)
      base::refuse("{}: {} lies {:.0f} mm to the patient's right of {}: they are exchanged", file,
                   left, -apart, right);
  }
}

void print_landmarks(const anatomy::Proposal& proposal, const anatomy::Proposal& alone,
                     const scene::Landmarks& given) {
  std::printf("%-24s %10s %10s %10s   %s\n", "landmark, mm", "x", "y", "z", "");
  double sum = 0, maximum = 0;
  int count = 0;
  for (const scene::LandmarkName& landmark : scene::landmark_names()) {
    const auto found = proposal.found.find(landmark.name);
    if (found == proposal.found.end()) {
      std::printf("%-24s %32s   not found: %s\n", landmark.name.c_str(), "",
                  proposal.missing.at(landmark.name).c_str());
      continue;
    }
    std::string note;
    if (const auto own = alone.found.find(landmark.name);
        given.contains(landmark.name) && own != alone.found.end()) {
      const double off = (own->second - found->second).norm();
      note = fmt::format("given; proposed {:.1f} mm from it", off);
      sum += off;
      maximum = std::max(maximum, off);
      ++count;
    } else if (given.contains(landmark.name)) {
      note = "given";
    }
    const Vec3& at = found->second;
    std::printf("%-24s %10.2f %10.2f %10.2f   %s\n", landmark.name.c_str(), at.x(), at.y(), at.z(),
                note.c_str());
  }
  for (const auto& [name, at] : given)
    if (scene::standard_name(name).empty()) {
      const std::string meant = scene::misspelled_name(name, given);
      std::printf("%-24s %10.2f %10.2f %10.2f   given", base::quote(name).c_str(), at.x(), at.y(),
                  at.z());
      if (!meant.empty()) std::printf(", under no standard name; did you mean %s?", meant.c_str());
      std::printf("\n");
    }
  if (count > 0)
    std::printf(
        "%d given landmarks: proposed at a distance of %.2f mm in the mean, %.2f mm at most\n",
        count, sum / count, maximum);
}

base::Exit run(const base::Options& options) {
  const std::string name = options.text("output");
  for (const char* ending : {".mrk.json", ".svg"}) base::reserve_output(name + ending);
  const surface::Surface skull = read(options, "skull"), mandible = read(options, "mandible"),
                         skin = surface::read_surface(options.arguments()[0]);
  scene::Landmarks given;
  if (options.has("landmarks")) {
    const std::string file = options.text("landmarks");
    given = scene::with_standard_names(scene::landmarks_by_name(file), file);
    anatomy::require_same_head(given, file, skin, {skull, mandible});
  }
  const anatomy::Proposal alone = anatomy::propose_landmarks(skin, skull, mandible, {});
  if (!given.empty()) require_sides(given, alone.frame, options.text("landmarks"));
  const anatomy::Proposal proposal =
      given.empty() ? alone : anatomy::propose_landmarks(skin, skull, mandible, given);
  print_landmarks(proposal, alone, given);
  for (const std::string& remark : proposal.remarks) std::printf("remark: %s\n", remark.c_str());
  base::write_whole_file(name + ".mrk.json", scene::markups_text(proposal.found));
  base::write_whole_file(name + ".svg", anatomy::draw_landmarks(skin, skull, mandible, proposal));
  std::printf("wrote %s.mrk.json and %s.svg: check the picture before you use them\n", name.c_str(),
              name.c_str());
  for (const char* name : needed)
    if (proposal.missing.contains(name)) return base::Exit::not_converged;
  return base::Exit::done;
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "Proposes the landmarks of a head from its surfaces.",
                        {{"SKIN", "a triangle mesh of the skin: PLY, STL, OBJ or OFF, mm, LPS"}},
                        option_table());
  return base::run_serial_program(options, run);
}
