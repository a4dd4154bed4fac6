/// repose-register MOVING FIXED: landmark registration of a mesh to another, refined by ICP.
///
///     repose-register scan.ply skin.ply -landmarks scan.mrk.json skin.mrk.json -icp -output scan
///
/// Writes NAME.tfm (ITK and 3D Slicer: applied to MOVING it brings it to FIXED) and NAME.ply, the
/// moved mesh. Landmarks come as LPS from files that say LPS or RAS. Exit status: 0 done, 1 bad
/// input (nothing written), 2 ICP did not converge (written), 3 internal error.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "repose/base/program.h"
#include "repose/base/whole_file.h"
#include "repose/scene/landmarks.h"
#include "repose/scene/transform_file.h"
#include "repose/surface/read.h"
#include "repose/tools/registration/register.h"

namespace {

using namespace repose;
using base::OptionKind;

std::vector<base::Option> option_table() {
  return {
      {.name = "landmarks",
       .kind = OptionKind::path,
       .default_text = "",
       .help = "Landmarks of MOVING and of FIXED (.mrk.json, .fcsv, .csv).",
       .values = 2},
      {.name = "match",
       .kind = OptionKind::choice,
       .default_text = "name",
       .help = "How landmarks are paired: by name or by order.",
       .choices = {"name", "order"}},
      {"similarity", OptionKind::flag, "", "One scale factor too, from the landmarks."},
      {"icp", OptionKind::flag, "", "Refine by iterated closest points, point to plane, rigid."},
      {.name = "trim",
       .kind = OptionKind::number,
       .default_text = "0.8",
       .help = "Share of the pairs of closest points that counts.",
       .range = {.min = 0, .max = 1, .min_excluded = true}},
      {"icp_steps", OptionKind::integer, "100", "Most steps of ICP.",
       base::Range::between(1, 100000)},
      {.name = "output",
       .kind = OptionKind::path,
       .default_text = "registered",
       .help = "Path of the files; .ply or .tfm, where it ends so, is left out.",
       .endings = {".ply", ".tfm"}}};
}

struct Pairs {
  std::vector<std::string> names;
  std::vector<Vec3> moving, fixed;

  void add(const std::string& name, const Vec3& from, const Vec3& to) {
    names.push_back(name);
    moving.push_back(from);
    fixed.push_back(to);
  }
};

Pairs by_name(const std::vector<std::string>& files) {
  Pairs pairs;
  const auto moving = scene::landmarks_by_name(files[0]),
             fixed = scene::landmarks_by_name(files[1]);
  for (const auto& [name, position] : moving)
    if (const auto partner = fixed.find(name); partner != fixed.end())
      pairs.add(name, position, partner->second);
    else
      std::printf("  %s is in %s only: left out\n", name.c_str(), files[0].c_str());
  if (pairs.names.size() < 3)
    base::refuse(
        "{} and {}: {} landmark name(s) in common, three are needed; rename them, or use "
        "-match order if both list the same points in the same order",
        files[0], files[1], pairs.names.size());
  return pairs;
}

Pairs read_pairs(const base::Options& options) {
  const std::vector<std::string> files = options.texts("landmarks");
  if (files.empty()) base::refuse("-landmarks MOVING.mrk.json FIXED.mrk.json is not given");
  if (options.text("match") == "name") return by_name(files);
  const auto moving = scene::read_landmarks(files[0]), fixed = scene::read_landmarks(files[1]);
  if (moving.size() != fixed.size())
    base::refuse("{} has {} landmarks, {} has {}; -match order needs the same points in both",
                 files[0], moving.size(), files[1], fixed.size());
  Pairs pairs;
  for (size_t i = 0; i < moving.size(); ++i)
    pairs.add(moving[i].name, moving[i].position, fixed[i].position);
  return pairs;
}

void print_warnings(const tools::registration::LandmarkFit& fit, const Pairs& pairs) {
  constexpr double largest_rms = 5;  // mm, of landmarks placed well on scans of one head
  if (fit.rms_mirrored < 0.3 * fit.rms_all)
    std::printf(
        "  note: a mirror image fits better (rms %.3g against %.3g mm): left and right are "
        "exchanged in one of the files\n",
        fit.rms_mirrored, fit.rms_all);
  const auto worst = std::max_element(fit.residual.begin(), fit.residual.end());
  if (fit.rms > largest_rms)
    std::printf(
        "  note: rms %.3g mm, expected at most %g mm; %s is farthest off, by %.3g mm: check that "
        "names are not exchanged and that both are scans of one head\n",
        fit.rms, largest_rms, pairs.names[worst - fit.residual.begin()].c_str(), *worst);
  const Mat3& r = fit.transform.rotation;
  if (r(0, 0) < -0.9 && r(1, 1) < -0.9)
    std::printf(
        "  note: the turn is about half a turn about the z axis, as between RAS and LPS; "
        "check that both files state the frame they are in\n");
  if (!fit.can_be_checked)
    std::printf("  note: of three landmarks none can be checked by the others; place more\n");
}

void print(const tools::registration::LandmarkFit& fit, const Pairs& pairs) {
  std::printf("  %-20s %12s %12s\n", "landmark", "residual", "leave-one-out");
  for (size_t i = 0; i < pairs.names.size(); ++i) {
    std::printf("  %-20s %9.3f mm ", pairs.names[i].c_str(), fit.residual[i]);
    if (std::isfinite(fit.predicted[i])) std::printf("%9.3f mm", fit.predicted[i]);
    std::printf("%s\n",
                fit.left_out[i] ? "   left out: too far off for the scatter of the others" : "");
  }
  const auto out = std::count(fit.left_out.begin(), fit.left_out.end(), true);
  std::printf("  rms %.4g mm of %zu landmarks", fit.rms, pairs.names.size() - out);
  if (out > 0) std::printf("; %.4g mm of all with none left out", fit.rms_all);
  std::printf("\n");
  if (fit.transform.scale != 1) std::printf("  scale %.6g\n", fit.transform.scale);
  print_warnings(fit, pairs);
}

base::Exit refine(const base::Options& options, const surface::Surface& moving,
                  const surface::Surface& fixed, tools::registration::Similarity& transform) {
  tools::registration::IcpOptions requested;
  requested.trim = options.number("trim");
  requested.max_steps = static_cast<int>(options.integer("icp_steps"));
  const tools::registration::IcpResult icp =
      tools::registration::refine_by_icp(moving, fixed, transform, requested);
  transform = icp.transform;
  std::printf(
      "  ICP %s after %d step(s): rms %.4g mm point to plane, %.4g mm point to point over "
      "%lld pairs; half of all samples within %.4g mm\n",
      icp.converged ? "converged" : "did not converge", icp.steps, icp.rms_plane, icp.rms,
      static_cast<long long>(icp.pairs), icp.median);
  return icp.converged ? base::Exit::done : base::Exit::not_converged;
}

base::Exit run(const base::Options& options) {
  const auto& files = options.arguments();
  for (const char* ending : {".ply", ".tfm"}) base::reserve_output(options.text("output") + ending);
  const Pairs pairs = read_pairs(options);
  const surface::Surface moving = surface::read_surface(files[0]);
  const surface::Surface fixed = surface::read_surface(files[1]);
  const tools::registration::LandmarkFit fit =
      tools::registration::fit_landmarks(pairs.moving, pairs.fixed, options.flag("similarity"));
  print(fit, pairs);
  const std::string remark = tools::registration::remark_on_distance(
      pairs.names, pairs.moving, moving, pairs.fixed, fixed, fit.transform.scale);
  if (!remark.empty()) std::printf("  note: %s\n", remark.c_str());
  tools::registration::Similarity transform = fit.transform;
  base::Exit exit = base::Exit::done;
  if (options.flag("icp"))
    exit = refine(options, surface::weld_and_orient(moving), surface::weld_and_orient(fixed),
                  transform);
  const std::string name = options.text("output");
  surface::write_ply(name + ".ply", tools::registration::moved(moving, transform));
  scene::write_transform(name + ".tfm", transform.matrix());
  std::printf("  wrote %s.tfm and %s.ply\n", name.c_str(), name.c_str());
  return exit;
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "Landmark registration of a mesh to another, refined by ICP.",
                        {{"MOVING", "the mesh that moves (PLY, STL, OBJ, OFF)"},
                         {"FIXED", "the mesh it is brought to"}},
                        option_table());
  return base::run_serial_program(options, run);
}
