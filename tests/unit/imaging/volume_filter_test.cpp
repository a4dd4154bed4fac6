#include "repose/imaging/volume_filter.h"

#include <Eigen/Geometry>

#include "../surface/shapes.h"
#include "repose/imaging/extract.h"
#include "repose/surface/component.h"
#include "repose/surface/defects.h"
#include "volumes.h"

namespace repose::imaging {
using namespace surface;
namespace volume_filter_test {

TEST(VolumeFilter, otsu_parts_two_heaps) {
  const Volume volume = sampled(20, Mat3::Identity(), [](const Vec3& p) {
    const double ripple = 20 * std::sin(5 * p.x() + 3 * p.y() + p.z());
    return (p.norm() < 7 ? 300 : -900) + ripple;
  });
  EXPECT_GT(otsu_level(volume), -880);
  EXPECT_LT(otsu_level(volume), 280);
  const Volume flat = sampled(3, Mat3::Identity(), [](const Vec3&) { return 4; });
  EXPECT_NE(refusal([&] { otsu_level(flat); }).find("every value is 4"), std::string::npos);
}

TEST(VolumeFilter, otsu_takes_the_voxels_in_an_oblique_box_only) {
  const Mat3 turned = Eigen::AngleAxisd(0.35, Vec3::UnitZ()).toRotationMatrix();
  const Volume volume = sampled(30, turned, [](const Vec3& p) {
    return p.norm() < 4 ? 300 : p.cwiseAbs().maxCoeff() < 7 ? -900 : 3000;
  });
  Extraction requested;
  requested.otsu = true;
  requested.box = {Vec3::Constant(-6), Vec3::Constant(6)};
  const double level = extract(volume, requested).level;
  EXPECT_GT(level, -900);
  EXPECT_LT(level, 300);
}

TEST(VolumeFilter, crop_keeps_every_voxel_in_its_place) {
  const Mat3 axes = Vec3(1, 2, 3).asDiagonal();
  const auto code = [](const Vec3& p) { return p.x() + 100 * p.y() + 10000 * p.z(); };
  const Volume part = crop(sampled(9, axes, code), {-2.5, -4, 1}, {1, 100, 7});
  EXPECT_EQ(part.size, (std::array<int64_t, 3>{5, 7, 4})) << "the smallest block that holds it";
  for (int64_t k = 0; k < part.size[2]; ++k) {
    const Vec3 place = part.origin + axes * Vec3(1, 2, static_cast<double>(k));
    EXPECT_EQ(part.at(1, 2, k), code(place));
  }
  EXPECT_NE(refusal([&] {
              crop(part, {50, 50, 50}, {60, 60, 60});
            }).find("lies beside it"),
            std::string::npos);
}

/// A slab whose surface crosses the sides of a box, in volumes along the axes, turned and sheared.
TEST(VolumeFilter, a_box_is_one_along_x_y_and_z_in_oblique_volumes_too) {
  Mat3 sheared = Mat3::Identity();
  sheared(1, 2) = 0.5;
  const Mat3 turned = Eigen::AngleAxisd(0.35, Vec3::UnitZ()).toRotationMatrix();
  const Vec3 low(-8, -7, -6), high(9, 6, 7);
  for (const Mat3& axes : {Mat3(Mat3::Identity()), turned, sheared})
    for (const VolumeBorder border : {VolumeBorder::closed, VolumeBorder::open}) {
      Extraction requested;
      requested.level = 0;
      requested.box = {low, high};
      requested.border = border;
      const Volume volume =
          sampled(60, axes, [](const Vec3& p) { return 3.25 - std::abs(p.x() - 0.3 * p.z()); });
      const Extracted result = extract(volume, requested);
      const Defects defects = inspect(result.surface, false);
      EXPECT_EQ(defects.border_edges == 0, border == VolumeBorder::closed);
      EXPECT_EQ(defects.components, border == VolumeBorder::closed ? 1 : 2);
      EXPECT_EQ(defects.isolated_vertices + defects.non_manifold_vertices, 0);
      const Mat3 steps = axes.cwiseAbs();
      const Vec3 voxel = steps.rowwise().sum();
      Vec3 margin;  // a voxel where the block is along the axis, else the nearest that a vertex is
      for (int axis = 0; axis < 3; ++axis)
        margin[axis] = voxel[axis] > steps.row(axis).maxCoeff() ? 0.01 : 1;
      Vec3 least = high, greatest = low;
      for (const Vec3& p : result.surface.points) {
        EXPECT_TRUE((p.array() > (low - margin).array()).all() &&
                    (p.array() < (high + margin).array()).all())
            << p.transpose();
        least = least.cwiseMin(p);
        greatest = greatest.cwiseMax(p);
      }
      for (const int axis : {1, 2}) {  // to the sides of the box, but for a voxel
        EXPECT_LT(least[axis], low[axis] + voxel[axis]);
        EXPECT_GT(greatest[axis], high[axis] - voxel[axis]);
      }
      EXPECT_EQ(result.remarks.size(), axes.isIdentity() ? 1u : 2u);
    }
}

TEST(VolumeFilter, a_box_beside_an_oblique_volume_is_refused) {
  const Mat3 turned = Eigen::AngleAxisd(0.8, Vec3::UnitZ()).toRotationMatrix();
  Volume volume = sampled(9, turned, [](const Vec3& p) { return p.x(); });
  EXPECT_NE(refusal([&] {
              leave_out({5, 5, -4}, {6, 6, 4}, volume);
            }).find("lies beside it"),
            std::string::npos);
}

// The mean of a linear function over a voxel is its value at the center; parts of a voxel take the
// value of the whole, which shifts by an eighth of it at most.
TEST(VolumeFilter, coarsen_keeps_the_mean_and_the_place) {
  const Mat3 axes = Vec3(1, 1, 2).asDiagonal();
  const auto linear = [](const Vec3& p) { return p.x() - 2 * p.y() + p.z(); };
  const auto largest_error = [&](const Volume& coarse) {
    double error = 0;
    for (int64_t i = 0; i < coarse.size[0]; ++i) {
      const Vec3 place = coarse.origin + coarse.axes * Vec3(static_cast<double>(i), 3, 4);
      error = std::max(error, std::abs(coarse.at(i, 3, 4) - linear(place)));
    }
    return error;
  };
  const Volume even = coarsen(sampled(30, axes, linear), 3);
  EXPECT_EQ(even.size, (std::array<int64_t, 3>{10, 10, 20}));
  EXPECT_EQ(Vec3(even.spacing(0), even.spacing(1), even.spacing(2)), Vec3(3, 3, 3));
  EXPECT_LT(largest_error(coarsen(sampled(30, axes, linear), 2)), 1e-4);
  const Volume uneven = coarsen(sampled(31, axes, linear), 2.5);
  EXPECT_EQ(uneven.size, (std::array<int64_t, 3>{12, 12, 25}));
  EXPECT_NEAR(uneven.spacing(0), 31.0 / 12, 1e-12);
  EXPECT_LT(largest_error(uneven), (1 + 2 + 2) / 8.0);
}

TEST(VolumeFilter, a_faint_sheet_leaves_the_body_that_it_touches) {
  const Mat3 axes = Vec3(1, 1, 2).asDiagonal();
  const auto value = [](const Vec3& p) {
    if ((p - Vec3(0, -2, 0)).norm() < 8) return 0.0;
    if (std::abs(p.x()) < 1 && std::abs(p.y() + 2) < 13 && std::abs(p.z()) < 3) return 0.0;  // ear
    if ((p - Vec3(12, 12, 0)).norm() < 4) return 0.0;  // small, apart
    return p.y() > 6 && p.y() < 9 ? -250.0 : -1000.0;  // foam
  };
  const Volume volume = sampled(33, axes, value);
  const Volume kept = keep_core(volume, -150, 3);
  const Surface given = largest_component(isosurface(volume, -300)),
                body = largest_component(isosurface(kept, -300));
  const auto highest = [](const Surface& surface, int axis) {
    double extreme = -1e9;
    for (const Vec3& point : surface.points) extreme = std::max(extreme, point[axis]);
    return extreme;
  };
  EXPECT_GT(highest(given, 0), 15) << "the sheet reaches the border of the volume";
  EXPECT_LT(highest(body, 0), 12);
  EXPECT_GT(highest(body, 0), 7) << "the body keeps its size";
  EXPECT_NEAR(highest(body, 1), 10.3, 0.1) << "thin parts of it stay";
  EXPECT_NE(refusal([&] { keep_core(volume, 10, 3); }).find("no value is at or above"),
            std::string::npos);
}

TEST(VolumeFilter, closing_fills_a_narrow_hole_and_leaves_a_wide_one) {
  const auto plate = [](double hole) {
    return sampled(31, Mat3::Identity(), [hole](const Vec3& p) {
      return std::abs(p.z()) < 2 && std::hypot(p.x(), p.y()) > hole ? 10.0 : 0.0;
    });
  };
  const auto handles = [](const Volume& volume) {
    return (2 - euler_characteristic(isosurface(volume, 5))) / 2;
  };
  EXPECT_EQ(handles(plate(2)), 1);
  EXPECT_EQ(handles(close_gaps(plate(2), 3)), 0);
  EXPECT_EQ(handles(close_gaps(plate(6), 3)), 1);
  EXPECT_EQ(close_gaps(plate(-1), 3).values, plate(-1).values) << "what has no gap stays";
  const Volume before = plate(6), after = close_gaps(before, 3);
  for (size_t v = 0; v < before.values.size(); ++v)
    ASSERT_GE(after.values[v], before.values[v]) << "closing never takes away";
}

TEST(VolumeFilter, two_labels_that_touch_give_surfaces_that_do_not_overlap) {
  const Volume labels = sampled(40, Vec3(1, 1, 1.5).asDiagonal(), [](const Vec3& p) {
    return p.norm() > 14 ? 0.0 : p.x() + 0.4 * p.y() > 1 ? 5.0 : 2.0;
  });
  EXPECT_EQ(labels_of(labels), (std::vector<int64_t>{2, 5}));
  const Surface two = isosurface(label_field(labels, 2, 0.7), 0);
  const Surface five = isosurface(label_field(labels, 5, 0.7), 0);
  for (const Surface* half : {&two, &five}) {
    const Defects defects = inspect(*half);
    EXPECT_TRUE(defects.outward && defects.components == 1) << describe(defects);
    EXPECT_EQ(defects.non_manifold_edges + defects.self_intersections, 0);
  }
  const double whole = 4.0 / 3 * M_PI * std::pow(14, 3);
  EXPECT_NEAR(volume_of(two) + volume_of(five), whole, 0.03 * whole) << "nothing twice, no gap";
}

TEST(VolumeFilter, what_is_no_label_map_is_refused) {
  const auto of = [](double value) {
    return sampled(3, Mat3::Identity(), [value](const Vec3& p) { return p.x() > 0 ? value : 0; });
  };
  EXPECT_NE(refusal([&] { labels_of(of(-1)); }).find("whole numbers"), std::string::npos);
  EXPECT_NE(refusal([&] { labels_of(of(1.5)); }).find("holds 1.5"), std::string::npos);
  EXPECT_NE(refusal([&] { label_field(of(3), 7, 0.7); }).find("no voxel has the label 7; it has 3"),
            std::string::npos);
}

}  // namespace volume_filter_test
}  // namespace repose::imaging
