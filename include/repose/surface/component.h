#pragma once
#include <cstdint>
#include <vector>

#include "repose/surface/surface.h"

/// Whole surfaces and their connected parts: measures and choice.
namespace repose::surface {

double area_of(const Surface& surface);  ///< mm²
/// mm³, signed: positive where the surface is closed and faces outward, negative for the wall of a
/// cavity. For an open surface that of the cone over its rim from the first point.
double volume_of(const Surface& surface);

/// [points] unit normals, the sums of those of the triangles around by their areas.
std::vector<Vec3> vertex_normals(const Surface& surface);

/// [points] unit normals, the sums of those of the triangles around by their angles there.
std::vector<Vec3> angle_normals(const Surface& surface);

/// Points spread over a surface: the middles of equal parts of each triangle.
struct Samples {
  std::vector<Vec3> point;   ///< mm
  std::vector<double> area;  ///< mm², of the part
};

/// Cuts each triangle n times along each side, into n² parts no longer than `spacing` mm.
Samples sample(const Surface& surface, double spacing);

/// Adds the points and triangles of a part to those of a whole.
void append(const Surface& part, Surface& whole);

/// These triangles with those of the points that they have, numbered as they come.
Surface compact(std::string name, const std::vector<Vec3>& points, std::vector<Triangle> triangles);

/// The parts connected by edges, the one of the largest |volume| first (of open ones the largest
/// area). Points are numbered in the order in which triangles name them.
std::vector<Surface> components(const Surface& surface);

/// The first of components().
Surface largest_component(const Surface& surface);

/// Those parts whose |volume| is at least `volume` mm³. Throws InputError where none is.
Surface components_above(const Surface& surface, double volume);

}  // namespace repose::surface
