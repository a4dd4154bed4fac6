#include "repose/scene/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>

#include "folder.h"
#include "repose/scene/keys.h"

namespace repose::scene {
namespace scene_test {

const std::string minimal =
    "skin: face.ply\n"
    "bones:\n"
    "  - {name: skull, file: skull.ply}\n"
    "  - {name: mandible, file: mandible.ply}\n"
    "tissue: {layers: 4}\n";

Scene read(const std::string& text) {
  static const Folder folder;
  return read_scene(folder.write("scene.yaml", text));
}

std::string refused(const std::string& text) {
  return refusal([&] { read(text); });
}

void expect_near(const Vec3& a, const Vec3& b) {
  EXPECT_LT((a - b).norm(), 1e-12) << a.transpose() << " against " << b.transpose();
}

TEST(Scene, MinimalHasTheDefaults) {
  const Folder folder;
  const Scene scene = read_scene(folder.write("scene.yaml", minimal));
  EXPECT_EQ(scene.skin.file, folder.path("face.ply"));
  EXPECT_FALSE(scene.skin.volume);
  ASSERT_EQ(scene.bones.size(), 2u);
  EXPECT_EQ(scene.bones[1].name, "mandible");
  EXPECT_EQ(scene.bones[1].surface.file, folder.path("mandible.ply"));
  EXPECT_TRUE(scene.tissue.depths.empty());
  EXPECT_EQ(scene.tissue.attach_within, 30);
  EXPECT_EQ(scene.tissue.free_thickness, 12);
  EXPECT_EQ(scene.tissue.release, 10);
  EXPECT_EQ(scene.tissue.turgor, 0);
  EXPECT_TRUE(scene.tissue.springs.empty());
  EXPECT_TRUE(scene.tissue.mass.empty());
  EXPECT_FALSE(scene.gravity);
  EXPECT_EQ(scene.rim, Rim::automatic);
  ASSERT_EQ(scene.moves.size(), 2u);
  EXPECT_TRUE(scene.moves[0].is_identity());
  EXPECT_EQ(scene.solve.functional, Functional::energy);
  EXPECT_EQ(scene.solve.volume, std::nullopt);
  EXPECT_FALSE(scene.solve.bulk_modulus);
  EXPECT_EQ(scene.solve.accuracy, 0.1);
  EXPECT_EQ(scene.solve.load_steps, 0);
}

TEST(Scene, PlanHoldsPiecesAndRanges) {
  EXPECT_FALSE(read(minimal).plan);
  const Scene scene = read(std::string(minimal) +
                           "plan: {pieces: [mandible], box: {translate: [8, 4, 2]}}\n"
                           "moves: [{bone: mandible, translate: [0, -3, 0]}]\n");
  ASSERT_TRUE(scene.plan);
  EXPECT_EQ(scene.plan->pieces, std::vector<std::size_t>{1});
  expect_near(scene.plan->translate, {8, 4, 2});
  expect_near(scene.plan->rotate, {10, 10, 10});
}

TEST(Scene, PlanRefusesWhatItDoesNotHold) {
  const auto plan = [](const std::string& text) { return refused(minimal + text); };
  EXPECT_NE(plan("plan: {pieces: [jaw]}\n").find("jaw"), std::string::npos);
  EXPECT_NE(plan("plan: {pieces: []}\n").find("a list of texts"), std::string::npos);
  EXPECT_NE(plan("plan: {pieces: skull}\nmoves: [{bone: mandible, translate: [0, 1, 0]}]\n")
                .find("lacks 'mandible', which moves"),
            std::string::npos);
  EXPECT_NE(plan("plan: {pieces: skull, box: {rotate: [0, -1, 0]}}\n").find("0 … 90"),
            std::string::npos);
  EXPECT_NE(plan("plan: {pieces: skull}\ncollision: {mode: clamp}\n").find("clamp"),
            std::string::npos);
}

TEST(Scene, TableHasTheDefaultsOfTheCode) {
  const Scene plain = read(minimal);
  const auto standard = [](const char* path) { return find_key(path).standard; };
  const Scene spelled = read(
      fmt::format("{}boundary: {{rim: {}}}\nsolve: {{functional: {}, accuracy: {}, load_steps: "
                  "{}}}\n",
                  minimal, standard("boundary.rim"), standard("solve.functional"),
                  standard("solve.accuracy"), standard("solve.load_steps")));
  EXPECT_EQ(plain.rim, spelled.rim);
  EXPECT_EQ(plain.solve.functional, spelled.solve.functional);
  EXPECT_EQ(plain.solve.volume, spelled.solve.volume);
  EXPECT_EQ(base::parse_number(standard("solve.lambda")), plain.solve.lambda);
  EXPECT_EQ(plain.solve.accuracy, spelled.solve.accuracy);
  EXPECT_EQ(plain.solve.load_steps, spelled.solve.load_steps);
  const Tissue& tissue = plain.tissue;
  EXPECT_EQ(base::parse_number(standard("tissue.attach_within")), tissue.attach_within);
  EXPECT_EQ(base::parse_number(standard("tissue.free_thickness")), tissue.free_thickness);
  EXPECT_EQ(base::parse_number(standard("tissue.release")), tissue.release);
  EXPECT_EQ(base::parse_number(standard("tissue.margin")), tissue.margin);
  EXPECT_EQ(base::parse_number(standard("tissue.turgor")), tissue.turgor);
}

const char* const full = R"(skin: face.ply
bones:
  - {name: skull, file: skull.ply}
  - {name: mandible, file: sub/../mandible.ply}
tissue:
  layers: 4
  depths: [0, 0.15, 0.5, 1]
  attach_within: 25
  free_thickness: 11
  release: 0
  unattached:
    - {sphere: {center: [0, 80, -30], radius: 20}}
  springs:
    default:      {stiffness: 1.0, law: quartic, reference: 1.0}
    "layer 0":    {stiffness: 2.0, law: linear}
    connecting:   {modulus: 0.02, reference: initial}
    diagonal 2:   {law: quadratic}
  turgor: 0.05
  mass: [0.05, 0.1, 0.1, 0]
gravity: [0, 0, -9.80665]
boundary: {rim: free}
moves:
  - {bone: mandible, rotate: {axis: [1, 0, 0], center: [0, 10, 20], angle: 90}}
  - {bone: mandible, translate: [0, 6, 0]}
forces:
  - {at: [1, 2, 3], radius: 5, force: [0, 0, -2]}
solve:
  functional: force
  volume: {form: paper}
  lambda: 1
  accuracy: 1e-3
  load_steps: 8
)";

TEST(Scene, FullTissue) {
  const Tissue tissue = read(full).tissue;
  EXPECT_EQ(tissue.depths, (std::vector<double>{0, 0.15, 0.5, 1}));
  EXPECT_EQ(tissue.attach_within, 25);
  EXPECT_EQ(tissue.free_thickness, 11);
  EXPECT_EQ(tissue.release, 0);
  ASSERT_EQ(tissue.attach_regions.size(), 1u);
  EXPECT_EQ(tissue.attach_regions[0].attach, Attach::contact);
  const auto& ball = std::get<Sphere>(tissue.attach_regions[0].where);
  EXPECT_EQ(ball.center, Vec3(0, 80, -30));
  EXPECT_EQ(ball.radius, 20);
  EXPECT_EQ(tissue.turgor, 0.05);
  EXPECT_EQ(tissue.mass, (std::vector<double>{0.05, 0.1, 0.1, 0}));
  EXPECT_FALSE(tissue.density);
}

TEST(Scene, TheFaceThatIsSolvedIsChosenWhereTheSkinIsRemeshed) {
  const auto with = [](const std::string& keys) {
    return minimal.substr(0, minimal.find("tissue")) + "tissue: {layers: 4" + keys + "}\n";
  };
  EXPECT_TRUE(read(with(", edge: 4")).tissue.face.empty());
  EXPECT_EQ(read(with(", edge: 4, margin: 20")).tissue.margin, 20);
  EXPECT_TRUE(read(with(", edge: given")).tissue.keeps_given_skin);
  EXPECT_FALSE(read(with(", edge: given")).tissue.edge.has_value());
  const auto face = read(with(", edge: auto, face: [{box: {center: [1, 2, 3], size: [4, 5, 6]}}, "
                              "{curve: [[0, 0, 0], [9, 0, 0]], radius: 8}]"))
                        .tissue.face;
  ASSERT_EQ(face.size(), 2u);
  EXPECT_EQ(std::get<Box>(std::get<Region>(face[0])).size, Vec3(4, 5, 6));
  EXPECT_EQ(std::get<CurveRegion>(std::get<Region>(face[1])).radius, 8);
  const std::string ball = ", face: [{sphere: {center: [0, 0, 0], radius: 9}}]";
  EXPECT_NE(refused(with(ball)).find("tissue.face needs tissue.edge"), std::string::npos);
  EXPECT_NE(refused(with(", margin: 20")).find("tissue.margin needs tissue.edge"),
            std::string::npos);
  EXPECT_NE(refused(with(", edge: 4, margin: 20" + ball)).find("exclude each other"),
            std::string::npos);
}

TEST(Scene, FullSprings) {
  const auto springs = read(full).tissue.springs;
  ASSERT_EQ(springs.size(), 4u);
  EXPECT_EQ(springs.at("default").stiffness, 1.0);
  EXPECT_EQ(springs.at("default").law, Law::quartic);
  EXPECT_EQ(springs.at("default").reference, 1.0);
  EXPECT_EQ(springs.at("layer 0").law, Law::linear);
  EXPECT_FALSE(springs.at("layer 0").reference);
  EXPECT_EQ(springs.at("connecting").modulus, 0.02);
  EXPECT_FALSE(springs.at("connecting").stiffness);
  EXPECT_EQ(springs.at("connecting").reference, 0.0);
  EXPECT_EQ(springs.at("diagonal 2").law, Law::quadratic);
}

TEST(Scene, FullRest) {
  const Scene scene = read(full);
  EXPECT_EQ(scene.bones[1].surface.file.filename(), "mandible.ply");
  EXPECT_EQ(scene.bones[1].surface.file.parent_path(), scene.skin.file.parent_path())
      << "normalized";
  EXPECT_EQ(*scene.gravity, Vec3(0, 0, -9.80665));
  EXPECT_EQ(scene.rim, Rim::free);
  ASSERT_EQ(scene.forces.size(), 1u);
  EXPECT_EQ(scene.forces[0].at, Vec3(1, 2, 3));
  EXPECT_EQ(scene.forces[0].radius, 5);
  EXPECT_EQ(scene.forces[0].force, Vec3(0, 0, -2));
  EXPECT_EQ(scene.solve.functional, Functional::force);
  EXPECT_EQ(scene.solve.volume, VolumeTerm::paper);
  EXPECT_EQ(scene.solve.lambda, 1);
  EXPECT_EQ(scene.solve.accuracy, 1e-3);
  EXPECT_EQ(scene.solve.load_steps, 8);
}

TEST(Scene, MovesApplyInTheOrderOfTheFile) {
  const Scene scene = read(full);
  EXPECT_TRUE(scene.moves[0].is_identity());
  // (0, 11, 20) lies 1 mm along y from the axis: the quarter turn about x takes it to (0, 10, 21).
  expect_near(scene.moves[1].apply({0, 11, 20}), {0, 16, 21});
}

RigidMotion skull_move(const std::string& forms) {
  const Folder folder;
  folder.write("plan.tfm",
               "#Insight Transform File V1.0\nTransform: TranslationTransform_double_3_3\n"
               "Parameters: 0 0 -7\n");
  return read_scene(folder.write("s.yaml", minimal + "moves:\n" + forms)).moves[0];
}

TEST(Scene, EveryFormOfAMove) {
  const Vec3 p(1, 0, 0);
  const std::string turn = "{axis: [0, 0, 2], center: [0, 0, 0], angle: 90}";
  const auto moved = [&](const std::string& form) {
    return skull_move("  - {bone: skull, " + form + "}\n").apply(p);
  };
  expect_near(moved("translate: [1, 2, 3]"), {2, 2, 3});
  expect_near(moved("translate: [[1, 2, 3], [10, 0, 0]]"), {12, 2, 3});
  expect_near(moved("rotate: " + turn), {0, 1, 0});
  expect_near(moved("rotate: [" + turn + ", " + turn + "]"), {-1, 0, 0});
  expect_near(moved("transform: plan.tfm"), {1, 0, 7});
  expect_near(moved("transform: [[1,0,0,5],[0,0,-1,0],[0,1,0,0],[0,0,0,1]]"), {6, 0, 0});
  expect_near(moved("transform: [{translate: [1, 0, 0]}, {rotate: " + turn +
                    "}, plan.tfm, "
                    "[[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]]"),
              {5, 2, 7});
  expect_near(moved("transform: [[[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]]"), {6, 0, 0});
}

const std::string cut_chin =
    "osteotomies:\n"
    "  - {bone: mandible, piece: chin, planes: [{point: [1, 2, 3], normal: [0, 0, -2]}], kerf: 1}\n"
    "  - {bone: chin, piece: tip, surface: skull.ply, seed: [4, 5, 6]}\n";

TEST(Scene, PiecesAreBones) {
  const Scene scene = read(minimal + cut_chin + "moves: [{bone: tip, translate: [0, 0, 1]}]\n");
  ASSERT_EQ(scene.bones.size(), 4u);
  EXPECT_EQ(scene.bones[2].name, "chin");
  EXPECT_EQ(scene.bones[3].name, "tip");
  EXPECT_EQ(scene.bones[3].surface.file.filename(), "mandible.ply");
  ASSERT_EQ(scene.osteotomies.size(), 2u);
  const Osteotomy& chin = scene.osteotomies[0];
  EXPECT_EQ(chin.bone, 1u);
  EXPECT_EQ(chin.piece, 2u);
  ASSERT_EQ(chin.planes.size(), 1u);
  expect_near(chin.planes[0].point, {1, 2, 3});
  expect_near(chin.planes[0].normal, {0, 0, -2});
  EXPECT_FALSE(chin.planes[0].radius);
  EXPECT_EQ(chin.kerf, 1);
  EXPECT_EQ(scene.osteotomies[1].bone, 2u);
  EXPECT_EQ(scene.osteotomies[1].surface->filename(), "skull.ply");
  expect_near(*scene.osteotomies[1].seed, {4, 5, 6});
  EXPECT_TRUE(scene.moves[2].is_identity()) << "a piece is not carried by another";
  expect_near(scene.moves[3].apply({0, 0, 0}), {0, 0, 1});
}

TEST(Scene, SeveralBonesMakeOneMove) {
  const Scene scene =
      read(minimal + cut_chin + "moves: [{bone: [mandible, chin], translate: [0, 6, 0]}]\n");
  EXPECT_TRUE(scene.moves[0].is_identity());
  expect_near(scene.moves[1].apply({0, 0, 0}), {0, 6, 0});
  expect_near(scene.moves[2].apply({0, 0, 0}), {0, 6, 0});
}

RigidMotion landmark_move(const std::string& form, std::vector<std::string>* remarks = nullptr) {
  const Folder folder;
  folder.write("points.json",
               "{\"chin\": [1, 2, 3], \"left\": [5, 0, 0], \"axis\": {\"point\": [0, 0, 0]}}");
  const Scene scene = read_scene(folder.write(
      "s.yaml", minimal + "landmarks: points.json\nmoves: [{bone: skull, " + form + "}]\n"));
  if (remarks) *remarks = scene.remarks;
  return scene.moves[0];
}

TEST(Scene, LandmarksOfOtherSpellingsHaveTheirStandardNamesToo) {
  const Folder folder;
  folder.write("points.json", "{\"Pogonion Soft\": [0, -90, -60], \"wart\": [1, 2, 3]}");
  const Scene scene = read_scene(folder.write("s.yaml", minimal + "landmarks: points.json\n"));
  EXPECT_EQ(scene.landmarks.size(), 3u);
  EXPECT_EQ(scene.landmarks.at("pogonion_soft"), scene.landmarks.at("Pogonion Soft"));
}

TEST(Scene, LandmarksInRasAreRefused) {
  const Folder folder;
  folder.write("points.json",
               "{\"condyle_right_center\": [50, 0, 0], \"condyle_left_center\": [-50, 0, 0], "
               "\"stomion\": [0, 90, -20]}");
  const std::string scene = folder.write("s.yaml", minimal + "landmarks: points.json\n");
  EXPECT_NE(refusal([&] { read_scene(scene); }).find("as in RAS"), std::string::npos);
}

TEST(Scene, LandmarksGoToTheirPlaces) {
  expect_near(landmark_move("landmark: {from: chin, to: [1, 2, 9]}").apply({0, 0, 0}), {0, 0, 6});
  const RigidMotion two =
      landmark_move("landmark: [{from: [0, 0, 0], to: [0, 0, 1]}, {from: left, to: [0, 5, 1]}]");
  expect_near(two.apply({5, 0, 0}), {0, 5, 1});
  expect_near(two.apply({0, 0, 7}), {0, 0, 8});
  std::vector<std::string> remarks;
  const RigidMotion three = landmark_move(
      "landmark: [{from: [0, 0, 0], to: [0, 0, 0]}, {from: left, to: [0, 5, 0]}, "
      "{from: [0, 5, 0], to: [-5, 0, 3]}]",
      &remarks);
  EXPECT_LT((three.apply({5, 0, 0}) - Vec3(0, 5, 0)).norm(), 2);
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_NE(remarks[0].find("moves[0].landmark: a rigid motion brings the landmarks within"),
            std::string::npos);
}

TEST(Scene, EarlierMovesCarryALandmark) {
  const std::string list =
      "transform: [{translate: [10, 0, 0]}, {landmark: {from: chin, to: [1, 2, 9]}}]";
  expect_near(landmark_move(list).apply({1, 2, 3}), {1, 2, 9});
  const Scene scene = read(minimal +
                           "moves:\n  - {bone: skull, translate: [10, 0, 0]}\n"
                           "  - {bone: skull, landmark: {from: [1, 2, 3], to: [1, 2, 9]}}\n");
  expect_near(scene.moves[0].apply({1, 2, 3}), {1, 2, 9});
}

TEST(Scene, Collision) {
  EXPECT_FALSE(read(minimal).collision);
  const Scene scene = read(minimal + "collision: {mode: clamp, clearance: 0.5, tolerance: 0.01}\n");
  EXPECT_EQ(scene.collision->mode, CollisionMode::clamp);
  EXPECT_EQ(scene.collision->clearance, 0.5);
  EXPECT_EQ(scene.collision->tolerance, 0.01);
  EXPECT_EQ(read(minimal + "collision: {}\n").collision->tolerance,
            base::parse_number(find_key("collision.tolerance").standard));
}

TEST(Scene, AnchorsAndMergeKeys) {
  const Scene scene = read(minimal + R"(forces:
  - &push {at: [1, 2, 3], radius: 5, force: &f [0, 0, -2]}
  - {<<: *push, radius: 7}
  - {radius: 8, force: *f, <<: [{at: [4, 5, 6], radius: 1}, *push]}
)");
  ASSERT_EQ(scene.forces.size(), 3u);
  EXPECT_EQ(scene.forces[1].radius, 7) << "what stands in the map beats what is merged";
  EXPECT_EQ(scene.forces[1].force, Vec3(0, 0, -2));
  EXPECT_EQ(scene.forces[2].radius, 8);
  EXPECT_EQ(scene.forces[2].at, Vec3(4, 5, 6)) << "an earlier merge beats a later one";
}

TEST(Scene, MassWithoutGravityAndDensityWithIt) {
  EXPECT_EQ(
      read("skin: face.ply\nbones: []\ntissue: {layers: 2, mass: [1, 2]}\n").tissue.mass.size(),
      2u);
  const Scene scene = read(
      "skin: face.ply\nbones: []\ntissue: {layers: 2, density: 1e-6}\ngravity: [0, 0, -9.8]\n");
  EXPECT_EQ(scene.tissue.density, 1e-6);
}

struct Bad {
  std::string text;      // the whole file, or lines after the five of the minimal scene
  std::string expected;  // place and words
  bool whole = false;
};

void expect_refused(const std::vector<Bad>& cases) {
  for (const Bad& bad : cases) {
    const std::string message = refused(bad.whole ? bad.text : minimal + bad.text);
    EXPECT_NE(message.find(bad.expected), std::string::npos)
        << bad.text.substr(0, 200) << "\nsaid   " << message << "\nwanted " << bad.expected;
  }
}

/// A scene whose tissue has these keys besides four layers; they begin at 4:21.
Bad tissue(const std::string& keys, const std::string& expected) {
  return {"skin: face.ply\nbones:\n  - {name: skull, file: skull.ply}\ntissue: {layers: 4, " +
              keys + "}\n",
          expected, true};
}

TEST(SceneRefuses, UnknownAndMisplacedKeys) {
  expect_refused({
      {"tisue: {layers: 4}\n",
       "scene.yaml:6:1: the scene has an unknown key 'tisue'; the nearest known one is 'tissue'"},
      {"free_thickness: 3\n",
       "6:1: the scene has an unknown key 'free_thickness'; the nearest known one is "
       "'tissue.free_thickness'"},
      {"solve: {accurcay: 1}\n",
       "6:9: solve has an unknown key 'accurcay'; the nearest known one is 'accuracy'"},
      {"solve: {accuracy: 0,01}\n",
       "6:21: solve has the number '01' in place of a key; decimals follow a point, not a comma"},
      {"moves:\n  - {bone: skull, rotat: 3}\n",
       "7:19: moves[0] has an unknown key 'rotat'; the nearest known one is 'rotate'"},
      {"skin: face.ply\n", "6:1: the scene has the key 'skin' twice (first in line 1)"},
      {"solve: {lambda: 1, lambda: 0}\n", "6:20: solve has the key 'lambda' twice"},
      {"? [a, b]\n: 3\n", "6:3: the scene has a key that is not a text"},
      {"solve:\n", "6:1: the scene has no value for 'solve': give a map, or remove the key"},
      {"gravity: ~\n", "6:1: the scene has no value for 'gravity'"},
      {"solve: &a {<<: *a}\n", "6:8: solve merges (<<) more than 8 deep, or itself"},
      {"solve: {<<: 3}\n", "6:9: solve merges (<<) what is not a map"},
  });
}

TEST(SceneRefuses, MissingKeysAndWrongShapes) {
  expect_refused({
      {"bones: []\ntissue: {layers: 4}\n", "1:1: the scene lacks the key 'skin': a file", true},
      {"skin: face.ply\ntissue: {layers: 4}\n", "the scene lacks the key 'bones'", true},
      {"skin: face.ply\nbones: []\n", "the scene lacks the key 'tissue'", true},
      {"skin: face.ply\nbones: []\ntissue: {release: 4}\n",
       "3:9: tissue lacks the key 'layers': a whole number, 2 … 64", true},
      {"skin: face.ply\nbones: skull.ply\ntissue: {layers: 4}\n",
       "2:8: bones must be a list, it is 'skull.ply'", true},
      {"skin: face.ply\nbones: [skull.ply]\ntissue: {layers: 4}\n",
       "2:9: bones[0] must be a map, it is 'skull.ply'", true},
      {"skin: face.ply\nbones: [{name: skull}]\ntissue: {layers: 4}\n",
       "2:9: bones[0] needs either file", true},
      {"solve: energy\n", "6:8: solve must be a map, it is 'energy'"},
      {"solve: {volume: none}\n", "6:17: solve.volume must be a map, it is 'none'"},
      {"gravity: -9.8\n", "6:10: gravity must be three numbers [x, y, z] of N/kg, it is '-9.8'"},
      {"gravity: [0, 0]\n", "6:10: gravity must be three numbers [x, y, z] of N/kg, it is a list"},
      {"gravity: [0, 0, down]\n", "6:17: gravity[2] must be a number of N/kg, it is 'down'"},
      {"forces: [{at: [0, 0, 0], radius: 1}]\n", "6:10: forces[0] lacks the key 'force'"},
  });
}

TEST(SceneRefuses, NumbersOutOfRangeOrNone) {
  expect_refused({
      tissue("free_thickness: 0",
             "4:37: tissue.free_thickness must be a number of mm, > 0, it is '0'"),
      tissue("free_thickness: -3", "it is '-3'"),
      tissue("free_thickness: .nan", "must be a number of mm, > 0, it is '.nan'"),
      tissue("free_thickness: .inf", "it is '.inf'"),
      tissue("free_thickness: 12 mm", "it is '12 mm'"),
      tissue("free_thickness: 1e999", "it is '1e999'"),
      tissue("free_thickness: [12]", "it is a list"),
      tissue("release: -1", "tissue.release must be a number of mm, ≥ 0, it is '-1'"),
      tissue("turgor: 5", "tissue.turgor must be a number, 0 … 1, it is '5'"),
      tissue("mass: [1, 2, 3, -4]", "4:37: tissue.mass[3] must be a number of kg, ≥ 0, it is '-4'"),
      tissue("mass: [1, 2, 3]", "tissue.mass must have one number a layer: 4 layers, it has 3"),
      tissue("mass: 1", "tissue.mass must be a list, each a number of kg, ≥ 0, it is '1'"),
      tissue("mass: [1, 1, 1, 1], density: 1",
             "4:27: tissue.mass and tissue.density exclude each other"),
      {"skin: face.ply\nbones: []\ntissue: {layers: 65}\n",
       "tissue.layers must be a whole number, 2 … 64, it is '65'", true},
      {"skin: face.ply\nbones: []\ntissue: {layers: 1}\n", "it is '1'", true},
      {"skin: face.ply\nbones: []\ntissue: {layers: 2.5}\n", "it is '2.5'", true},
      tissue("material: face", "must be a map, it is 'face'; write material: {preset: face}"),
      {"solve: {lambda: 1.5}\n", "solve.lambda must be a number, > 0 and ≤ 1, it is '1.5'"},
      {"solve: {lambda: 0.3}\n", "6:17: solve.lambda is of tissue.springs"},
      {"solve: {volume: {bulk_modulus: 9}}\n", "solve.volume.bulk_modulus is of tissue.springs"},
      {"solve: {volume: {poisson: 0.4}}\n", "solve.volume.poisson is of tissue.springs"},
      {"solve: {accuracy: 0}\n", "solve.accuracy must be a number of mm, 1e-12 … 100, it is '0'"},
      {"solve: {load_steps: 0}\n",
       "solve.load_steps must be a whole number, 1 … 100000, or auto, it is '0'"},
      {"solve: {load_steps: atuo}\n", "or auto, it is 'atuo'"},
      {"solve: {volume: {bulk_modulus: 0}}\n",
       "solve.volume.bulk_modulus must be a number of N/mm², > 0 and ≤ 1e+09, it is '0'"},
      {"forces: [{at: [0, 0, 0], radius: 0, force: [0, 0, 1]}]\n",
       "6:34: forces[0].radius must be a number of mm, > 0"},
  });
}

/// Every key of a volume term is read where the term is the scene's, and refused where it is not.
TEST(Scene, ReadsTheKeysOfItsVolumeTermOnly) {
  const auto with = [](const std::string& keys) {
    return "skin: face.ply\nbones: []\ntissue: {layers: 2, springs: {default: {stiffness: 1}}}\n"
           "solve: {" +
           keys + "}\n";
  };
  EXPECT_EQ(read(with("volume: {bulk_modulus: 0.1}")).solve.bulk_modulus, 0.1);
  EXPECT_EQ(read(with("volume: {form: penalty, poisson: 0.4}")).solve.poisson, 0.4);
  EXPECT_EQ(read(with("lambda: 0.3, volume: {form: paper}")).solve.lambda, 0.3);
  for (const auto& [keys, expected] : std::vector<std::pair<std::string, std::string>>{
           {"lambda: 0.3",
            "4:17: solve.lambda is of volume form paper, and the form is penalty; give "
            "solve.volume.form: paper, or remove it"},
           {"lambda: 0.3, volume: {form: none}", "and the form is none"},
           {"lambda: 0.3, functional: force", "and the form is none"},
           {"volume: {form: paper, bulk_modulus: 0.1}",
            "solve.volume.bulk_modulus is of volume form penalty, and the form is paper"},
           {"volume: {form: none, poisson: 0.4}", "solve.volume.poisson is of volume form penalty"},
           {"functional: force, volume: {poisson: 0.4}", "and the form is none"}})
    EXPECT_NE(refused(with(keys)).find(expected), std::string::npos) << refused(with(keys));
}

TEST(SceneRefuses, Words) {
  expect_refused({
      {"boundary: {rim: fxied}\n",
       "6:17: boundary.rim must be one of fixed, free, auto, it is 'fxied'; the nearest is fixed"},
      {"boundary: {rim: true}\n", "it is 'true'"},
      {"solve: {functional: forces}\n",
       "solve.functional must be one of energy, force, it is 'forces'; the nearest is force"},
      {"solve: {volume: {form: penatly}}\n",
       "solve.volume.form must be one of none, paper, penalty, it is 'penatly'; the nearest "
       "is penalty"},
      {"solve: {functional: [energy]}\n", "it is a list"},
  });
}

TEST(SceneRefuses, Depths) {
  expect_refused({
      tissue("depths: [0, 1]",
             "4:29: tissue.depths must have one number a layer: 4 layers, it has 2"),
      tissue("depths: [0.1, 0.2, 0.5, 1]",
             "must begin with 0 (the skin) and end with 1 (the bone), it goes from 0.1 to 1"),
      tissue("depths: [0, 0.2, 0.5, 0.9]", "it goes from 0 to 0.9"),
      tissue("depths: [0, 0.5, 0.5, 1]",
             "4:38: tissue.depths[2] must be greater than the one before (0.5), it is 0.5"),
      tissue("depths: [0, 0.5, 1.5, 1]", "tissue.depths[2] must be a number, 0 … 1, it is '1.5'"),
  });
}

TEST(SceneRefuses, SpringRules) {
  expect_refused({
      tissue("springs: {layer 4: {law: linear}}",
             "tissue.springs \"layer 4\" is no set of springs; the nearest is 'layer 0' (layer 0 … "
             "3, connecting and diagonal 0 … 2)"),
      tissue("springs: {connecting 3: {law: linear}}",
             "is no set of springs; the nearest is 'connecting 0'"),
      tissue("springs: {conecting: {law: linear}}", "the nearest is 'connecting'"),
      tissue("springs: {layer -1: {law: linear}}", "is no set of springs"),
      tissue("springs: {layer 00: {law: linear}}", "is no set of springs"),
      tissue("springs: {layer: {stiffness: 1, modulus: 1}}",
             "tissue.springs \"layer\" gives stiffness and modulus"),
      tissue("springs: {layer: {stiffness: 0}}",
             "tissue.springs \"layer\".stiffness must be a number of N/mm, > 0, it is '0'"),
      tissue("springs: {layer: {law: cubic}}",
             "must be one of linear, quadratic, quartic, it is 'cubic'"),
      tissue("springs: {layer: {reference: 0}}",
             "reference must be a number of mm, > 0, or initial, it is '0'"),
      tissue("springs: {layer: {refrence: 1}}",
             "4:39: tissue.springs \"layer\" has an unknown key 'refrence'; the nearest known one "
             "is 'reference'"),
      tissue("springs: {layer: 1, layer: 2}", "4:41: tissue.springs has the key 'layer' twice"),
      tissue("springs: {layer: }", "tissue.springs \"layer\" must be a map, it is empty"),
      tissue("springs: [1]", "tissue.springs must be a map, it is a list"),
  });
}

TEST(SceneRefuses, Files) {
  expect_refused({
      {"skin: fase.ply\nbones: []\ntissue: {layers: 4}\n",
       "1:7: skin names 'fase.ply', which is no file", true},
      {"skin: sub\nbones: []\ntissue: {layers: 4}\n",
       "1:7: skin names the folder 'sub'; a file is needed", true},
      {"skin: \"\"\nbones: []\ntissue: {layers: 4}\n", "1:7: skin must be a file", true},
      {"skin: [face.ply]\nbones: []\ntissue: {layers: 4}\n",
       "1:7: skin must be a file, relative to the scene's folder, or a map, it is a list", true},
      {"skin: face.ply\nbones: [{name: a, file: /dev/zero}]\ntissue: {layers: 4}\n",
       "2:25: bones[0].file names '/dev/zero', which is no file", true},
      {"moves: [{bone: skull, transform: plan.tfm}]\n",
       "6:34: moves[0].transform names 'plan.tfm', which is no file"},
      {"moves: [{bone: skull, transform: face.ply}]\n", "6:34: moves[0].transform is refused: "},
  });
}

TEST(SceneRefuses, BonesAndMoves) {
  const std::string rotate =
      "moves:\n  - {bone: skull, rotate: {axis: [1, 0, 0], center: [0, 0, 0], angle: 200}}\n";
  const std::string null_axis =
      "moves:\n  - {bone: skull, rotate: {axis: [0, 0, 0], center: [0, 0, 0], angle: 2}}\n";
  expect_refused({
      {"skin: face.ply\nbones:\n  - {name: a, file: skull.ply}\n  - {name: a, file: "
       "skull.ply}\ntissue: {layers: 4}\n",
       "4:12: bones[1].name 'a' is the name of two bones", true},
      {"skin: face.ply\nbones: [{name: \"\", file: skull.ply}]\ntissue: {layers: 4}\n",
       "2:16: bones[0].name must be a text", true},
      {"skin: face.ply\nbones: [{name: Schädel, file: skull.ply}]\ntissue: {layers: 4}\n",
       "must be 1 to 64 printable ASCII", true},
      {"skin: face.ply\nbones: [{name: a/b, file: skull.ply}]\ntissue: {layers: 4}\n",
       "2:16: bones[0].name 'a/b' must be 1 to 64 printable ASCII characters without '/'", true},
      {"skin: face.ply\nbones: [{name: \"a\\0b\", file: skull.ply}]\ntissue: {layers: 4}\n",
       "must be 1 to 64 printable ASCII characters", true},
      {"osteotomies: [{bone: skull, piece: ../x, surface: face.ply}]\n",
       "6:36: osteotomies[0].piece '../x' must be 1 to 64 printable ASCII characters without '/'"},
      {"moves: [{bone: mandibel, translate: [0, 0, 1]}]\n",
       "6:16: moves[0].bone 'mandibel' is no bone of the scene; the nearest is 'mandible'"},
      {"skin: face.ply\nbones:\ntissue: {layers: 4}\nmoves: []\n", "bones lists no bone; give at",
       true},
      {"skin: face.ply\nbones: []\ntissue: {layers: 4}\nmoves: [{bone: jaw, translate: [1, 0, "
       "0]}]\n",
       "bones lists no bone; give at", true},
      {"moves: [{bone: skull, rotate: {axis: [1, 0, 0], center: [0, 0, 0], angle: 270}}]\n",
       "it is '270'; write -90, which ends in the same place"},
      {"moves: [{bone: skull}]\n",
       "6:9: moves[0] must hold exactly one of translate, rotate, landmark, transform"},
      {"moves: [{bone: skull, translate: [0, 0, 1], transform: face.ply}]\n",
       "moves[0] must hold exactly one of"},
      {"moves: [{translate: [0, 0, 1]}]\n", "moves[0] lacks the key 'bone'"},
      {"moves: [{bone: skull, translate: []}]\n",
       "moves[0].translate must be three numbers [x, y, z] of mm"},
      {"moves: [{bone: skull, translate: 6}]\n", "it is '6'"},
      {"moves: [{bone: skull, rotate: []}]\n", "moves[0].rotate is an empty list"},
      {rotate, "7:71: moves[0].rotate.angle must be a number of degrees, -180 … 180, it is '200'"},
      {null_axis, "7:34: moves[0].rotate.axis is refused: the axis of a rotation must not be zero"},
      {"moves: [{bone: skull, rotate: {axis: [0, 0, 1], angle: 2}}]\n",
       "moves[0].rotate lacks the key 'center'"},
      {"moves: [{bone: skull, transform: [[1, 0], [0, 1]]}]\n",
       "moves[0].transform must be a 4×4 matrix, it has 2 rows"},
      {"moves: [{bone: skull, transform: [[1,0,0,0],[0,1,0,0],[0,0,1],[0,0,0,1]]}]\n",
       "moves[0].transform[2] must be a row of four numbers, it has 3"},
      {"moves: [{bone: skull, transform: [[1,0,0,0],2,[0,0,1],[0,0,0,1]]}]\n",
       "moves[0].transform[1] must be a row of four numbers"},
      {"moves: [{bone: skull, transform: [[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]}]\n",
       "moves[0].transform is refused: the matrix is not rigid"},
      {"moves: [{bone: skull, transform: [[1,0,0,x],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]\n",
       "moves[0].transform[0][3] must be a number, it is 'x'"},
      {"moves: [{bone: skull, transform: {translate: [0, 0, 1]}}]\n",
       "moves[0].transform must be a file, a 4×4 matrix, or a list, it is a map"},
      {"moves: [{bone: skull, transform: [{translate: [0, 0, 1], rotate: 3}]}]\n",
       "moves[0].transform[0] must hold exactly one of translate, rotate, landmark"},
      {"moves: [{bone: skull, transform: &a [*a]}]\n", "6:34: moves[0].transform"},
      {"moves: [{bone: skull, transform: &a [{transform: *a}]}]\n",
       "moves[0].transform[0] has an unknown key 'transform'"},
  });
}

TEST(SceneRefuses, OsteotomiesAndLandmarks) {
  expect_refused({
      {"osteotomies: [{bone: skul, piece: a, surface: face.ply}]\n",
       "6:22: osteotomies[0].bone 'skul' is no bone of the scene; the nearest is 'skull'"},
      {"osteotomies: [{bone: skull, piece: mandible, surface: face.ply}]\n",
       "osteotomies[0].piece 'mandible' is the name of two bones"},
      {"osteotomies: [{bone: skull, piece: a}]\n", "osteotomies[0] has no cut; give planes"},
      {"osteotomies: [{bone: skull, piece: a, planes: []}]\n", "osteotomies[0] has no cut"},
      {"osteotomies: [{bone: skull, piece: a, planes: [{point: [0, 0, 0], normal: [0, 0, 0]}]}]\n",
       "osteotomies[0].planes[0].normal must not be zero"},
      {"osteotomies: [{bone: skull, piece: a, surface: face.ply, kerf: 21}]\n",
       "osteotomies[0].kerf must be a number of mm, 0 … 20, it is '21'"},
      {"osteotomies: [{bone: skull, piece: a, surface: no.ply}]\n", "which is no file"},
      {"moves: [{bone: chin, translate: [0, 0, 1]}]\n",
       "6:16: moves[0].bone 'chin' is no bone of the scene; the nearest is"},
      {"moves: [{bone: [], translate: [0, 0, 1]}]\n",
       "moves[0].bone must be a text, or a list of texts"},
      {"moves: [{bone: [skull, mandibel], translate: [0, 0, 1]}]\n",
       "moves[0].bone[1] 'mandibel' is no bone"},
      {"moves: [{bone: skull, landmark: {from: chin, to: [0, 0, 0]}}]\n",
       "moves[0].landmark.from names landmark 'chin', but the scene has none"},
      {"moves: [{bone: skull, landmark: []}]\n", "moves[0].landmark is an empty list"},
      {"moves: [{bone: skull, landmark: [{from: [0,0,0], to: [0,0,1]}, {from: [0,0,0], to: "
       "[1,1,1]}]}]\n",
       "moves[0].landmark is refused: two landmarks in one place fix no turn"},
      {"landmarks: face.ply\n", "face.ply: the ending is none of .mrk.json"},
      {"collision: {mode: stopp}\n", "collision.mode must be one of report, stop, clamp"},
  });
  const std::string unknown = refusal([] { landmark_move("landmark: {from: chim, to: left}"); });
  EXPECT_NE(
      unknown.find("moves[0].landmark.from 'chim' is no landmark of the scene; the nearest is "
                   "'chin'"),
      std::string::npos)
      << unknown;
}

TEST(Scene, IncisionsAsPointsOrACurve) {
  const Scene scene =
      read(fmt::format("{}incisions:\n  - {{path: [[1, 2, 3], [4, 5, 6]], layers: 1}}\n"
                       "  - {{path: {}/head.mrk.json, layers: 2}}\n",
                       minimal, REPOSE_MESHES));
  ASSERT_EQ(scene.incisions.size(), 2u);
  EXPECT_EQ(scene.incisions[0].path, (std::vector<Vec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(scene.incisions[0].layers, 1);
  EXPECT_GT(scene.incisions[1].path.size(), 2u);
}

TEST(SceneRefuses, WhatCannotBe) {
  expect_refused({
      {"incisions:\n  - {path: [[1, 2, 3]], layers: 1}\n",
       "incisions[0].path must have two points at least, it has 1"},
      {"incisions:\n  - {path: [[1, 2], [3, 4]], layers: 1}\n",
       "incisions[0].path[0] must be three numbers [x, y, z] of mm"},
      {"incisions:\n  - {path: [[1, 2, 3], [4, 5, 6]], layers: 65}\n",
       "incisions[0].layers must be a whole number, 1 … 64, it is '65'"},
      {"incisions:\n  - {path: [[1, 2, 3], [4, 5, 6]], layers: 60}\n",
       "incisions[0].layers must be a whole number, 1 … 4, as tissue.layers is, it is 60"},
      {"gravity: [0, 0, -9.8]\n",
       "6:10: gravity needs a mass to pull; give tissue.mass or tissue.density"},
  });
}

TEST(Scene, SurfacesFromVolumes) {
  const Scene scene = read(
      "skin: {volume: sub, level: -300, box: [-9, -8, -7, 1, 2, 3], border: open, voxel: 2,"
      " close_holes: 3, smooth: 0}\n"
      "bones: [{name: a, volume: face.ply, label: 2}, {name: b, volume: face.ply, level: otsu}]\n"
      "tissue: {layers: 4}\n");
  const VolumeEntry& skin = scene.skin.volume.value();
  EXPECT_EQ(scene.skin.file.filename(), "sub") << "a folder of DICOM slices";
  EXPECT_EQ(skin.level, -300);
  EXPECT_FALSE(skin.label);
  EXPECT_EQ(skin.box.value()[0], Vec3(-9, -8, -7));
  EXPECT_EQ(skin.box.value()[1], Vec3(1, 2, 3));
  EXPECT_TRUE(skin.open);
  EXPECT_EQ(skin.voxel, 2);
  EXPECT_EQ(skin.close_holes, 3);
  EXPECT_EQ(skin.smooth, 0);
  const VolumeEntry& labeled = scene.bones[0].surface.volume.value();
  EXPECT_EQ(labeled.label, 2);
  EXPECT_FALSE(labeled.level || labeled.box || labeled.open);
  EXPECT_EQ(labeled.voxel, 0);
  EXPECT_EQ(labeled.smooth, 10);
  const VolumeEntry& otsu = scene.bones[1].surface.volume.value();
  EXPECT_FALSE(otsu.level || otsu.label);
}

TEST(SceneRefuses, VolumesThatSayTooLittleOrTooMuch) {
  const std::string rest = "\nbones: []\ntissue: {layers: 4}\n";
  const std::string skin = "skin: face.ply\nbones: [{name: a, ", end = "}]\ntissue: {layers: 4}\n";
  expect_refused({
      {"skin: {volume: ct.nrrd, level: 1}" + rest,
       "1:16: skin.volume names 'ct.nrrd', which is no file or folder", true},
      {"skin: {volume: sub}" + rest, "1:7: skin needs either level (HU, or otsu) or label", true},
      {"skin: {volume: sub, level: 1, label: 1}" + rest, "1:7: skin needs either level", true},
      {"skin: {level: 1}" + rest, "1:7: skin lacks the key 'volume'", true},
      {"skin: {file: face.ply}" + rest, "skin has an unknown key 'file'", true},
      {"skin: {volume: sub, level: high}" + rest, "skin.level must be a number of HU", true},
      {"skin: {volume: sub, label: 0}" + rest, "skin.label must be a whole number", true},
      {"skin: {volume: sub, level: 1, box: [1, 2, 3]}" + rest, "skin.box must have 6", true},
      {"skin: {volume: sub, level: 1, box: [0, 0, 5, 1, 1, 5]}" + rest,
       "skin.box must name the lowest x, y, z and then the highest: 5 is not below 5", true},
      {skin + end, "2:9: bones[0] needs either file", true},
      {skin + "file: face.ply, volume: sub, level: 1" + end, "bones[0] needs either file", true},
      {skin + "file: face.ply, voxel: 1" + end, "bones[0].voxel belongs to a volume", true},
  });
}

TEST(SceneRefuses, WhatIsNoScene) {
  expect_refused({
      {"", "scene.yaml:1:1: the file is empty", true},
      {"# only a comment\n", "scene.yaml:1:1: the file is empty", true},
      {"just text\n", "scene.yaml:1:1: the scene must be a map, it is 'just text'", true},
      {"- a\n- b\n", "scene.yaml:1:1: the scene must be a map, it is a list", true},
      {"solve: {lambda: [1\n", "not valid YAML: "},
      {"solve: *nowhere\n", "scene.yaml:6:8: not valid YAML: the referenced anchor is not defined"},
      {"a: b: c\n", "scene.yaml:1:5: not valid YAML: ", true},
      {"solve:\n\taccuracy: 1\n", "; line 7 is indented by a tab, use blanks"},
      {"solve: \"\\q\"\n", "scene.yaml:6:11: not valid YAML: unknown escape character: q"},
      {"landmarks: \"C:\\Users\\a.csv\"\n", "; line 6 has a \\ in quotes, write / between folders"},
      {"skin:face.ply\nbones: []\n", "; line 1 lacks a blank after the colon", true},
      {"skin: a\nbones:\n  - name:skull\n    file: b\n", "; line 3 lacks a blank after the colon",
       true},
      {"landmarks: sub\\a.csv\n",
       "which is no file (paths are relative to the scene's folder); "
       "write / between folders, not \\"},
      {"landmarks: FACE.ply\n", "; its folder holds 'face.ply'"},
      {std::string(100000, '['), "not valid YAML", true},
      {"--- {a: 1}\n--- {b: 2}\n", "scene.yaml:2:1: the file holds 2 documents", true},
      {std::string("skin: a\nab\0c", 12), "scene.yaml:2: not a text file", true},
      {std::string(2 << 20, 'x'), "scene.yaml: too large for a scene file", true},
  });
  const Folder folder;
  EXPECT_NE(refusal([&] { read_scene(folder.path("sub")); }).find("is a folder"),
            std::string::npos);
  EXPECT_NE(refusal([&] { read_scene(folder.path("none.yaml")); }).find("none.yaml: no such file"),
            std::string::npos);
  EXPECT_NE(refusal([] { read_scene("/dev/zero"); }).find("/dev/zero: no such file"),
            std::string::npos);
}

// Beginnings and one-byte changes of a valid scene are read or refused in one line, never worse.
TEST(SceneRefuses, DamagedFilesWithoutHarm) {
  const std::string whole = full, wrong = "[{\n\t*\"\xff:&-";
  for (std::size_t i = 0; i < whole.size(); i += 3) {
    std::string damaged = whole;
    damaged[i] = wrong[i % wrong.size()];
    refused(i % 2 == 0 ? damaged : whole.substr(0, i));
  }
}

TEST(Keys, EveryRowIsComplete) {
  for (const Key& key : all_keys()) {
    EXPECT_FALSE(key.sentence.empty()) << key.path;
    EXPECT_FALSE(expected(key).empty()) << key.path;
    EXPECT_EQ(&find_key(key.path), &key) << "twice in the table: " << key.path;
    if (key.kind == KeyKind::choice) {
      EXPECT_GE(key.choices.size(), 1u) << key.path;
    }
  }
}

TEST(Keys, DescribedInMarkdown) {
  const std::string table = describe_keys();
  EXPECT_NE(table.find("| `tissue.free_thickness` | a number of mm, > 0 | 12 |"), std::string::npos)
      << table;
  const auto lines = std::count(table.begin(), table.end(), '\n');
  EXPECT_EQ(lines, static_cast<long>(all_keys().size()) + 2);
}

TEST(Keys, DocumentationHoldsTheTable) {
  std::ifstream page(REPOSE_MESHES "/../docs/reference/scene_keys.md");
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  EXPECT_NE(text.find(describe_keys()), std::string::npos)
      << "replace the table in docs/reference/scene_keys.md by\n"
      << describe_keys();
}

}  // namespace scene_test
}  // namespace repose::scene
