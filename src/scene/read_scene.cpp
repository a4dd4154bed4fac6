#include <algorithm>
#include <map>

#include "bone_names.h"
#include "read_yaml.h"
#include "readers.h"
#include "repose/base/text.h"
#include "repose/scene/landmarks.h"
#include "repose/scene/scene.h"
#include "value.h"

namespace repose::scene {

namespace {

/// Sets `target` from an optional key by one of Value's functions; leaves its default otherwise.
template <class Target, class Result>
void set(Target& target, const Map& map, const char* name, Result (Value::*read)() const) {
  if (const auto value = map.find(name)) target = ((*value).*read)();
}

/// Sets an enumeration whose values are numbered as the key's choices.
template <class Enum, class Target>
void set_choice(Target& target, const Map& map, const char* name) {
  if (const auto value = map.find(name)) target = static_cast<Enum>(value->choice());
}

std::array<Vec3, 2> read_box(const Value& value) {
  const std::vector<double> n = value.numbers();
  if (n.size() != 6) value.refuse("must have 6 numbers (x y z twice), it has {}", n.size());
  for (int axis = 0; axis < 3; ++axis)
    if (!(n[axis] < n[axis + 3]))
      value.refuse("must name the lowest x, y, z and then the highest: {:g} is not below {:g}",
                   n[axis], n[axis + 3]);
  return {Vec3(n[0], n[1], n[2]), Vec3(n[3], n[4], n[5])};
}

SurfaceEntry read_volume_entry(const Map& map) {
  const auto path = map.find("volume")->file_or_folder();
  VolumeEntry entry;
  const auto level = map.find("level"), label = map.find("label");
  if (level.has_value() == label.has_value())
    map.itself().refuse("needs either level (HU, or otsu) or label beside volume");
  if (level && !level->is_word("otsu")) entry.level = level->number();
  if (label) entry.label = label->integer();
  if (const auto box = map.find("box")) entry.box = read_box(*box);
  if (const auto border = map.find("border")) entry.open = border->choice() == 1;
  set(entry.voxel, map, "voxel", &Value::number);
  set(entry.close_holes, map, "close_holes", &Value::number);
  set(entry.smooth, map, "smooth", &Value::integer);
  return {path, entry};
}

SurfaceEntry read_skin(const Value& value) {
  if (!value.is_map()) return {value.file(), std::nullopt};
  const Map map(value);
  if (!map.find("volume")) value.refuse("lacks the key 'volume'; or give a triangle mesh");
  return read_volume_entry(map);
}

SurfaceEntry read_bone_surface(const Map& map) {
  const auto file = map.find("file"), volume = map.find("volume");
  if (file.has_value() == volume.has_value())
    map.itself().refuse("needs either file (a triangle mesh) or volume");
  if (volume) return read_volume_entry(map);
  for (const char* key : {"level", "label", "box", "border", "voxel", "close_holes", "smooth"})
    if (const auto value = map.find(key))
      value->refuse("belongs to a volume, and this bone is a mesh; remove it");
  return {file->file(), std::nullopt};
}

std::vector<BoneEntry> read_bones(const Value& value) {
  std::vector<BoneEntry> bones;
  if (value.is_empty()) return bones;  // require_bones()
  for (const Value& item : value.items()) {
    const Map map(item);
    bones.push_back({read_new_name(map.at("name"), bones), read_bone_surface(map)});
  }
  return bones;
}

std::vector<double> read_one_a_layer(const Value& value, int layers) {
  std::vector<double> numbers = value.numbers();
  if (numbers.size() != static_cast<std::size_t>(layers))
    value.refuse("must have one number a layer: {} layers, it has {}", layers, numbers.size());
  return numbers;
}

void require_increasing(const Value& value, const std::vector<double>& depths) {
  for (std::size_t a = 1; a < depths.size(); ++a)
    if (!(depths[a] > depths[a - 1]))
      value.elements()[a].refuse("must be greater than the one before ({:g}), it is {:g}",
                                 depths[a - 1], depths[a]);
}

std::vector<double> read_depths(const Value& value, int layers) {
  std::vector<double> depths = read_one_a_layer(value, layers);
  if (depths.front() != 0 || depths.back() != 1)
    value.refuse(
        "must begin with 0 (the skin) and end with 1 (the bone), it goes from {:g} to {:g}",
        depths.front(), depths.back());
  require_increasing(value, depths);
  return depths;
}

std::vector<double> read_depths_mm(const Value& value, int layers) {
  std::vector<double> depths = value.numbers();
  if (depths.empty() || depths.size() > static_cast<std::size_t>(layers))
    value.refuse("must have 1 to {} numbers, at most one a layer; it has {}", layers,
                 depths.size());
  if (depths.front() != 0)
    value.refuse("must begin with 0 (the skin), it begins with {:g}", depths.front());
  require_increasing(value, depths);
  return depths;
}

/// Every name a spring rule may have in a model of so many layers.
std::vector<std::string> rule_names(int layers) {
  std::vector<std::string> names{"default"};
  for (const char* kind : {"layer", "connecting", "diagonal"}) {
    const int sets = std::string_view(kind) == "layer" ? layers : layers - 1;
    names.push_back(kind);
    for (int a = 0; a < sets; ++a) names.push_back(fmt::format("{} {}", kind, a));
  }
  return names;
}

SpringRule read_rule(const Value& value) {
  const Map map(value);
  SpringRule rule;
  set(rule.stiffness, map, "stiffness", &Value::number);
  set(rule.modulus, map, "modulus", &Value::number);
  if (rule.stiffness && rule.modulus)
    value.refuse("gives stiffness and modulus, which exclude each other; remove one");
  if (const auto law = map.find("law")) rule.law = static_cast<Law>(law->choice());
  if (const auto reference = map.find("reference"))
    rule.reference = reference->is_word("initial") ? 0.0 : reference->number();
  return rule;
}

std::map<std::string, SpringRule> read_rules(const Value& value, int layers) {
  const std::vector<std::string> names = rule_names(layers);
  std::map<std::string, SpringRule> rules;
  for (const auto& [name, rule] : value.named()) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      rule.refuse(
          "is no set of springs; the nearest is '{}' (layer 0 … {}, connecting and diagonal 0 … "
          "{})",
          base::nearest(name, names), layers - 1, layers - 2);
    rules[name] = read_rule(rule);
  }
  return rules;
}

void read_springs(const Value& value, Tissue& tissue) {
  const auto named = value.named();
  const auto solid = std::find_if(named.begin(), named.end(),
                                  [](const auto& rule) { return rule.first == "isotropic"; });
  if (solid == named.end()) {
    tissue.springs = read_rules(value, tissue.layers);
    return;
  }
  if (named.size() > 1)
    value.refuse("gives isotropic and other rules, which exclude each other; remove one");
  const Map map(solid->second.as("tissue.springs.isotropic"));
  tissue.isotropic = {map.at("young").number(), map.at("poisson").number()};
}

void read_mass(Tissue& tissue, const Map& map) {
  const auto mass = map.find("mass");
  if (mass) tissue.mass = read_one_a_layer(*mass, tissue.layers);
  set(tissue.density, map, "density", &Value::number);
  if (mass && tissue.density) mass->refuse("and tissue.density exclude each other; remove one");
}

void read_face(const Map& map, Tissue& tissue) {
  const auto face = map.find("face"), margin = map.find("margin");
  if (face && margin) margin->refuse("and tissue.face exclude each other; remove one");
  for (const auto& key : {face, margin})
    if (key && !tissue.edge) key->refuse("needs tissue.edge, which has the skin remeshed");
  if (margin) tissue.margin = margin->number();
  if (face)
    for (const Value& item : face->items()) tissue.face.push_back(read_skin_region(Map(item)));
}

Tissue read_tissue(const Value& value) {
  const Map map(value);
  Tissue tissue;
  tissue.layers = map.at("layers").integer();
  const auto depths = map.find("depths"), depths_mm = map.find("depths_mm");
  if (depths) tissue.depths = read_depths(*depths, tissue.layers);
  if (depths && depths_mm) depths_mm->refuse("and tissue.depths exclude each other; remove one");
  if (depths_mm) tissue.depths_mm = read_depths_mm(*depths_mm, tissue.layers);
  if (const auto edge = map.find("edge")) {
    tissue.keeps_given_skin = edge->is_word("given");
    if (!tissue.keeps_given_skin) tissue.edge = edge->is_word("auto") ? 0.0 : edge->number();
  }
  read_face(map, tissue);
  set(tissue.attach_within, map, "attach_within", &Value::number);
  set(tissue.free_thickness, map, "free_thickness", &Value::number);
  set(tissue.release, map, "release", &Value::number);
  set_choice<Attach>(tissue.attach, map, "attach");
  set_choice<Attach>(tissue.released, map, "released");
  if (const auto regions = map.find("unattached"))
    read_regions(*regions, Attach::contact, tissue.attach_regions);
  if (const auto regions = map.find("attach_regions"))
    read_attach_regions(*regions, tissue.attach_regions);
  const auto springs = map.find("springs"), material = map.find("material");
  if (springs && material)
    material->refuse("and tissue.springs exclude each other; remove one of them");
  if (springs)
    read_springs(*springs, tissue);
  else
    tissue.material = material ? read_material(*material) : default_material();
  set(tissue.turgor, map, "turgor", &Value::number);
  read_mass(tissue, map);
  return tissue;
}

std::vector<Force> read_forces(const Value& value) {
  std::vector<Force> forces;
  for (const Value& item : value.items()) {
    const Map map(item);
    forces.push_back({map.at("at").vector(), map.at("radius").number(), map.at("force").vector()});
  }
  return forces;
}

Collision read_collision(const Value& value) {
  const Map map(value);
  Collision collision;
  set_choice<CollisionMode>(collision.mode, map, "mode");
  set(collision.clearance, map, "clearance", &Value::number);
  set(collision.tolerance, map, "tolerance", &Value::number);
  return collision;
}

/// After the moves, which must lie within the plan's pieces.
Plan read_plan(const Value& value, const Scene& scene) {
  const Map map(value);
  Plan plan;
  for (const auto& [name, place] : map.at("pieces").texts())
    plan.pieces.push_back(find_bone(name, place, scene.bones));
  base::sort_unique(plan.pieces);
  if (plan.pieces.empty()) map.at("pieces").refuse("is an empty list; name a bone, or remove plan");
  for (std::size_t b = 0; b < scene.bones.size(); ++b)
    if (!scene.moves[b].is_identity() && !std::ranges::binary_search(plan.pieces, b))
      map.at("pieces").refuse("lacks '{}', which moves; add it, or remove its moves",
                              scene.bones[b].name);
  if (const auto box = map.find("box")) {
    const Map ranges(*box);
    set(plan.translate, ranges, "translate", &Value::vector);
    set(plan.rotate, ranges, "rotate", &Value::vector);
  }
  if (scene.collision && scene.collision->mode == CollisionMode::clamp)
    value.refuse("and collision.mode: clamp exclude each other, as that changes the moves");
  return plan;
}

/// Refuses a key of a volume term of springs that the tissue does not have: it would be ignored.
void require_volume_term(const std::optional<Value>& value, VolumeTerm term, const Solve& solve,
                         bool solid) {
  if (!value) return;
  if (solid)
    value->refuse(
        "is of tissue.springs, and the tissue is a solid, which keeps its volume by "
        "tissue.material.poisson; remove it");
  if (volume_of(solve) != term)
    value->refuse(
        "is of volume form {}, and the form is {}; give solve.volume.form: {}, or remove it",
        word(term), word(volume_of(solve)), word(term));
}

Solve read_solve(const Value& value, bool solid) {
  const Map map(value);
  Solve solve;
  set_choice<Functional>(solve.functional, map, "functional");
  if (const auto volume = map.find("volume")) {
    const Map term(*volume);
    set_choice<VolumeTerm>(solve.volume, term, "form");
    set(solve.bulk_modulus, term, "bulk_modulus", &Value::number);
    set(solve.poisson, term, "poisson", &Value::number);
    for (const char* key : {"bulk_modulus", "poisson"})
      require_volume_term(term.find(key), VolumeTerm::penalty, solve, solid);
  }
  set(solve.lambda, map, "lambda", &Value::number);
  require_volume_term(map.find("lambda"), VolumeTerm::paper, solve, solid);
  set(solve.accuracy, map, "accuracy", &Value::number);
  if (const auto steps = map.find("load_steps"))
    solve.load_steps = steps->is_word("auto") ? 0 : steps->integer();
  return solve;
}

double read_tearing(const Value& value, const Scene& scene) {
  const double limit = Map(value).at("limit").number();
  if (scene.tissue.material)
    value.refuse("is of springs, and the tissue is a solid; give tissue.springs, or remove it");
  if (scene.forces.empty())
    value.refuse("needs forces, at whose points springs tear; give forces, or remove it");
  for (const Instrument& body : scene.instruments)
    if (body.slide)
      value.refuse(
          "and an instrument on which the skin slides exclude each other; give that instrument "
          "skin: stick, or remove one of them");
  return limit;
}

/// Takes landmarks by the names of their file and, where these are spellings of standard names, by
/// those, too.
void take_landmarks(const Value& file, Scene& scene) {
  const Landmarks named = landmarks_by_name(file.file());
  const Landmarks standard = with_standard_names(named, file.file().string());
  check_frame(file, standard);
  for (const Landmarks* landmarks : {&standard, &named})
    for (const auto& [name, place] : *landmarks) scene.landmarks[name] = place;
}

void read_surroundings(Scene& scene, const Map& map) {
  if (const auto gravity = map.find("gravity")) {
    scene.gravity = gravity->vector();
    if (scene.tissue.mass.empty() && !scene.tissue.density)
      gravity->refuse("needs a mass to pull; give tissue.mass or tissue.density, or remove it");
  }
  if (const auto before = map.find("scan_gravity")) {
    scene.scan_gravity = before->vector();
    if (!scene.gravity) before->refuse("needs gravity, the field of now ([0, 0, 0] for none)");
  }
  if (const auto boundary = map.find("boundary")) set_choice<Rim>(scene.rim, Map(*boundary), "rim");
  if (const auto bodies = map.find("instruments")) scene.instruments = read_instruments(*bodies);
  if (const auto cuts = map.find("incisions"))
    scene.incisions = read_incisions(*cuts, scene.tissue.layers);
  if (const auto mouth = map.find("mouth"))
    scene.incisions.push_back(read_mouth(*mouth, scene.tissue.layers));
  if (const auto teeth = map.find("teeth"))
    read_regions(*teeth, Attach::slide, scene.tissue.attach_regions);
  if (const auto contact = map.find("contact"))
    scene.contact = read_contact(*contact);
  else if (scene.tissue.material)
    scene.contact.emplace();
  if (const auto forces = map.find("forces")) scene.forces = read_forces(*forces);
  if (const auto tearing = map.find("tearing")) scene.tearing = read_tearing(*tearing, scene);
}

/// Copies a node without its marks, which are places in another text than the file.
YAML::Node copy_unmarked(const YAML::Node& node) {
  if (node.IsScalar()) return YAML::Node(node.Scalar());
  YAML::Node copy(node.Type());
  if (node.IsSequence())
    for (const YAML::Node& item : node) copy.push_back(copy_unmarked(item));
  if (node.IsMap())
    for (const auto& entry : node) copy[copy_unmarked(entry.first)] = copy_unmarked(entry.second);
  return copy;
}

/// Puts a value, JSON, in the place of a key's. A scene that has no such map is left for the reader
/// to refuse.
void set_value(const std::string& key, const std::string& text, YAML::Node& root) {
  if (!root.IsMap()) return;
  const size_t dot = key.find('.');
  YAML::Node map = root;
  if (dot != std::string::npos) map.reset(root[key.substr(0, dot)]);
  if (!map.IsMap()) return;
  try {
    map[key.substr(dot + 1)] = copy_unmarked(YAML::Load(text));
  } catch (const YAML::Exception& error) {
    base::refuse("{} is changed into what YAML does not hold: {}", key, error.msg);
  }
}

}  // namespace

void require_bones(const Scene& scene) {
  if (scene.bones.empty())
    base::refuse("{}: bones lists no bone; give at least one: - {{name: skull, file: skull.ply}}",
                 scene.file.string());
}

Scene read_scene(const std::filesystem::path& file, const SceneChanges& changes) {
  YAML::Node root = read_yaml(file);
  for (const auto& [key, text] : changes) set_value(key, text, root);
  const Map map(Value(file, root));
  Scene scene;
  scene.file = file;
  scene.skin = read_skin(map.at("skin"));
  scene.bones = read_bones(map.at("bones"));
  if (map.find("moves") || map.find("osteotomies")) require_bones(scene);
  scene.tissue = read_tissue(map.at("tissue"));
  read_surroundings(scene, map);
  if (const auto anatomy = map.find("anatomy")) {
    scene.anatomy = read_anatomy(*anatomy);
    read_septum(*anatomy, scene);
  }
  if (const auto cuts = map.find("osteotomies")) read_osteotomies(*cuts, scene);
  scene.moves.resize(scene.bones.size());
  if (scene.anatomy) scene.landmarks = scene.anatomy->landmarks;
  if (const auto named = map.find("landmarks")) take_landmarks(*named, scene);
  if (const auto moves = map.find("moves")) read_moves(*moves, scene.landmarks, scene);
  if (const auto collision = map.find("collision")) scene.collision = read_collision(*collision);
  if (const auto plan = map.find("plan")) scene.plan = read_plan(*plan, scene);
  if (const auto solve = map.find("solve"))
    scene.solve = read_solve(*solve, scene.tissue.material.has_value());
  return scene;
}

}  // namespace repose::scene
