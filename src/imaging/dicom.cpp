#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "stored_bytes.h"
#include "volume_grid.h"

namespace repose::imaging {
namespace {

struct DicomSlice {
  std::filesystem::path file;
  Image header;
  Mat3 axes;  ///< mm; of a single slice the third column means nothing
  Vec3 origin;

  int64_t frames() const { return header.size.size() > 2 ? header.size[2] : 1; }
};

DicomSlice describe(const std::filesystem::path& file) {
  DicomSlice slice{file, read_header(file, ImageFormat::dicom), {}, {}};
  if (slice.header.numbers != 1)
    base::refuse("{}: is a color picture, not a slice; move it elsewhere", file.string());
  if (slice.frames() == 1) slice.header.spacing[2] = 1;
  slice.axes = axes_of(slice.header, file.string());
  slice.origin = Vec3::Map(slice.header.origin.data());
  return slice;
}

/// Files that are DICOM images; others (DICOMDIR, reports, licenses) are passed over.
std::vector<DicomSlice> find_slices(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<DicomSlice> slices;
  for (const auto& file : files) {
    check_dicom_lengths(file);
    if (file.filename() != "DICOMDIR" && is_dicom(file)) slices.push_back(describe(file));
  }
  if (slices.empty())
    base::refuse("{}: holds no DICOM slice (subfolders are not searched); name the series' folder",
                 folder.string());
  return slices;
}

void check_one_series(const std::vector<DicomSlice>& slices, const std::string& folder) {
  std::map<std::string, std::pair<std::string, int>> series;
  for (const DicomSlice& slice : slices) {
    series[slice.header.series].first = slice.header.title;
    ++series[slice.header.series].second;
  }
  if (series.size() == 1) return;
  std::string list;
  for (const auto& [number, entry] : series)
    list += fmt::format("{}{} ({} slices)", list.empty() ? "" : ", ", base::quote(entry.first),
                        entry.second);
  base::refuse("{}: holds {} series: {}; put the slices of one into a folder of its own", folder,
               series.size(), list);
}

void check_alike(const std::vector<DicomSlice>& slices) {
  const DicomSlice& first = slices.front();
  const std::string name = first.file.filename().string();
  for (const DicomSlice& slice : slices) {
    if (slice.header.size != first.header.size)
      base::refuse("{}: has {} pixels, {} has {}; slices of one series must be alike",
                   slice.file.string(), fmt::join(slice.header.size, " × "), name,
                   fmt::join(first.header.size, " × "));
    const double off = (slice.axes - first.axes).leftCols<2>().cwiseAbs().maxCoeff();
    if (!(off < 1e-3 * first.axes.col(0).norm()))
      base::refuse("{}: is turned or scaled otherwise than {} (a localiser?); move it elsewhere",
                   slice.file.string(), name);
  }
}

/// Slices must be as far apart as most are, to a hundredth of that or of a millimeter.
void check_steps(const std::vector<DicomSlice>& slices, const Vec3& normal) {
  std::vector<double> steps;
  for (size_t s = 1; s < slices.size(); ++s)
    steps.push_back((slices[s].origin - slices[s - 1].origin).dot(normal));
  const double usual = base::median(steps), allowed = std::max(0.01 * usual, 0.01);
  for (size_t s = 0; s < steps.size(); ++s) {
    const std::string from = slices[s].file.string(), to = slices[s + 1].file.filename().string();
    if (steps[s] < allowed)
      base::refuse("{}: lies where {} lies; remove one of the two slices", from, to);
    if (std::abs(steps[s] - usual) <= allowed) continue;
    const double missing = std::round(steps[s] / usual) - 1;
    base::refuse("{}: {:.4g} mm to the next slice, {}, where others are {:.4g} mm apart: {}", from,
                 steps[s], to, usual,
                 missing > 0 ? fmt::format("{:g} missing; copy the whole series", missing)
                             : "unevenly scanned; resample it to even slices");
  }
}

/// All slices follow one another by the same vector, which is returned; a tilted gantry makes it
/// lean against their normal.
Vec3 common_step(const std::vector<DicomSlice>& slices) {
  const Vec3 first = slices.front().origin;
  Vec3 step = (slices.back().origin - first) / static_cast<double>(slices.size() - 1);
  for (size_t s = 0; s < slices.size(); ++s) {
    const double off = (slices[s].origin - first - static_cast<double>(s) * step).norm();
    if (off > 0.05 * std::max(step.norm(), slices[s].axes.col(0).norm()))
      base::refuse("{}: lies {:.3g} mm beside the row of the others; the series is not one scan",
                   slices[s].file.string(), off);
  }
  return step;
}

}  // namespace

Volume read_dicom(const std::filesystem::path& folder, const Watch& watch) {
  std::vector<DicomSlice> slices = find_slices(folder);
  check_one_series(slices, folder.string());
  const DicomSlice first = slices.front();
  const int64_t count = std::ssize(slices), frames = first.frames();
  if ((count == 1) == (frames == 1))
    base::refuse("{}: holds {} file(s) of {} slice(s); a volume is one series of slices",
                 folder.string(), count, frames);
  check_alike(slices);
  const Vec3 normal = first.axes.col(0).cross(first.axes.col(1)).normalized();
  std::ranges::sort(slices, {}, [&](const DicomSlice& s) { return s.origin.dot(normal); });
  Volume volume{folder.string(),
                {first.header.size[0], first.header.size[1], count * frames},
                first.axes,
                slices.front().origin,
                {},
                {}};
  if (count > 1) {
    check_steps(slices, normal);
    volume.axes.col(2) = common_step(slices);
  }
  for (int64_t s = 0; s < count; ++s) {
    check_stored_bytes(slices[s].file, ImageFormat::dicom, slices[s].header);
    const auto values = read_image(slices[s].file, ImageFormat::dicom).values;
    volume.values.insert(volume.values.end(), values.begin(), values.end());
    if (watch) watch(static_cast<double>(s + 1) / static_cast<double>(count));
  }
  return volume;
}

}  // namespace repose::imaging
