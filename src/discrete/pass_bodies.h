#pragma once
#include <cstdint>
#include <utility>
#include <variant>
#include <vector>

#include "message.h"
#include "repose/mechanics/rigid_body.h"

/// Bodies on their way between ranks.
namespace repose::discrete {

template <class Archive>
void pass_shape(Archive& archive, mechanics::RigidBody::Shape& shape) {
  std::visit(
      [&](auto& of) {
        if constexpr (requires { of.pass(archive); })
          of.pass(archive);
        else
          archive(of);
      },
      shape);
}

inline void pass_bodies(Sender& archive, std::vector<mechanics::RigidBody>& bodies) {
  archive(static_cast<int64_t>(bodies.size()));
  for (const mechanics::RigidBody& body : bodies) {
    archive(body.bone(), body.push(), static_cast<int64_t>(body.shape().index()));
    auto shape = body.shape();
    pass_shape(archive, shape);
  }
}

/// One of the kind that is to be received.
inline mechanics::RigidBody::Shape empty_shape(int64_t index) {
  const Vec3 zero = Vec3::Zero();
  if (index == 0) return scene::Sphere{zero, 0};
  if (index == 1) return scene::Capsule{zero, zero, 0};
  if (index == 2) return scene::Box{zero, zero};
  if (index == 3) return scene::HalfSpace{zero, zero};
  return surface::DistanceField{};
}

inline void pass_bodies(Receiver& archive, std::vector<mechanics::RigidBody>& bodies) {
  int64_t count = 0, index = 0;
  archive(count);
  for (int64_t k = 0; k < count; ++k) {
    int32_t bone = -1;
    Vec3 push = Vec3::Zero();
    archive(bone, push, index);
    auto shape = empty_shape(index);
    pass_shape(archive, shape);
    bodies.emplace_back(std::move(shape), bone, push);
  }
}

/// Sends or receives triangles; names stay behind.
template <class Archive>
void pass_meshes(Archive& archive, std::vector<surface::Surface>& meshes) {
  auto count = static_cast<int64_t>(meshes.size());
  archive(count);
  meshes.resize(count);
  for (surface::Surface& mesh : meshes) archive(mesh.points, mesh.triangles);
}

}  // namespace repose::discrete
