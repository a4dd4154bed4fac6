#pragma once
#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/scene/landmark_names.h"
#include "repose/scene/rigid_motion.h"

/// The scene file as data: what a person wrote, checked, with defaults filled in, units as in the
/// file (mm, N, kg, degrees already turned into RigidMotion).
namespace repose::scene {

/// A surface to be taken from a volume: the largest component at a level or of a label.
struct VolumeEntry {
  std::optional<double> level;  ///< unset without a label: by Otsu's method
  std::optional<int> label;
  std::optional<std::array<Vec3, 2>> box;  ///< mm, lowest and highest corner
  bool open = false;                       ///< cut off, not capped, where the volume ends
  double voxel = 0;                        ///< mm; 0: as it is
  double close_holes = 0;                  ///< mm
  int smooth = 10;                         ///< rounds
};

/// Where a surface comes from.
struct SurfaceEntry {
  std::filesystem::path file;           ///< absolute: a mesh, or the volume
  std::optional<VolumeEntry> volume{};  ///< unset: file is a mesh
};

struct BoneEntry {
  std::string name;
  SurfaceEntry surface;  ///< of a piece, that of the bone it is cut from
};

/// A saw cut in a plane; its front is the side that the normal points to.
struct CutPlane {
  Vec3 point;                    ///< mm
  Vec3 normal;                   ///< any length but 0
  std::optional<double> radius;  ///< mm: cuts within this disc only
};

/// An open cutting surface that faces the piece.
struct CutSheet {
  std::vector<Vec3> points;  ///< mm
  std::vector<Triangle> triangles;
};

/// Osteotomies that landmarks place.
enum class OsteotomyTemplate { le_fort_1, sagittal_split, genioplasty };

/// Cuts that take a piece off a bone, which keeps its name.
struct Osteotomy {
  std::size_t bone, piece;  ///< rows of Scene::bones
  std::vector<CutPlane> planes;
  std::optional<std::filesystem::path> surface;  ///< absolute
  double kerf = 0;                               ///< mm
  std::optional<Vec3> seed;                      ///< mm
  std::optional<CutSheet> sheet;                 ///< as surface, made by a template
  std::optional<OsteotomyTemplate> made_by;      ///< unset: by the scene's own planes or surface
};

enum class Law { linear = 0, quadratic = 1, quartic = 2 };  ///< value = exponent p of the law

/// A spring rule; unset members fall through to the next less specific rule.
struct SpringRule {
  std::optional<double> stiffness;  ///< N/mm, excludes modulus
  std::optional<double> modulus;    ///< N/mm²
  std::optional<Law> law;
  std::optional<double> reference;  ///< s_ref in mm; 0 means "initial": s_ref = r_0 of each spring
};

struct Sphere {
  Vec3 center;    ///< mm
  double radius;  ///< mm
};

/// Along the axes.
struct Box {
  Vec3 center, size;  ///< mm
};

/// A box along axes of its own.
struct TurnedBox {
  Box box;    ///< of axes · x
  Mat3 axes;  ///< rows, unit vectors at right angles
};

/// A place that a label of a volume marks.
struct LabelRegion {
  std::filesystem::path volume;  ///< absolute
  int label;
};

/// The inside of a closed triangle mesh.
struct ClosedMesh {
  std::filesystem::path file;  ///< absolute
};

/// Region painted on a mesh of the skin, and the tissue below it.
struct PaintedRegion {
  std::filesystem::path file;  ///< absolute, a PLY
  std::string property;        ///< of its vertices; empty: their color
  double at_least = 0.5;       ///< of the property
  Vec3 color = Vec3::Zero();   ///< red, green, blue, 0 … 255
  double depth;                ///< mm below the skin, infinite for all that lies there
};

/// An isotropic elastic solid at small strains.
struct Elasticity {
  double young;    ///< N/mm², > 0
  double poisson;  ///< −1 < ν < 0.5
};

/// A stratum of the tissue; those of a material lie one below the other, the first at the skin.
struct Stratum {
  double thickness;  ///< mm
  Elasticity elasticity;
};

/// Region near a line of points.
struct CurveRegion {
  std::vector<Vec3> path;  ///< mm
  double radius;           ///< mm
};

using Region = std::variant<Sphere, Box, TurnedBox, ClosedMesh, LabelRegion, CurveRegion>;
using SkinRegion = std::variant<Region, PaintedRegion>;

/// Attachment of tissue that ends at bone: it moves with it; it keeps its distance and slides
/// along; it may lift off but never passes; it ignores it.
enum class Attach { fixed, slide, contact, free };

struct AttachRegion {
  Region where;
  Attach attach;
  double gap = 0;  ///< mm short of bone at which columns of tissue end
};

struct MaterialRegion {
  SkinRegion where;
  Elasticity elasticity;
};

/// Elements over which a solid's volume ratio is averaged.
enum class Dilatation { prism, nodal };

/// Tissue as a neo-Hookean solid (docs/theory/continuum.md).
struct Material {
  Elasticity deep;                      ///< below all strata
  std::vector<Stratum> strata;          ///< from the skin down
  std::vector<MaterialRegion> regions;  ///< beat the strata, and each the ones before it
  Dilatation dilatation = Dilatation::prism;
};

struct Tissue {
  int layers = 4;  ///< 2 … 64
  /// mm, edges of the mesh solved in place of the given skin; 0: by its size; unset: the given skin
  /// is solved where it can be, else one with edges by its size.
  std::optional<double> edge;
  bool keeps_given_skin = false;  ///< the given skin is solved or refused, never remeshed
  std::vector<SkinRegion> face;   ///< the skin that is solved; empty: that over bones that move,
  double margin = 35;             ///< and mm further along it
  std::vector<double> depths;     ///< [layers] fractions 0 … 1, increasing; empty: even
  /// mm below the skin of the upper layers, the skin's 0 first, increasing; empty: by `depths`.
  std::vector<double> depths_mm;
  double attach_within = 30;                 ///< mm
  double free_thickness = 12;                ///< mm
  Attach attach = Attach::fixed;             ///< outside all regions
  std::vector<AttachRegion> attach_regions;  ///< each beats the ones before it
  double release = 10;                       ///< mm
  Attach released = Attach::contact;         ///< attachment of released tissue
  std::optional<Material> material;          ///< unset: springs
  std::optional<Elasticity> isotropic;  ///< of springs: moduli by set that resemble such a solid
  std::map<std::string, SpringRule> springs;  ///< "default", "layer", "layer 0", "connecting 1", …
  double turgor = 0;  ///< initial strain of the skin: of its springs, or of the first stratum
  std::vector<double> mass;       ///< [layers] kg, or empty
  std::optional<double> density;  ///< kg/mm³, excludes mass
};

/// Boundary condition at the outermost border of an open skin; automatic: fixed over bone that
/// rests.
enum class Rim { fixed, free, automatic };

enum class Functional { energy, force };
/// Volume term of an objective (docs/theory/model.md "Objectives"); `material` is a solid's, and no
/// scene's: its moduli say how it keeps its volume.
enum class VolumeTerm { none, paper, penalty, material };
/// As scenes, options and results spell them.
inline constexpr std::array<std::string_view, 2> words(Functional) { return {"energy", "force"}; }
inline constexpr std::array<std::string_view, 4> words(VolumeTerm) {
  return {"none", "paper", "penalty", "material"};
}
template <class Choice>
constexpr std::string_view word(Choice choice) {
  return words(choice)[static_cast<size_t>(choice)];
}

struct Force {
  Vec3 at;        ///< mm, on or near the skin
  double radius;  ///< mm: spread over the skin points within, by area
  Vec3 force;     ///< N, in total
};

/// The points within a radius of a segment.
struct Capsule {
  Vec3 from, to;  ///< mm
  double radius;  ///< mm
};

/// Half-space behind a plane, away from its normal.
struct HalfSpace {
  Vec3 point;   ///< mm
  Vec3 normal;  ///< any length but 0
};

/// A rigid body at its place before it is pushed into the tissue, and by what.
struct Instrument {
  std::variant<Sphere, Capsule, Box, HalfSpace, ClosedMesh> shape;
  Vec3 push;           ///< mm, not 0
  bool slide = false;  ///< the skin slides on it without friction instead of sticking to it
};

/// Tissue against bones and the sides of cuts against each other.
struct Contact {
  bool bones = true, cuts = true;
  std::optional<double> grid;       ///< mm, of the distances to meshes; unset: by the bones
  std::optional<double> stiffness;  ///< N/mm³ of the penalty; unset: by the tissue
};

/// A cut in the skin.
struct Incision {
  std::vector<Vec3> path;     ///< mm, at least two points on or near the skin
  int layers;                 ///< point layers that it parts, from the skin down, ≥ 1
  std::string name = {};      ///< its key, for messages
  bool by_landmarks = false;  ///< found on the skin that the scene names
  bool parts_lips() const { return name == "mouth"; }
};

struct Solve {
  Functional functional = Functional::energy;
  std::optional<VolumeTerm> volume;    ///< unset: penalty; with functional force none
  std::optional<double> bulk_modulus;  ///< N/mm²; unset: by `poisson`
  double poisson = 0.45;               ///< of springs with a penalty
  double lambda = 0.5;
  double accuracy = 0.1;  ///< mm
  int load_steps = 0;     ///< 0: automatic
};

/// The volume term of springs: that of `solve`, or that of its functional.
inline VolumeTerm volume_of(const Solve& solve) {
  const bool force = solve.functional == Functional::force;
  return solve.volume.value_or(force ? VolumeTerm::none : VolumeTerm::penalty);
}

/// The motions that a plan may give to pieces of bone (scene/placement.h).
struct Plan {
  std::vector<std::size_t> pieces;      ///< rows of Scene::bones, ascending
  Vec3 translate = Vec3::Constant(10);  ///< mm, largest components, either way
  Vec3 rotate = Vec3::Constant(10);     ///< degrees, likewise
};

enum class CollisionMode { report, stop, clamp };

/// Treatment of bones that touch while they move.
struct Collision {
  CollisionMode mode = CollisionMode::report;
  double clearance = 0;     ///< mm to be kept between bones
  double tolerance = 0.05;  ///< mm: how much sooner than at contact a clamped motion may end
};

/// Parts of a scene that its head's landmarks define.
struct AnatomyPlan {
  std::filesystem::path file;  ///< absolute, of the landmarks
  Landmarks landmarks;
  Mat3 axes = Mat3::Identity();     ///< rows: left, back and up of the head in the scan
  bool part_lips = true;            ///< where the scene has no mouth of its own
  bool vestibule = true;            ///< tissue in front of teeth touches them and is not attached
  double gap = 1;                   ///< mm, of the vestibule, between mucosa and teeth
  std::optional<double> lower_gap;  ///< mm, below stomion; unset: by the overjet
  double adhesion = 5e-4;  ///< N/mm², largest tension between lips and the teeth of their jaw
  double tone = 0.006;     ///< N/mm², of the ring muscle at the line between the lips
  double pedicle = 0.5;  ///< least share of the tissue on a genioplasty's piece that stays attached
  std::vector<Vec3> lip_gap = {};  ///< mm, along the middle of the gap between lips that are apart
};

/// The gap in front of the lower teeth, mm: `lower_gap`, or half of the overjet, at least `gap` and
/// at most 4 mm. The lower lip lies on the upper incisors, and a wedge is left to its sulcus.
double gap_of_lower_teeth(const AnatomyPlan& plan);

/// Lowest and highest x and y of the vestibule along the axes of the head, mm: 12 mm beyond the
/// corners of the mouth, from 16 mm in front of the upper incisal edge to 38 mm behind it. Throws
/// std::out_of_range without these landmarks.
std::array<Eigen::Vector2d, 2> vestibule_sides(const AnatomyPlan& plan);

struct Scene {
  std::filesystem::path file;
  SurfaceEntry skin;
  std::vector<BoneEntry> bones;  ///< those with a file of their own, then the pieces cut off them
  std::vector<Osteotomy> osteotomies;  ///< in the order in which they are made, one a piece
  Tissue tissue;
  std::optional<Vec3> gravity;       ///< N/kg
  std::optional<Vec3> scan_gravity;  ///< N/kg, when the surfaces were recorded; unset: as gravity
  Rim rim = Rim::automatic;
  std::vector<RigidMotion> moves;  ///< [bones] the whole motion of each bone
  std::optional<Plan> plan;        ///< unset: the moves alone
  std::optional<Collision> collision;
  std::optional<AnatomyPlan> anatomy;
  std::optional<Contact> contact;  ///< unset: what is free is not kept out of bones
  std::vector<Instrument> instruments;
  std::vector<Incision> incisions;
  std::vector<Force> forces;
  Solve solve;
  std::map<std::string, Vec3> landmarks;  ///< mm, by name; of the file `landmarks`
  std::vector<std::string> remarks;       ///< lines for a person
  std::vector<std::string> warnings;      ///< implausible properties, a line each
  std::optional<double> tearing;          ///< N, tension above which springs tear; unset: none does
};

/// Throws InputError if a scene lists no bone.
void require_bones(const Scene& scene);

/// Values, as JSON, that stand in place of those of a scene file, by key: "boundary" or
/// "tissue.material".
using SceneChanges = std::map<std::string, std::string>;

/// Reads and checks a scene file with changes. Every refusal is an InputError whose message starts
/// with file:line:column and names the key, the value, the allowed range and, for an unknown key,
/// the nearest known one; file alone for a changed value. Files it names must exist.
Scene read_scene(const std::filesystem::path& file, const SceneChanges& changes = {});

}  // namespace repose::scene
