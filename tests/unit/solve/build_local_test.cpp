#include <gtest/gtest.h>

#include <numeric>

#include "../../folder.h"
#include "../model/patches.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/discrete/natural_rows.h"
#include "repose/discrete/objective.h"
#include "repose/results/model_file.h"
#include "repose/results/result_file.h"
#include "repose/solve/prestress.h"
#include "repose/solve/repose.h"
#include "rest.h"

namespace repose {
namespace raise_test {

namespace patches = model::patches;
using discrete::Part;

const MPI_Comm comm = MPI_COMM_WORLD;

/// Two jaws, one of which moves, under a skin of so many squares along each side.
model::Anatomy jaws(int squares) {
  scene::Scene scene = patches::scene_of(4, {"upper", "lower"});
  scene.moves[1] = scene::RigidMotion::translation({0, 6, 1});
  scene.rim = scene::Rim::free;
  scene.tissue.material = scene::Material{.deep = {0.015, 0.45}, .strata = {}, .regions = {}};
  scene.contact = scene::Contact{};
  return {scene,
          patches::square(squares, 100),
          {},
          {patches::box({-20, -20, -25}, {51.2, 120, -10}),
           patches::box({51.3, -20, -25}, {120, 120, -10})},
          {},
          {}};
}

/// The same with elastic supports, however few squares there are.
model::Anatomy supported(int squares) {
  model::Anatomy anatomy = jaws(squares);
  anatomy.scene.tissue.release = 35;
  return anatomy;
}

/// The same with all that a material can have, weight, and layers at given depths.
model::Anatomy rich(int squares) {
  model::Anatomy anatomy = jaws(squares);
  scene::Tissue& tissue = anatomy.scene.tissue;
  tissue.material->strata = {{1.5, {0.1, 0.4}}};
  tissue.material->regions = {{scene::Region{scene::Sphere{{30, 50, -5}, 20}}, {0.05, 0.3}}};
  tissue.material->dilatation = scene::Dilatation::nodal;
  tissue.depths_mm = {0, 1.5};
  tissue.turgor = 0.05;
  tissue.density = 1e-6;
  anatomy.scene.gravity = Vec3(0, 0, -9.81);
  return anatomy;
}

/// The same with forces, layers of given masses, and instruments of both kinds.
model::Anatomy loaded(int squares) {
  model::Anatomy anatomy = rich(squares);
  scene::Scene& scene = anatomy.scene;
  scene.tissue.density.reset();
  scene.tissue.mass = {0.1, 0.2, 0.3, 0.4};
  scene.forces = {{{20, 20, 0}, 60, {0.1, 0, 0}}, {{80, 80, 0}, 60, {0, 0, 0.2}}};
  scene.instruments = {{scene::Sphere{{0, 100, 32}, 30}, {0, 0, -4}, true},
                       {scene::Sphere{{100, 0, 32}, 30}, {0, 0, -4}}};
  return anatomy;
}

/// The jaws with teeth beyond y = 60, to which lips adhere.
model::Anatomy adhering(int squares) {
  model::Anatomy anatomy = jaws(squares);
  anatomy.scene.tissue.release = 0;
  scene::AnatomyPlan& plan = anatomy.scene.anatomy.emplace();
  plan.landmarks = {{"upper_incisor_edge", {20, 100, -10}},
                    {"lower_incisor_edge", {80, 100, -10}},
                    {"stomion", {51, 100, 0}},
                    {"mouth_right", {0, 100, -5}},
                    {"mouth_left", {100, 100, 5}}};
  anatomy.scene.tissue.attach_regions = {
      scene::AttachRegion{scene::Box{{50, 90, -10}, {200, 60, 60}}, scene::Attach::contact, 1}};
  return anatomy;
}

/// The same anatomy, its tissue made of springs that resemble a solid.
model::Anatomy of_springs(model::Anatomy anatomy) {
  anatomy.scene.tissue.isotropic = anatomy.scene.tissue.material->deep;
  anatomy.scene.tissue.material.reset();
  return anatomy;
}

/// The same with parted lips and, where there are squares enough, an incision.
model::Anatomy cut(model::Anatomy anatomy, bool sides_touch) {
  scene::Scene& scene = anatomy.scene;
  scene.contact->cuts = sides_touch;
  if (anatomy.skin.points.size() >= 36) {
    scene.incisions = {{{{20, 40, 0}, {80, 40, 0}}, 2, "incisions[0]"},
                       {{{20, 60, 0}, {80, 60, 0}}, 4, "mouth"}};
  } else {
    scene.incisions = {{{{10, 45, 0}, {90, 55, 0}}, 4, "mouth"}};
  }
  return anatomy;
}

/// The whole model with all its cuts made, those of lips first.
model::Model cut_whole(const model::Anatomy& anatomy) {
  model::BuiltModel built = model::build_model(anatomy);
  for (const bool lips : {true, false}) model::make_cuts(built.cuts, lips, built.model);
  return built.model;
}

discrete::LocalModel build_local(const model::Anatomy& anatomy, bool incisions = true,
                                 const discrete::LocalModel* balanced = nullptr) {
  std::optional<model::ColumnGeometry> geometry;
  base::on_root(comm, [&] {
    geometry.emplace(anatomy);
    geometry->include_incisions(incisions);
  });
  return discrete::build_local(comm, geometry ? &*geometry : nullptr, anatomy.scene, balanced);
}

void expect_same(const std::vector<model::TermElements>& one,
                 const std::vector<model::TermElements>& other) {
  ASSERT_EQ(one.size(), other.size());
  for (size_t k = 0; k < one.size(); ++k) {
    EXPECT_EQ(one[k].term, other[k].term);
    EXPECT_EQ(one[k].points, other[k].points);
    EXPECT_EQ(one[k].numbers, other[k].numbers);
  }
}

void expect_same(const model::CutFaces& one, const model::CutFaces& other) {
  EXPECT_EQ(one.size, other.size);
  EXPECT_EQ(one.begin, other.begin);
  EXPECT_EQ(one.point, other.point);
  EXPECT_EQ(one.weight, other.weight);
  EXPECT_EQ(one.area, other.area);
}

void expect_same(const model::Model& one, const model::Model& other) {
  expect_same(one.elements, other.elements);
  EXPECT_EQ(one.gravity, other.gravity);
  EXPECT_EQ(one.points.position, other.points.position);
  EXPECT_EQ(one.points.set, other.points.set);
  EXPECT_EQ(one.points.target, other.points.target);
  EXPECT_EQ(one.points.layer, other.points.layer);
  EXPECT_EQ(one.points.column, other.points.column);
  EXPECT_EQ(one.points.bone, other.points.bone);
  EXPECT_EQ(one.springs.points, other.springs.points);
  EXPECT_EQ(one.springs.set, other.springs.set);
  EXPECT_EQ(one.springs.rest_length, other.springs.rest_length);
  EXPECT_EQ(one.springs.stiffness, other.springs.stiffness);
  EXPECT_EQ(one.springs.exponent, other.springs.exponent);
  EXPECT_EQ(one.springs.reference, other.springs.reference);
  EXPECT_EQ(one.prisms.points, other.prisms.points);
  EXPECT_EQ(one.prisms.rest_volume, other.prisms.rest_volume);
  EXPECT_EQ(one.prisms.shear_modulus, other.prisms.shear_modulus);
  EXPECT_EQ(one.prisms.modulus, other.prisms.modulus);
  EXPECT_EQ(one.prisms.target_volume, other.prisms.target_volume);
  EXPECT_EQ(one.prisms.nodal_modulus, other.prisms.nodal_modulus);
  EXPECT_EQ(one.edges.points, other.edges.points);
  EXPECT_EQ(one.edges.weight, other.edges.weight);
  EXPECT_EQ(one.contact.stiffness, other.contact.stiffness);
  EXPECT_EQ(one.contact.spacing, other.contact.spacing);
  EXPECT_EQ(one.contact.pairs.point, other.contact.pairs.point);
  EXPECT_EQ(one.contact.pairs.body, other.contact.pairs.body);
  EXPECT_EQ(one.contact.pairs.binding, other.contact.pairs.binding);
  EXPECT_EQ(one.contact.pairs.area, other.contact.pairs.area);
  EXPECT_EQ(one.contact.pairs.offset, other.contact.pairs.offset);
  expect_same(one.contact.cut_faces, other.contact.cut_faces);
  EXPECT_EQ(one.bone_transform, other.bone_transform);
}

void expect_same(const Part& one, const Part& other) {
  expect_same(one.model, other.model);
  EXPECT_EQ(one.point_row, other.point_row);
  EXPECT_EQ(one.spring_row, other.spring_row);
  EXPECT_EQ(one.prism_row, other.prism_row);
  EXPECT_EQ(one.edge_row, other.edge_row);
  EXPECT_EQ(one.unknown, other.unknown);
  EXPECT_EQ(one.owned_points, other.owned_points);
  EXPECT_EQ(one.owned_springs, other.owned_springs);
  EXPECT_EQ(one.owned_prisms, other.owned_prisms);
  EXPECT_EQ(one.owned_edges, other.owned_edges);
  EXPECT_EQ(one.unknowns, other.unknowns);
  EXPECT_EQ(one.total_points, other.total_points);
  EXPECT_EQ(one.total_springs, other.total_springs);
  EXPECT_EQ(one.total_prisms, other.total_prisms);
  EXPECT_EQ(one.solid, other.solid);
  EXPECT_EQ(one.contact, other.contact);
  ASSERT_EQ(one.bodies.size(), other.bodies.size());
  for (const Vec3& at : {Vec3(30, 40, -8), Vec3(70, 20, -12)})
    for (size_t k = 0; k < one.bodies.size(); ++k)
      EXPECT_EQ(one.bodies[k].distance(at).value, other.bodies[k].distance(at).value);
}

void expect_same_loads(const Part& one, const Part& other) {
  for (int64_t i = 0; i < one.owned_points; ++i) {
    EXPECT_EQ(one.model.points.mass[i], other.model.points.mass[i]) << i;
    EXPECT_EQ(one.model.points.external_force[i], other.model.points.external_force[i]) << i;
  }
}

/// So many squares that columns are dealt out in order: PT-Scotch deals otherwise each time.
int squares() {
  const int ranks = base::size(comm);
  return ranks == 1 ? 24 : ranks < 5 ? ranks : 5;
}

TEST(Raise, parts_are_those_of_the_whole_model) {
  for (const model::Anatomy& anatomy :
       {supported(squares()), rich(squares()), loaded(squares()), adhering(squares()),
        of_springs(jaws(squares())), of_springs(loaded(squares()))}) {
    const model::BuiltModel built = model::build_model(anatomy);
    const Part part = discrete::build_local_from_root(comm, built.model).part;
    const discrete::LocalModel local_model = build_local(anatomy);
    expect_same(local_model.part, part);
    expect_same_loads(local_model.part, part);
    EXPECT_TRUE(part.contact);
    const model::Counts all = model::count(built.model);
    EXPECT_EQ(local_model.counts.points, all.points);
    EXPECT_EQ(local_model.counts.soft, all.soft);
    EXPECT_EQ(local_model.counts.boundary, all.boundary);
    EXPECT_EQ(local_model.counts.bone, all.bone);
    EXPECT_EQ(local_model.counts.held, all.held);
    EXPECT_EQ(local_model.counts.springs, all.springs);
    EXPECT_EQ(local_model.counts.prisms, all.prisms);
    EXPECT_EQ(local_model.counts.edges, all.edges);
    if (base::rank(comm) > 0) continue;
    const scene::Tissue& tissue = anatomy.scene.tissue;
    if (!tissue.material || anatomy.scene.anatomy || tissue.release > 30) {
      EXPECT_EQ(built.model.elements.size(), tissue.material ? 1 : 0);
    }
    expect_same(local_model.global_metadata.elements, built.model.elements);
    EXPECT_EQ(local_model.global_metadata.skin, built.model.skin);
    EXPECT_EQ(local_model.global_metadata.bones, built.model.bones);
    EXPECT_EQ(local_model.global_metadata.spring_sets, built.model.spring_sets);
    EXPECT_EQ(local_model.global_metadata.contact.bodies.size(), built.model.contact.bodies.size());
    EXPECT_NEAR(local_model.effective_modulus, built.report.effective_modulus, 1e-12);
  }
}

TEST(Raise, parts_of_a_cut_model_are_those_of_the_whole) {
  for (const bool sides_touch : {false, true})
    for (const auto& uncut : {supported(squares()), rich(squares()), loaded(squares()),
                              of_springs(loaded(squares()))}) {
      const model::Anatomy anatomy = cut(uncut, sides_touch);
      const model::Model whole = cut_whole(anatomy);
      const discrete::LocalModel local_model = build_local(anatomy);
      const Part part = discrete::build_local_from_root(comm, whole).part;
      ASSERT_GT(part.total_points, 4 * static_cast<int64_t>(uncut.skin.points.size()));
      expect_same(local_model.part, part);
      expect_same_loads(local_model.part, part);
      if (base::rank(comm) > 0) continue;
      EXPECT_EQ(local_model.global_metadata.skin, whole.skin);
      EXPECT_EQ(whole.contact.cut_faces.empty(), !sides_touch);
      expect_same(local_model.global_metadata.contact.cut_faces, whole.contact.cut_faces);
    }
}

/// Rows of a group from the end of one rank to that of the next; ranks hold the more the higher.
template <class Group>
void keep_some(size_t n, Group& group) {
  const int64_t rank = base::rank(comm), ranks = base::size(comm);
  const auto begin_of = [&](int64_t r) {
    return static_cast<int64_t>(n) * r * (r + 1) / (ranks * (ranks + 1));
  };
  std::vector<int64_t> rows(begin_of(rank + 1) - begin_of(rank));
  std::iota(rows.begin(), rows.end(), begin_of(rank));
  model::for_each_array(group,
                        [&](const char*, auto& values) { values = base::pick(values, rows); });
}

TEST(Raise, parts_are_the_same_wherever_rows_lie) {
  for (const model::Anatomy& uncut :
       {rich(squares()), loaded(squares()), of_springs(loaded(squares()))}) {
    const model::Model whole = cut_whole(cut(uncut, true));
    const discrete::LocalModel one = discrete::build_local_from_root(comm, whole);
    model::Model rows = base::rank(comm) == 0 ? whole : model::Model();
    rows.points = whole.points, rows.springs = whole.springs;
    rows.prisms = whole.prisms, rows.edges = whole.edges;
    keep_some(whole.points.position.size(), rows.points);
    keep_some(whole.springs.points.size(), rows.springs);
    keep_some(whole.prisms.points.size(), rows.prisms);
    keep_some(whole.edges.points.size(), rows.edges);
    const discrete::LocalModel other = discrete::build_local(comm, std::move(rows));
    expect_same(one.part, other.part);
    expect_same_loads(one.part, other.part);
    EXPECT_EQ(one.outward, other.outward);
    EXPECT_EQ(one.counts.soft, other.counts.soft);
    EXPECT_EQ(one.contact_pairs, other.contact_pairs);
  }
}

TEST(Raise, a_rank_without_columns_has_an_empty_part) {
  for (const model::Anatomy& anatomy : {jaws(1), of_springs(jaws(1))}) {  // four columns
    const Part part = discrete::build_local_from_root(comm, model::build_model(anatomy).model).part;
    expect_same(build_local(anatomy).part, part);
  }
}

/// This rank's slab of rows.
template <class Value>
std::vector<Value> slab(const std::vector<Value>& whole) {
  const base::Slab mine =
      base::slab(static_cast<int64_t>(whole.size()), base::rank(comm), base::size(comm));
  return {whole.begin() + mine.begin, whole.begin() + mine.end};
}

void expect_its_rows(const model::Anatomy& anatomy) {
  const model::Model whole = cut_whole(anatomy);
  const discrete::LocalModel local_model = build_local(anatomy);
  const model::Model gathered = discrete::gather_model(comm, local_model);
  if (base::rank(comm) == 0) {
    expect_same(gathered, whole);
    EXPECT_EQ(local_model.global_metadata.skin, whole.skin);
    expect_same(local_model.global_metadata.contact.cut_faces, whole.contact.cut_faces);
  }
  const model::ModelRows rows = discrete::NaturalRows::of_model(comm, local_model);
  EXPECT_EQ(rows.points.position, slab(whole.points.position));
  EXPECT_EQ(rows.points.set, slab(whole.points.set));
  EXPECT_EQ(rows.points.target, slab(whole.points.target));
  EXPECT_EQ(rows.points.layer, slab(whole.points.layer));
  EXPECT_EQ(rows.points.column, slab(whole.points.column));
  EXPECT_EQ(rows.points.bone, slab(whole.points.bone));
  EXPECT_EQ(rows.points.mass, slab(whole.points.mass));
  EXPECT_EQ(rows.springs.points, slab(whole.springs.points));
  EXPECT_EQ(rows.springs.set, slab(whole.springs.set));
  EXPECT_EQ(rows.springs.stiffness, slab(whole.springs.stiffness));
  EXPECT_EQ(rows.prisms.points, slab(whole.prisms.points));
  EXPECT_EQ(rows.prisms.target_volume, slab(whole.prisms.target_volume));
  EXPECT_EQ(rows.prisms.nodal_modulus, slab(whole.prisms.nodal_modulus));
  EXPECT_EQ(rows.edges.points, slab(whole.edges.points));
  EXPECT_EQ(rows.edges.weight, slab(whole.edges.weight));
  EXPECT_EQ(rows.pairs.point, slab(whole.contact.pairs.point));
  EXPECT_EQ(rows.pairs.body, slab(whole.contact.pairs.body));
  EXPECT_EQ(rows.pairs.binding, slab(whole.contact.pairs.binding));
  EXPECT_EQ(rows.pairs.area, slab(whole.contact.pairs.area));
  EXPECT_EQ(rows.outward, slab(model::outward_normals(whole)));
  EXPECT_EQ(rows.contact_pairs, static_cast<int64_t>(whole.contact.pairs.point.size()));
}

TEST(Raise, its_rows_are_those_of_the_whole_model) {
  for (const model::Anatomy& anatomy : {rich(24), of_springs(rich(24))}) expect_its_rows(anatomy);
}

TEST(Raise, its_rows_are_those_of_the_whole_model_with_cuts) {
  for (const bool sides_touch : {false, true})
    for (const model::Anatomy& uncut : {loaded(24), of_springs(loaded(24))})
      expect_its_rows(cut(uncut, sides_touch));
}

/// With few columns, some ranks have no row of prisms, or none at all.
TEST(Raise, a_distributed_model_is_written_as_it_was) {
  model::Anatomy springs = jaws(1);
  springs.scene.tissue.material.reset();
  const test::Folder folder;
  std::string name = folder.path("rows");
  base::broadcast(comm, name);
  for (const model::Anatomy& anatomy : {springs, jaws(1), loaded(12)}) {
    const model::Model whole = model::build_model(anatomy).model;
    const discrete::LocalModel local = discrete::build_local_from_root(comm, whole);
    const model::Model gathered = discrete::gather_model(comm, local);
    EXPECT_TRUE(local.global_metadata.points.position.empty());
    results::ResultFile(comm, name, local.global_metadata,
                        discrete::NaturalRows::of_model(comm, local))
        .commit();
    base::on_root(comm, [&] {
      for (const model::Model& stored : {results::read_model(name + ".h5"), gathered}) {
        expect_same(stored, whole);
        EXPECT_EQ(stored.points.mass, whole.points.mass);
        EXPECT_EQ(stored.springs.points, whole.springs.points);
        EXPECT_EQ(stored.springs.set, whole.springs.set);
        EXPECT_EQ(stored.springs.rest_length, whole.springs.rest_length);
        EXPECT_EQ(stored.springs.stiffness, whole.springs.stiffness);
        EXPECT_EQ(stored.springs.exponent, whole.springs.exponent);
        EXPECT_EQ(stored.springs.reference, whole.springs.reference);
        EXPECT_EQ(stored.spring_sets, whole.spring_sets);
        EXPECT_EQ(stored.skin, whole.skin);
      }
    });
  }
}

/// The jaws turn together about each corner.
TEST(Raise, every_rank_reads_the_same_distances_to_bodies) {
  for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(100, 0, 0), Vec3(0, 100, 0), Vec3(100, 100, 0)}) {
    model::Anatomy anatomy = jaws(24);
    anatomy.scene.contact->grid = 1;
    anatomy.scene.moves.assign(2, scene::RigidMotion::rotation(Vec3::UnitZ(), corner, 12));
    anatomy.bones = {patches::box({-20, -20, -80}, {51.2, 120, -10}),
                     patches::box({51.3, -20, -80}, {120, 120, -10})};
    const auto bodies = mechanics::make_bodies(model::build_model(anatomy).model);
    const discrete::LocalModel local_model = build_local(anatomy);
    ASSERT_EQ(local_model.part.bodies.size(), bodies.size());
    for (size_t k = 0; k < bodies.size(); ++k)
      for (double x = 2; x < 100; x += 8)
        for (double y = 2; y < 100; y += 8)
          for (const double z : {-8.0, -12.0, -40.0})
            ASSERT_EQ(local_model.part.bodies[k].distance({x, y, z}).value,
                      bodies[k].distance({x, y, z}).value);
  }
}

/// N, the largest force on a point that is free to move. Collective.
double largest_force(const Part& part) {
  discrete::Positions positions(comm, part);
  discrete::Objective objective(positions, mechanics::solid_weights);
  const base::VecHandle at_rest = positions.make_vector();
  positions.update(at_rest);
  const std::vector<Vec3> force = objective.residual_force();
  double largest = 0;
  for (int64_t i = 0; i < part.owned_points; ++i)
    if (part.unknown[i] >= 0) largest = std::max(largest, force[i].norm());
  MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, comm);
  return largest;
}

TEST(Raise, a_prestress_of_parts_is_that_of_the_whole) {
  model::Anatomy anatomy = rich(24);
  anatomy.scene.rim = scene::Rim::fixed;  // where parts meet there are fixed points
  anatomy.scene.tissue.material->dilatation = scene::Dilatation::prism;
  model::Model whole = model::build_model(anatomy).model;
  discrete::LocalModel local_model = build_local(anatomy);
  const solve::ReferenceState as{0.05, Vec3(0, 0, -9.81)};
  const solve::Prestress one = solve::prestress(comm, whole, as);
  const solve::Prestress other = solve::prestress(comm, local_model, as);
  EXPECT_GT(one.largest_force, 0);
  EXPECT_NEAR(one.largest_force, other.largest_force, 1e-12 * one.largest_force);
  EXPECT_NEAR(one.largest_pressure, other.largest_pressure, 1e-6 * one.largest_pressure);
  EXPECT_LE(other.residual, 1e-10 * one.largest_force);
  EXPECT_EQ(local_model.part.model.gravity, Vec3(0, 0, -9.81));
  // What is written is what was balanced, whoever owns it.
  EXPECT_LE(largest_force(local_model.part), 1e-10 * one.largest_force);
  EXPECT_LE(largest_force(discrete::build_local_from_root(comm, whole).part),
            1e-10 * one.largest_force);
}

model::Anatomy rim_held(model::Anatomy anatomy) {
  anatomy.scene.rim = scene::Rim::fixed;
  return anatomy;
}

/// The tissue of a cut along the border of ranks, and of points that the rim holds beside it.
TEST(Raise, parts_cut_in_equilibrium_are_those_of_the_whole) {
  for (const bool sides_touch : {false, true})
    for (auto& uncut : {rich(squares()), rim_held(rich(squares())), of_springs(rich(squares()))}) {
      model::Anatomy anatomy = cut(uncut, sides_touch);
      anatomy.scene.incisions.front().name = "incisions[0]";  // the only one of few squares, too
      const solve::ReferenceState as{0.05, Vec3(0, 0, -9.81)};
      model::BuiltModel built = model::build_model(anatomy);
      model::make_cuts(built.cuts, true, built.model);
      solve::prestress(comm, built.model, as);
      model::make_cuts(built.cuts, false, built.model);
      discrete::LocalModel balanced = build_local(anatomy, false);
      solve::prestress(comm, balanced, as);
      const discrete::LocalModel local_model = build_local(anatomy, true, &balanced);
      const Part part = discrete::build_local_from_root(comm, built.model).part;
      expect_same(local_model.part, part);
      expect_same_loads(local_model.part, part);
      ASSERT_GT(part.total_points, balanced.part.total_points);
    }
}

TEST(Raise, a_prestress_of_next_to_no_weight_is_balanced_to_rounding) {
  for (const auto dilatation : {scene::Dilatation::prism, scene::Dilatation::nodal}) {
    model::Anatomy anatomy = rich(12);
    anatomy.scene.rim = scene::Rim::fixed;
    anatomy.scene.tissue.material->dilatation = dilatation;
    model::Model whole = model::build_model(anatomy).model;
    const solve::Prestress of_weight = solve::prestress(comm, whole, {0.05, Vec3(0, 0, -9.81e-8)});
    EXPECT_GT(of_weight.largest_force, 0);
    EXPECT_LT(of_weight.residual, 1e-13);  // N; tissue of 0.015 N/mm² on some millimeters
  }
}

TEST(Raise, a_region_that_holds_no_prism_is_refused_on_all_ranks) {
  model::Anatomy anatomy = rich(12);
  anatomy.scene.tissue.material->regions = {
      {scene::Region{scene::Sphere{{0, 0, 500}, 1}}, {0.05, 0.3}}};
  EXPECT_THROW(build_local(anatomy), base::InputError);
}

TEST(Raise, lips_adhere_in_the_vestibule_alone) {
  const model::Model whole = model::build_model(adhering(20)).model;
  const double front = 100 - 16;  // of the vestibule; tissue touches the jaws from y = 60 on
  int touching = 0;
  for (const int64_t point : whole.contact.pairs.point)
    touching += whole.points.position[point].y() < front;
  EXPECT_GT(touching, 0);
  const std::vector<int64_t>& points = whole.elements.at(0).points;
  EXPECT_GT(points.size(), 0);
  for (size_t e = 0; e < points.size(); e += 4)
    EXPECT_GE(whole.points.position[points[e]].y(), front);
}

}  // namespace raise_test
}  // namespace repose
