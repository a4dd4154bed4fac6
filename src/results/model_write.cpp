#include "model_write.h"

#include <map>
#include <sstream>

#include "writer.h"

namespace repose::results {

std::vector<double> shape_row(const model::Body& body) {
  std::vector<double> row;
  if (body.bone >= 0) return std::vector<double>(model::shape_numbers, 0.0);
  const model::Body::Shape& shape = body.shape;
  const auto put = [&](const Vec3& v) { row.insert(row.end(), {v.x(), v.y(), v.z()}); };
  if (const auto* ball = std::get_if<scene::Sphere>(&shape))
    put(ball->center), row.push_back(ball->radius);
  if (const auto* capsule = std::get_if<scene::Capsule>(&shape))
    put(capsule->from), put(capsule->to), row.push_back(capsule->radius);
  if (const auto* box = std::get_if<scene::Box>(&shape)) put(box->center), put(box->size);
  if (const auto* half = std::get_if<scene::HalfSpace>(&shape)) put(half->point), put(half->normal);
  row.resize(model::shape_numbers, 0.0);
  return row;
}

namespace {

/// Creates the arrays of a group, of which rank 0 has the first of so many rows.
template <class Group>
void create_arrays(hid_t group, const Group& first, int64_t rows) {
  model::for_each_array(
      first, [&]<class Value>(const char* name, const std::vector<Value>& values) {
        write_array(group, name, shape_of<Value>(rows), decltype(flat(values)){nullptr});
      });
}

void write_elements(hid_t model, const std::vector<model::TermElements>& all) {
  if (all.empty()) return;
  const base::Hdf5Group group = base::create_hdf5_group(model, "element");
  for (size_t k = 0; k < all.size(); ++k) {
    const model::TermElements& of = all[k];
    const base::Hdf5Group own = base::create_hdf5_group(group, std::to_string(k).c_str());
    write_attribute(own, "term", of.term);
    write_attribute(own, "points_each", of.points_each);
    write_attribute(own, "numbers_each", of.numbers_each);
    if (of.bone_number >= 0) write_attribute(own, "bone_number", of.bone_number);
    write_array(own, "points", of.points);
    write_array(own, "numbers", of.numbers);
  }
}

void write_bodies(hid_t group, const std::vector<model::Body>& bodies) {
  const hsize_t count = bodies.size();
  std::vector<std::string> names;
  std::vector<int32_t> bone;
  std::vector<int8_t> kind;
  std::vector<Vec3> push;
  std::vector<double> shape;
  const base::Hdf5Group meshes = base::create_hdf5_group(group, "body_mesh");
  for (size_t k = 0; k < bodies.size(); ++k) {
    const model::Body& body = bodies[k];
    names.push_back(body.name);
    bone.push_back(body.bone);
    kind.push_back(body.bone >= 0 ? 0 : static_cast<int8_t>(1 + body.shape.index()));
    push.push_back(body.push);
    const std::vector<double> row = shape_row(body);
    shape.insert(shape.end(), row.begin(), row.end());
    const auto* mesh = std::get_if<surface::Surface>(&body.shape);
    if (!mesh || body.bone >= 0) continue;
    const base::Hdf5Group own = base::create_hdf5_group(meshes, std::to_string(k).c_str());
    write_array(own, "points", mesh->points);
    write_array(own, "triangles", mesh->triangles);
  }
  write_strings(group, "body", names);
  write_array(group, "body_bone", bone);
  write_array(group, "body_kind", kind);
  write_array(group, "body_push", push);
  write_array(group, "body_shape", {count, model::shape_numbers}, shape.data());
}

void write_contact(hid_t model, const model::Contact& contact, const model::ModelRows& slabs) {
  if (slabs.contact_pairs == 0 && contact.cut_faces.empty()) return;
  const base::Hdf5Group group = base::create_hdf5_group(model, "contact");
  write_attribute(group, "stiffness", contact.stiffness);
  write_attribute(group, "grid", contact.spacing);
  write_bodies(group, contact.bodies);
  create_arrays(group, slabs.pairs, slabs.contact_pairs);
  if (contact.cut_faces.empty()) return;
  const base::Hdf5Group wall = base::create_hdf5_group(group, "wall");
  model::for_each_array(contact.cut_faces, [&](const char* name, const auto& values) {
    write_array(wall, name, values);
  });
}

void write_adhesion(hid_t model, const model::AdhesionRule& rule) {
  const base::Hdf5Group group = base::create_hdf5_group(model, "adhesion");
  write_attribute(group, "tension", rule.tension);
  write_attribute(group, "range", rule.range);
  write_array(group, "axes",
              std::vector<Vec3>{rule.axes.row(0), rule.axes.row(1), rule.axes.row(2)});
  std::vector<int32_t> bone;
  std::vector<int8_t> upper;
  std::vector<double> box, reach;
  for (const model::AdhesionRule::Jaw& jaw : rule.jaws) {
    bone.push_back(jaw.bone);
    upper.push_back(jaw.upper);
    for (const Vec3& corner : {jaw.low, jaw.high})
      box.insert(box.end(), corner.begin(), corner.end());
    reach.push_back(jaw.reach);
  }
  write_array(group, "bone", bone);
  write_array(group, "upper", upper);
  write_array(group, "box", {bone.size(), 6}, box.data());
  write_array(group, "reach", reach);
  write_array(group, "lip_line", std::vector<Vec3>(rule.lip_line.begin(), rule.lip_line.end()));
  write_array(group, "cut_column", rule.cut_columns);
}

void write_skin(hid_t model, const std::vector<Triangle>& skin) {
  if (skin.empty()) return;
  const base::Hdf5Group group = base::create_hdf5_group(model, "skin");
  write_array(group, "points", skin);
}

void write_transforms(hid_t model, const std::vector<Mat4>& transforms) {
  if (transforms.empty()) return;
  std::vector<double> rows;
  for (const Mat4& matrix : transforms)
    for (int i = 0; i < 16; ++i) rows.push_back(matrix(i / 4, i % 4));
  write_array(model, "bone_transform", {transforms.size(), 4, 4}, rows.data());
}

void write_bone_surfaces(hid_t model, const std::vector<surface::Surface>& surfaces) {
  if (surfaces.empty()) return;
  const base::Hdf5Group group = base::create_hdf5_group(model, "bone_surface");
  for (size_t b = 0; b < surfaces.size(); ++b) {
    const base::Hdf5Group bone = base::create_hdf5_group(group, std::to_string(b).c_str());
    write_array(bone, "points", surfaces[b].points);
    write_array(bone, "triangles", surfaces[b].triangles);
  }
}

void write_merged(hid_t model, const MergedBones& bones) {
  if (bones.triangles.empty()) return;
  const base::Hdf5Group group = base::create_hdf5_group(model, "bone_surfaces");
  write_array(group, "points", bones.points);
  write_array(group, "triangles", bones.triangles);
  write_array(group, "bone", bones.bone);
}

}  // namespace

void write_model(hid_t file, const model::Model& model, const model::ModelRows& slabs,
                 const MergedBones& bones) {
  const base::Hdf5Group root(H5Gopen2(file, "/", H5P_DEFAULT));
  write_attribute(root, "format", std::string("tissue-model"));
  write_attribute(root, "version", int64_t{1});
  const base::Hdf5Group group = base::create_hdf5_group(file, "model");
  const Vec3& g = model.gravity;
  write_attribute(group, "gravity", std::vector<double>{g.x(), g.y(), g.z()});
  const auto create = [&](const char* name, const auto& first, int64_t rows) {
    create_arrays(base::create_hdf5_group(group, name), first, rows);
  };
  const model::Counts& all = slabs.counts;
  create("point", slabs.points, all.points);
  if (all.springs > 0) create("spring", slabs.springs, all.springs);
  create("prism", slabs.prisms, all.prisms);
  if (all.edges > 0) create("edge", slabs.edges, all.edges);
  write_elements(group, model.elements);
  write_contact(group, model.contact, slabs);
  if (model.adhesion) write_adhesion(group, *model.adhesion);
  write_skin(group, model.skin);
  write_strings(group, "spring_set", model.spring_sets);
  write_strings(group, "bone", model.bones);
  write_bone_surfaces(group, model.bone_surfaces);
  write_merged(group, bones);
  write_transforms(group, model.bone_transform);
}

namespace {

/// Rank 0 knows which arrays there are: other slabs may be empty.
template <class Group>
void fill(MPI_Comm comm, hid_t group, const Group& slab, int64_t rows, const OnDisk& on_disk) {
  const base::Slab mine = base::slab(rows, base::rank(comm), base::size(comm));
  std::map<std::string, const void*> values;
  std::string names;
  model::for_each_array(slab, [&](const char* name, const auto& array) {
    values[name] = flat(array);
    names += std::string(name) + '\n';
  });
  base::broadcast(comm, names);
  std::istringstream list(names);
  for (std::string name; std::getline(list, name);) {
    base::Hdf5Dataset dataset;
    base::Hdf5Type type;
    on_disk([&] {
      dataset = base::Hdf5Dataset(H5Dopen2(group, name.c_str(), H5P_DEFAULT));
      const base::Hdf5Type stored(H5Dget_type(dataset));
      type = base::Hdf5Type(H5Tget_native_type(stored, H5T_DIR_ASCEND));
    });
    on_disk([&] { write_rows(comm, dataset, mine, values[name], type); });
  }
}

}  // namespace

void fill_model(MPI_Comm comm, hid_t file, const model::ModelRows& slabs, const OnDisk& on_disk) {
  const model::Counts& all = slabs.counts;
  const auto write = [&](const char* name, const auto& slab, int64_t rows) {
    if (rows == 0) return;
    base::Hdf5Group group;
    on_disk([&] { group = base::Hdf5Group(H5Gopen2(file, name, H5P_DEFAULT)); });
    fill(comm, group, slab, rows, on_disk);
  };
  write("/model/point", slabs.points, all.points);
  write("/model/spring", slabs.springs, all.springs);
  write("/model/prism", slabs.prisms, all.prisms);
  write("/model/edge", slabs.edges, all.edges);
  write("/model/contact", slabs.pairs, slabs.contact_pairs);
}

int64_t model_bytes(const model::Model& model, const model::ModelRows& slabs,
                    const MergedBones& bones) {
  const int64_t point = 3 * 3 * 8 + 1 + 4 + 8 + 4 + 8, spring = 2 * 8 + 4 + 8 + 8 + 1 + 8;
  const model::Counts& all = slabs.counts;
  const size_t descriptions = (size_t{1} << 16) + (model.bones.size() << 12);
  size_t elements = 0, instruments = 0;
  for (const model::TermElements& of : model.elements)
    elements += 8 * (of.points.size() + of.numbers.size());
  for (const model::Body& body : model.contact.bodies)
    if (const auto* mesh = std::get_if<surface::Surface>(&body.shape))
      instruments += (mesh->points.size() + mesh->triangles.size()) * 3 * 8 + (size_t{1} << 12);
  const size_t bytes = descriptions + elements + instruments + slabs.contact_pairs * 21 +
                       model.contact.cut_faces.point.size() * 50 + model.skin.size() * 3 * 8 +
                       bones.points.size() * 2 * 3 * 8 + bones.triangles.size() * (2 * 3 * 8 + 4);
  return static_cast<int64_t>(bytes) + all.points * point + all.springs * spring +
         all.prisms * 11 * 8 + all.edges * 3 * 8;
}

}  // namespace repose::results
