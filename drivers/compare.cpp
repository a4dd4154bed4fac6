/// repose-compare PREDICTED ACTUAL: how far a predicted surface lies from a real one.
///
///     repose-compare predicted.ply postoperative.ply
///     repose-compare predicted.ply postoperative.ply -both -regions labels.nii.gz -output compared
///     repose-compare predicted.ply postoperative.ply -landmarks face.mrk.json -radius 20
///     repose-compare predicted.ply scan.ply -register upper -parts -landmarks face.mrk.json
///         -actual_landmarks scan.mrk.json
///
/// The last is the scorecard of a prediction: the scan is brought to it by what no surgery moved,
/// then come the parts of the face and the landmarks. Distances are positive where PREDICTED lies
/// in front of ACTUAL (outside it), weighted by area. Writes NAME.vtp, PREDICTED colored by them,
/// and NAME.csv, their histogram, which drivers/plot_compare.py draws. Exit status: 0 done, 1 bad
/// input (nothing written), 3 internal error.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "repose/base/log.h"
#include "repose/base/program.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"
#include "repose/scene/landmarks.h"
#include "repose/scene/placement.h"
#include "repose/surface/component.h"
#include "repose/surface/defects.h"
#include "repose/surface/edges.h"
#include "repose/surface/read.h"
#include "repose/surface/write.h"
#include "repose/tools/comparison/compare.h"
#include "repose/tools/comparison/face_parts.h"
#include "repose/tools/comparison/paint.h"
#include "repose/tools/registration/register.h"

namespace {

using namespace repose;
using base::OptionKind;
using tools::comparison::Sample;

std::vector<base::Option> option_table() {
  const base::Range length{1e-3, 1000};
  return {
      {"both", OptionKind::flag, "", "Also from ACTUAL to PREDICTED."},
      {"spacing", OptionKind::number, "1", "Longest side of the parts measured.", length, "MM"},
      {"skip_rim", OptionKind::flag, "", "Leave out what lies beyond the rim of an open surface."},
      {"regions", OptionKind::path, "",
       "Label map, or painted PLY of the skin: numbers for each label or color on their own, too."},
      {"landmarks", OptionKind::path, "",
       "Landmarks of PREDICTED (.mrk.json, .fcsv, .csv): numbers around each."},
      {"actual_landmarks", OptionKind::path, "",
       "Those of ACTUAL: how far apart landmarks of one name are."},
      {"parts", OptionKind::flag, "", "Numbers for nose, lips, chin and cheeks, by -landmarks."},
      {.name = "register",
       .kind = OptionKind::choice,
       .default_text = "none",
       .help = "Bring ACTUAL to PREDICTED first: by all of it, or by what lies above subnasale.",
       .choices = {"none", "all", "upper"}},
      {"radius", OptionKind::number, "15", "How far around a landmark.", length, "MM"},
      {.name = "reach",
       .kind = OptionKind::number,
       .default_text = "auto",
       .help = "Distance of full color and the histogram's ends.",
       .range = length,
       .unit = "MM",
       .choices = {"auto"}},
      {.name = "output",
       .kind = OptionKind::path,
       .default_text = "compared",
       .help = "Path of the files; .vtp or .csv, where it ends so, is left out.",
       .endings = {".vtp", ".csv"}}};
}

void print_header() {
  std::printf("%-28s %10s %8s %8s %8s %8s %8s %8s %8s %8s %8s\n", "distances in mm", "samples",
              "signed", "mean", "rms", "median", "90 %", "95 %", "max", "% <= 1", "% <= 2");
}

/// A row of the table; without samples, as of a landmark beyond the skin, their number alone.
void print_row(const std::string& name, const std::vector<Sample>& samples) {
  if (samples.empty()) {
    std::printf("%-28s %10d %8s\n", name.c_str(), 0, "-");
    return;
  }
  const auto s = tools::comparison::statistics(samples);
  std::printf("%-28s %10lld %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f %8.1f %8.1f\n", name.c_str(),
              static_cast<long long>(s.samples), s.mean_signed, s.mean, s.rms, s.median,
              s.percentile_90, s.percentile_95, s.maximum, 100 * s.within_1, 100 * s.within_2);
}

/// The label at the nearest voxel; 0 outside the map.
int64_t label_at(const imaging::Volume& labels, const Mat3& to_index, const Vec3& point) {
  const Vec3 index = to_index * (point - labels.origin);
  std::array<int64_t, 3> at;
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = std::llround(index[axis]);
    if (at[axis] < 0 || at[axis] >= labels.size[axis]) return 0;
  }
  return static_cast<int64_t>(labels.at(at[0], at[1], at[2]));
}

void print_painted(const std::string& file, const std::vector<Sample>& samples) {
  const tools::comparison::Paint paint(file);
  std::vector<std::vector<Sample>> regions(paint.names().size());
  for (const Sample& sample : samples)
    if (const int row = paint.at(sample.point); row >= 0) regions[row].push_back(sample);
  for (size_t row = 0; row < regions.size(); ++row)
    print_row("  " + paint.names()[row], regions[row]);
}

void print_regions(const std::string& file, const std::vector<Sample>& samples) {
  if (base::lower(file).ends_with(".ply")) return print_painted(file, samples);
  const imaging::Volume labels = imaging::read_volume(file);
  const Mat3 to_index = imaging::inverse_axes(labels);
  std::map<int64_t, std::vector<Sample>> regions;
  for (const Sample& sample : samples)
    regions[label_at(labels, to_index, sample.point)].push_back(sample);
  for (const auto& [label, part] : regions) print_row(fmt::format("  label {}", label), part);
}

void print_landmarks(const std::string& file, double radius, const std::vector<Sample>& samples) {
  for (const scene::Landmark& landmark : scene::read_landmarks(file)) {
    std::vector<Sample> near;
    for (const Sample& sample : samples)
      if ((sample.point - landmark.position).norm() <= radius) near.push_back(sample);
    print_row("  " + landmark.name, near);
  }
}

void print_parts(const tools::comparison::FaceParts& parts, const std::vector<Sample>& samples) {
  std::map<std::string, std::vector<Sample>> regions;
  for (const Sample& sample : samples) regions[parts.at(sample.point)].push_back(sample);
  for (const char* name : {"nose", "upper lip", "lower lip", "chin", "left cheek", "right cheek"})
    print_row(std::string("  ") + name, regions[name]);
}

/// The triangles whose vertices all lie above a height.
surface::Surface above(const surface::Surface& whole, double height) {
  std::vector<Triangle> triangles = whole.triangles;
  std::erase_if(triangles, [&](const Triangle& t) {
    return std::any_of(t.begin(), t.end(), [&](auto v) { return whole.points[v].z() <= height; });
  });
  return surface::compact(whole.name, whole.points, std::move(triangles));
}

using Marks = std::map<std::string, Vec3>;

/// Fits the landmarks of ACTUAL to those of PREDICTED; empty where fewer than three agree.
base::Similarity by_landmarks(const surface::Surface& actual, const surface::Surface& predicted,
                              const Marks& marks, const Marks& actual_marks) {
  std::vector<std::string> names;
  std::vector<Vec3> moving, fixed;
  for (const auto& [name, position] : actual_marks)
    if (const auto found = marks.find(name); found != marks.end()) {
      names.push_back(name);
      moving.push_back(position);
      fixed.push_back(found->second);
    }
  if (moving.size() < 3) return {};
  const std::string remark =
      tools::registration::remark_on_distance(names, moving, actual, fixed, predicted, 1);
  if (!remark.empty()) std::printf("note: %s\n", remark.c_str());
  return tools::registration::fit_landmarks(moving, fixed, false).transform;
}

base::Similarity bring(const base::Options& options, const surface::Surface& actual,
                       const surface::Surface& predicted, const Marks& marks,
                       const Marks& actual_marks) {
  const base::Similarity start = by_landmarks(actual, predicted, marks, actual_marks);
  surface::Surface moving = surface::weld_and_orient(tools::registration::moved(actual, start));
  surface::Surface fixed = surface::weld_and_orient(predicted);
  if (options.text("register") == "upper") {
    const double height =
        tools::comparison::FaceParts(marks, options.text("landmarks")).upper_face();
    moving = above(moving, height);
    fixed = above(fixed, height);
  }
  const tools::registration::IcpResult icp =
      tools::registration::refine_by_icp(moving, fixed, {}, {});
  std::printf("ACTUAL is brought to PREDICTED (%s): rms %.4g mm over the nearest %lld vertices\n",
              icp.converged ? "converged" : "NOT CONVERGED", icp.rms_plane,
              static_cast<long long>(icp.pairs));
  return icp.transform.after(start);
}

/// Prints the distances of vertices where both have the same triangles, so that each vertex stands
/// for one place of the skin. Their sign is that of the side of ACTUAL on which PREDICTED lies.
void print_vertices(const surface::Surface& predicted, const surface::Surface& actual,
                    const meshtools::SignedDistance& to_actual) {
  if (predicted.triangles != actual.triangles || predicted.points.size() != actual.points.size())
    return;
  std::vector<bool> used(actual.points.size(), false);
  for (const Triangle& triangle : actual.triangles)
    for (const int64_t vertex : triangle) used[vertex] = true;
  std::vector<Sample> apart;
  for (size_t i = 0; i < actual.points.size(); ++i) {
    if (!used[i]) continue;
    const Vec3& point = predicted.points[i];
    const double distance = (point - actual.points[i]).norm();
    apart.push_back({point, 1, std::copysign(distance, to_actual.at(point).distance), false});
  }
  print_row("corresponding vertices", apart);
}

/// From each landmark of ACTUAL to that of PREDICTED.
void print_pairs(const Marks& predicted, const Marks& actual, const base::Similarity& brought) {
  std::printf("%-28s %10s %10s %10s %10s\n", "predicted - actual, mm", "distance", "forward",
              "left", "up");
  for (const auto& [name, position] : predicted)
    if (const auto found = actual.find(name); found != actual.end()) {
      const Vec3 off = position - brought.apply(found->second);
      std::printf("  %-26s %10.3f %10.3f %10.3f %10.3f\n", name.c_str(), off.norm(), -off.y(),
                  off.x(), off.z());
    }
}

Marks marks_of(const base::Options& options, const char* name) {
  return options.has(name) ? scene::landmarks_by_name(options.text(name)) : Marks{};
}

void require_landmarks(const base::Options& options) {
  const bool named = options.has("landmarks");
  if (options.flag("parts") && !named)
    base::refuse("-parts needs -landmarks, which define the parts of the face");
  if (options.has("actual_landmarks") && !named)
    base::refuse("-actual_landmarks needs -landmarks, those of PREDICTED");
  if (options.text("register") == "upper" && !named)
    base::refuse("-register upper needs -landmarks with subnasale; or take -register all");
}

/// Distances one way, with a row of the table.
std::vector<Sample> measure(const base::Options& options, const surface::Surface& from,
                            const meshtools::SignedDistance& to, const std::string& name) {
  base::Progress progress(MPI_COMM_WORLD);
  auto samples = tools::comparison::sample_distances(
      from, to, options.number("spacing"), [&](double done) { progress.show(name, done); });
  progress.clear();
  if (options.flag("skip_rim"))
    std::erase_if(samples, [](const Sample& sample) { return sample.beyond_rim; });
  if (samples.empty())
    base::refuse("{}: all of it lies beyond the rim of the other surface; leave out -skip_rim",
                 from.name);
  print_row(name, samples);
  return samples;
}

std::string histogram(const std::vector<Sample>& samples, double reach) {
  constexpr int bins = 100;
  std::vector<double> share(bins, 0);
  double area = 0;
  for (const Sample& sample : samples) {
    const double at = (sample.distance + reach) / (2 * reach) * bins;
    share[static_cast<int>(std::clamp(at, 0.0, bins - 1.0))] += sample.area;
    area += sample.area;
  }
  std::string text = "low_mm,high_mm,share_of_area\n";
  for (int b = 0; b < bins; ++b)
    text += fmt::format("{:.6g},{:.6g},{:.6g}\n", reach * (2.0 * b / bins - 1),
                        reach * (2.0 * (b + 1) / bins - 1), share[b] / area);
  return text;
}

void write_results(const std::string& name, const surface::Surface& predicted,
                   const meshtools::SignedDistance& to, const std::vector<Sample>& samples,
                   double reach) {
  surface::PointData data;
  data.fields.push_back({"distance", {}});
  for (const Vec3& point : predicted.points) {
    data.fields[0].values.push_back(to.at(point).distance);
    data.colors.push_back(tools::comparison::distance_color(data.fields[0].values.back(), reach));
  }
  surface::write_surface(name + ".vtp", predicted, data);
  base::write_whole_file(name + ".csv", histogram(samples, reach));
  std::printf("wrote %s.vtp (blue −%.3g mm, red +%.3g mm) and %s.csv\n", name.c_str(), reach, reach,
              name.c_str());
}

void turn(surface::Surface& surface, const std::string& file) {
  for (Triangle& triangle : surface.triangles) std::swap(triangle[1], triangle[2]);
  std::printf("note: triangles of %s point inward; they are turned\n", file.c_str());
}

/// Reads a surface and gives its triangles the same vertices where these coincide; the triangles of
/// one that is closed and faces inward are turned, with a note.
surface::Surface read_facing_outward(const std::string& file) {
  surface::Surface surface = surface::welded(surface::read_surface(file));
  const surface::Defects defects = surface::inspect(surface, false);
  if (defects.border_edges > 0 || defects.misoriented_edges > 0 || surface::volume_of(surface) >= 0)
    return surface;
  turn(surface, file);
  return surface;
}

/// Mean cosine, by area, between the normals of triangles and the ways to them from the middle of
/// all: 1 of a sphere, above 0 of the outside of a face.
double outwardness(const surface::Surface& surface) {
  const Vec3 middle = scene::centroid(surface.points, surface.triangles);
  double sum = 0, area = 0;
  for (const Triangle& triangle : surface.triangles) {
    const auto corners = surface::corners(surface, triangle);
    const Vec3 normal = surface::scaled_normal(corners),
               way = (corners[0] + corners[1] + corners[2]) / 3 - middle;
    if (way.norm() > 0) sum += normal.dot(way.normalized());
    area += normal.norm();
  }
  return sum / area;
}

/// Turns the triangles of one of two surfaces, of which the other faces outward, with a note.
void turn_opposed(surface::Surface& first, surface::Surface& second,
                  const std::vector<std::string>& files) {
  constexpr double clear = 0.1;  // more than of a flat surface
  const double of_first = outwardness(first), of_second = outwardness(second);
  if (of_first < -clear && of_second > clear) turn(first, files[0]);
  if (of_second < -clear && of_first > clear) turn(second, files[1]);
}

/// Refuses surfaces of which one must be in another unit.
void check_sizes(const surface::Surface& predicted, const surface::Surface& actual,
                 const std::vector<std::string>& files) {
  constexpr double largest = 100;
  const double ratio = surface::bounding_box(actual.points).diagonal().norm() /
                       surface::bounding_box(predicted.points).diagonal().norm();
  if (!(ratio >= 1 / largest && ratio <= largest))
    base::refuse(
        "{} is {:.4g} times as large as {}, expected {:g} to {:g} times: one of them is not in mm; "
        "scale it",
        files[1], ratio, files[0], 1 / largest, largest);
}

void run(const base::Options& options) {
  require_landmarks(options);
  for (const char* ending : {".vtp", ".csv"}) base::reserve_output(options.text("output") + ending);
  surface::Surface predicted = read_facing_outward(options.arguments()[0]);
  surface::Surface actual = read_facing_outward(options.arguments()[1]);
  check_sizes(predicted, actual, options.arguments());
  turn_opposed(predicted, actual, options.arguments());
  const Marks marks = marks_of(options, "landmarks"),
              actual_marks = marks_of(options, "actual_landmarks");
  base::Similarity brought;
  if (options.text("register") != "none") {
    brought = bring(options, actual, predicted, marks, actual_marks);
    actual = tools::registration::moved(actual, brought);
  }
  const meshtools::SignedDistance to_actual(actual);
  print_header();
  const auto samples = measure(options, predicted, to_actual, "PREDICTED to ACTUAL");
  print_vertices(predicted, actual, to_actual);
  if (options.flag("parts"))
    print_parts(tools::comparison::FaceParts(marks, options.text("landmarks")), samples);
  if (options.has("regions")) print_regions(options.text("regions"), samples);
  if (options.has("landmarks"))
    print_landmarks(options.text("landmarks"), options.number("radius"), samples);
  if (options.flag("both"))
    measure(options, actual, meshtools::SignedDistance(predicted), "ACTUAL to PREDICTED");
  if (!actual_marks.empty()) print_pairs(marks, actual_marks, brought);
  const double widest = std::max(tools::comparison::statistics(samples).percentile_95, 1e-3);
  const double reach = options.text("reach") == "auto" ? widest : options.number("reach");
  write_results(options.text("output"), predicted, to_actual, samples, reach);
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "How far a predicted surface lies from a real one.",
                        {{"PREDICTED", "a triangle mesh: PLY, STL, OBJ or OFF, in mm"},
                         {"ACTUAL", "the same, what it is compared with"}},
                        option_table());
  return base::run_serial_program(options, run);
}
