#pragma once
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "repose/model/cut.h"
#include "repose/model/model.h"
#include "repose/model/skin_mesh.h"
#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// Report on the building of a model, for the end-of-run summary.
struct BuildReport {
  int64_t attached = 0;   ///< columns that end in bone
  int64_t free_deep = 0;  ///< columns that end free: no bone near, unattached, or released
  int64_t released = 0;   ///< of those, released near a piece that moves differently
  int64_t shortened = 0;  ///< columns made shorter so that neighbors do not cross
  double thickness_min = 0, thickness_median = 0, thickness_max = 0;  ///< mm
  double effective_modulus = 0;       ///< N/mm², as the function below
  std::vector<std::string> remarks;   ///< lines for a person, each complete
  std::vector<std::string> warnings;  ///< implausible properties that should be changed
};

struct BuiltModel {
  Model model;
  BuildReport report;
  std::vector<std::vector<int64_t>> held;  ///< [instruments] rows of the points that each holds
  std::vector<Cut> cuts;  ///< not made yet (cut.h): lips before the prestress, others after
};

/// The model of all columns of a ColumnGeometry, whose arguments these are. Serial.
BuiltModel build_model(const scene::Scene& scene, const surface::Surface& skin,
                       const std::vector<surface::Surface>& bones);

/// Input of a scene's model at any resolution.
struct Anatomy {
  scene::Scene scene;     ///< with moves that resolve collisions
  surface::Surface skin;  ///< that is solved
  /// The skin that the scene names, where another is solved in its place (solved_skin.h).
  std::optional<surface::Surface> given_skin;
  std::vector<surface::Surface> bones;          ///< [scene.bones]
  std::vector<std::string> remarks;             ///< one line each
  std::vector<std::string> warnings;            ///< implausible properties, one line each
  std::vector<std::string> move_warnings = {};  ///< of the scene's moves (collision.h)
};

/// Reads the scene's surfaces, cuts its bones and resolves collisions. Serial.
Anatomy load_anatomy(const scene::Scene& scene);

BuiltModel build_model(const Anatomy& anatomy);

/// A place of the face by which its movement is described.
struct FacePlace {
  std::string name;
  Vec3 at;  ///< mm, on the skin that is solved, before the bones move
};

/// Returns nose tip, upper lip, lower lip and chin, as far as they are known: from the scene's
/// landmarks (pronasale, upper_lip, lower_lip, pogonion_soft), else the skin in front of the teeth
/// and the chin of the bones that the names tell to be a lower and an upper jaw.
std::vector<FacePlace> face_places(const Anatomy& anatomy);

/// Puts a remeshed skin in the place of the given one because of `obstacle`, a clause. Returns
/// false, and leaves the anatomy as it is, where the scene says how its skin is meshed
/// (tissue.edge) or where the given skin cannot be remeshed.
bool replace_given_skin(Anatomy& anatomy, const std::string& obstacle);

/// Returns build(anatomy), on a remeshed skin where no tissue fits the given one.
template <class Build>
auto build_on_solvable_skin(Anatomy& anatomy, const Build& build) {
  try {
    return build(anatomy);
  } catch (const RefusedPlaces& refused) {
    if (!replace_given_skin(anatomy, refused.reason())) throw;
  }
  return build(anatomy);
}

/// Reads the scene's surfaces and builds.
BuiltModel build_model(const scene::Scene& scene);

/// Attachment of the deepest points of columns of tissue, [C].
struct ColumnEnds {
  std::vector<int32_t> bone;       ///< that it moves with, −1 for none
  std::vector<int32_t> slides_on;  ///< bone that it slides along, −1 for none
  std::vector<char> free;          ///< 1: it does not even touch bones
  std::vector<int32_t> support;    ///< bone that supports it elastically, −1 for none
  /// Stiffness of that support, in units of Young's modulus below all strata over the thickness.
  std::vector<double> support_stiffness;
  std::vector<char> supported_whole;  ///< 1: all its points are, not the deepest alone
};

/// Loads of columns of tissue.
struct ColumnLoads {
  std::vector<int32_t> instrument;  ///< [C] that holds its skin point, −1 for none
  std::vector<Vec3> target;         ///< [C] mm, where a held skin point goes
  std::vector<Vec3> force;          ///< [C] N, on its skin point
  /// [layers] mm², of all columns of the tissue; empty where layers have no masses.
  std::vector<double> layer_area;
};

/// A jaw with teeth that a lip adheres to.
struct AdheringJaw {
  bool upper;
  int32_t bone;
};

/// Columns of tissue, ascending, and the triangles of skin between them.
struct Piece {
  std::vector<int64_t> column;   ///< [C] vertices of the whole skin
  std::vector<Vec3> skin, deep;  ///< [C] mm, where a column begins and ends
  ColumnEnds ends;
  std::vector<char> rim;     ///< [C] 1: held in whole
  std::vector<char> parted;  ///< [C] 1: on the path of an incision
  ColumnLoads loads;
  std::vector<AdheringJaw> jaws;
  std::vector<Triangle> corner;   ///< [F] rows of the piece
  std::vector<int64_t> triangle;  ///< [F] rows of the whole skin's triangles
  std::vector<int64_t> edge;      ///< [E] rows of the whole skin's edges
  double slope = 0;               ///< layer_slope() of the whole; 0 where nothing reads it
};

/// Points of a column that a cut doubles, from the skin down. The doubles are the last points of a
/// model whose cuts are made (cut_along).
struct DoubledColumn {
  int64_t column;     ///< vertex of the skin
  int64_t cut;        ///< row of ColumnGeometry::cuts()
  int64_t points;     ///< that are doubled
  int64_t first_row;  ///< of the doubles in the whole model
};

/// Geometry of the columns of tissue: all of a model but its layers.
/// Takes memory by the skin, where the model takes it by the skin times the layers.
class ColumnGeometry {
 public:
  /// `bones` in the order of scene.bones. Serial. Throws InputError naming the place where no valid
  /// model exists.
  ColumnGeometry(const scene::Scene& scene, const surface::Surface& skin,
                 const std::vector<surface::Surface>& bones);
  /// As above, with the anatomy's remarks and warnings in the report.
  explicit ColumnGeometry(const Anatomy& anatomy);
  ~ColumnGeometry();
  ColumnGeometry(ColumnGeometry&&) noexcept;

  const SkinMesh& skin() const;
  int64_t layers() const;
  /// Points of a column that are free to move, with their doubles.
  int64_t soft_points(int64_t column) const;
  /// The given columns (ascending), those that share a triangle with them, and those that share one
  /// with these: all that values at elements of the given columns depend on. Of a scene with
  /// adhering lips, the frames of jaws are among the given columns.
  Piece piece(const std::vector<int64_t>& columns) const;
  /// mm, of contact's grids of distances to meshes.
  double spacing() const;
  /// The model, with its cuts made, without its points, prisms and edges: skin, bones, bodies, the
  /// grid of contact.
  Model global_metadata() const;
  /// The model of all columns, without its cuts. Serial.
  BuiltModel build_whole() const;
  const BuildReport& report() const;
  /// [instruments] rows of the points that each holds.
  std::vector<std::vector<int64_t>> held() const;
  /// The incisions, not made yet, in the order in which they are: those of lips first.
  std::span<const Cut> cuts() const;
  /// Leaves all incisions but those of lips out of the model, or takes them in again.
  void include_incisions(bool included);
  /// The columns that they double, in the order of the doubles.
  const std::vector<DoubledColumn>& doubled() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Returns a remark that counts the points of a scene's model that adhere to teeth; empty of a
/// scene without adhesion.
std::string remark_on_adhesion(const scene::Scene& scene, const Model& model);

/// The model of a piece, equal to the rows of the scene's model: of points and elements at the
/// columns that the piece was made around, all there is; of others, what the piece has. Indices are
/// the piece's, Points::column the whole skin's. `contact.stiffness` is left 0, and bodies
/// and terms are there whether they are touched or have elements or not. `found` [regions of the
/// material] gets the prisms in each. Serial.
Model build_local(const scene::Scene& scene, const std::vector<surface::Surface>& bones,
                  const Piece& piece, std::vector<int64_t>& found);

/// Sums over one column, or more, for the means over the whole tissue.
struct ColumnSums {
  double stiffness = 0;  ///< N mm, as in effective_modulus(), of elements that begin in the column
  double volume = 0;     ///< mm³, of the same
  double thickness = 0;  ///< mm
};
/// Returns the sums of the columns of a model of make_layers, in their order.
std::vector<ColumnSums> column_sums(const Model& model, int64_t layers);
/// N/mm²: the stiffness of all over their volume.
double effective_modulus(const std::vector<ColumnSums>& columns);
/// N/mm³, of contact: the scene's, or that of the columns' modulus, thickness and width. A stiff
/// part of the tissue does not decide.
double contact_stiffness(const scene::Scene& scene, const std::vector<ColumnSums>& columns);
/// Refuses a region of a material that holds no prism.
void require_regions(const std::vector<int64_t>& found, const std::string& file);

/// N/mm²: of springs Σ k0 r_0² / Σ v_0, of a solid the mean of Young's modulus over its volume.
double effective_modulus(const Model& model);
/// Adds stiffness and volume of a model's elements to `sums`, in their order.
void add_elements(const Model& model, ColumnSums& sums);

/// κ (N/mm²) of the volume term where a scene of springs names none: what springs lack in bulk
/// modulus for Poisson's ratio `solve.poisson`, or that of the isotropic solid. Springs of modulus
/// Y in all directions have the shear modulus Y/15, so that ν = 0.45 makes 8/15 Y of the effective
/// modulus Y.
double default_bulk_modulus(const scene::Tissue& tissue, const scene::Solve& solve,
                            double effective_modulus);

/// The surfaces of a scene's bones at their initial position, named as in the scene.
struct Bones {
  std::vector<surface::Surface> surfaces;  ///< [scene.bones], pieces cut off, kerfs taken out
  std::vector<std::string> remarks;        ///< lines for a person: what was cut
  std::vector<std::string> warnings;       ///< implausible properties
};

/// Reads the files of the scene's bones and makes its osteotomies in their order. Throws
/// InputError naming the scene and the osteotomy where one cannot be made, and where the landmarks
/// of the scene's anatomy are not those of the bones and of the skin, the scene's where none is
/// given.
Bones read_bones(const scene::Scene& scene, const surface::Surface* skin = nullptr);

}  // namespace repose::model
