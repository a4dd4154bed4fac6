/// repose-compare PREDICTED ACTUAL: how far a predicted surface lies from a real one.
///
///     repose-compare predicted.ply postoperative.ply
///     repose-compare predicted.ply postoperative.ply -both -regions labels.nii.gz -output compared
///     repose-compare predicted.ply postoperative.ply -landmarks face.mrk.json -radius 20
///
/// Distances are positive where PREDICTED lies in front of ACTUAL (outside it), weighted by area.
/// Writes NAME.vtp, PREDICTED coloured by them, and NAME.csv, their histogram, which
/// drivers/plot_compare.py draws. Exit status: 0 done, 1 bad input (nothing written), 3 internal
/// error.
#include <cmath>
#include <cstdio>
#include <map>

#include "repose/base/agreement.h"
#include "repose/base/program.h"
#include "repose/base/progress.h"
#include "repose/base/whole_file.h"
#include "repose/scene/landmarks.h"
#include "repose/surface/compare.h"
#include "repose/surface/read.h"
#include "repose/surface/write.h"

namespace {

using namespace repose;
using base::OptionKind;
using surface::Sample;

std::vector<base::Option> option_table() {
  const base::Range length{1e-3, 1000};
  return {
      {"both", OptionKind::flag, "", "Also from ACTUAL to PREDICTED."},
      {"spacing", OptionKind::number, "1", "Longest side of the parts measured.", length, "MM"},
      {"skip_rim", OptionKind::flag, "", "Leave out what lies beyond the rim of an open surface."},
      {"regions", OptionKind::path, "", "Label map: numbers for each label on their own, too."},
      {"landmarks", OptionKind::path, "", "Numbers around each landmark (.mrk.json, .fcsv, .csv)."},
      {"radius", OptionKind::number, "15", "How far around a landmark.", length, "MM"},
      {"reach",
       OptionKind::number,
       "auto",
       "Distance of full colour and the histogram's ends.",
       length,
       "MM",
       {"auto"}},
      {"output", OptionKind::path, "compared", "Path of the files without ending."}};
}

void print_header() {
  std::printf("%-28s %10s %8s %8s %8s %8s %8s %8s\n", "distances in mm", "samples", "signed",
              "mean", "rms", "90 %", "95 %", "max");
}

void print_row(const std::string& name, const std::vector<Sample>& samples) {
  const auto s = surface::statistics(samples);
  std::printf("%-28s %10lld %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f\n", name.c_str(),
              static_cast<long long>(s.samples), s.mean_signed, s.mean, s.rms, s.percentile_90,
              s.percentile_95, s.most);
}

/// The label at the nearest voxel; 0 outside the map.
int64_t label_at(const surface::Volume& labels, const Mat3& to_index, const Vec3& point) {
  const Vec3 index = to_index * (point - labels.origin);
  std::array<int64_t, 3> at;
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = std::llround(index[axis]);
    if (at[axis] < 0 || at[axis] >= labels.size[axis]) return 0;
  }
  return static_cast<int64_t>(labels.at(at[0], at[1], at[2]));
}

void print_regions(const std::string& file, const std::vector<Sample>& samples) {
  const surface::Volume labels = surface::read_volume(file);
  const Mat3 to_index = surface::inverse_axes(labels);
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

/// Distances one way, with a row of the table.
std::vector<Sample> measure(const base::Options& options, const surface::Surface& from,
                            const surface::SignedDistance& to, const std::string& name) {
  base::Progress progress(MPI_COMM_WORLD);
  auto samples = surface::sample_distances(from, to, options.number("spacing"),
                                           [&](double done) { progress.show(name, done); });
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
                   const surface::SignedDistance& to, const std::vector<Sample>& samples,
                   double reach) {
  surface::PointData data;
  data.fields.push_back({"distance", {}});
  for (const Vec3& point : predicted.points) {
    data.fields[0].values.push_back(to.at(point).distance);
    data.colours.push_back(surface::distance_colour(data.fields[0].values.back(), reach));
  }
  surface::write_surface(name + ".vtp", predicted, data);
  base::write_whole_file(name + ".csv", histogram(samples, reach));
  std::printf("wrote %s.vtp (blue −%.3g mm, red +%.3g mm) and %s.csv\n", name.c_str(), reach, reach,
              name.c_str());
}

void run(const base::Options& options) {
  const surface::Surface predicted = surface::read_surface(options.arguments()[0]);
  const surface::Surface actual = surface::read_surface(options.arguments()[1]);
  const surface::SignedDistance to_actual(actual);
  print_header();
  const auto samples = measure(options, predicted, to_actual, "PREDICTED to ACTUAL");
  if (options.has("regions")) print_regions(options.text("regions"), samples);
  if (options.has("landmarks"))
    print_landmarks(options.text("landmarks"), options.number("radius"), samples);
  if (options.flag("both"))
    measure(options, actual, surface::SignedDistance(predicted), "ACTUAL to PREDICTED");
  const double widest = std::max(surface::statistics(samples).percentile_95, 1e-3);
  const double reach = options.text("reach") == "auto" ? widest : options.number("reach");
  write_results(options.text("output"), predicted, to_actual, samples, reach);
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "How far a predicted surface lies from a real one.",
                        {{"PREDICTED", "a triangle mesh: PLY, STL, OBJ or OFF, in mm"},
                         {"ACTUAL", "the same, what it is compared with"}},
                        option_table());
  return base::run_program(options, [&] {
    base::on_first_rank(MPI_COMM_WORLD, [&] { run(options); });
    return base::Exit::done;
  });
}
