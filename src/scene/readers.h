#pragma once
#include <map>
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "value.h"

/// Readers of the keys of a scene; what they take are the values of these keys. All throw
/// InputError that names file, line and column.
namespace repose::scene {

/// Reads the key anatomy and its landmarks, under their standard names. Refuses landmarks that
/// cannot be those of a head in LPS: left and right exchanged, RAS, one of a pair missing, an order
/// from above to below that no head has.
AnatomyPlan read_anatomy(const Value& value);
/// Refuses landmarks by standard names that are in another frame (RAS) or unit.
void check_frame(const Value& file, const Landmarks& landmarks);

/// Reads anatomy.septum, if there, into the first region of the scene's material: the septum's free
/// edges between the landmarks of `scene.anatomy`. Adds a remark. Refuses springs, and a scene
/// where one of these landmarks is missing.
void read_septum(const Value& anatomy, Scene& scene);

/// Adds the items of tissue.attach_regions or, all of them to be attached alike, of another list.
void read_attach_regions(const Value& list, std::vector<AttachRegion>& regions);
void read_regions(const Value& list, Attach how, std::vector<AttachRegion>& regions);
Contact read_contact(const Value& value);

/// Reads the points of a curve: a list, or a file of landmarks; two at least.
std::vector<Vec3> read_path(const Value& value);
/// Reads a cut along the lips through all layers.
Incision read_mouth(const Value& value, int layers);
/// Reads the incisions in a tissue of so many layers.
std::vector<Incision> read_incisions(const Value& list, int layers);

std::vector<Instrument> read_instruments(const Value& list);

/// Reads tissue.material: the preset, changed by the other keys.
Material read_material(const Value& value);
/// Returns that of a scene that names neither material nor springs.
Material default_material();

/// Sets Scene::moves, the whole motion of each bone: the entries of the list, in the order of the
/// file. `landmarks` are those that may be named, mm.
void read_moves(const Value& list, const std::map<std::string, Vec3>& landmarks, Scene& scene);

/// Adds the osteotomies of the list and, as a bone of its own, the piece of each.
void read_osteotomies(const Value& list, Scene& scene);

/// Reads a part of space, given by exactly one of the keys sphere, box, mesh, volume (with label)
/// and curve (with radius) of an item.
Region read_region(const Map& map);
/// Reads a region, or with the key painted the painted part of a mesh of the skin.
SkinRegion read_skin_region(const Map& map);
Sphere read_sphere(const Map& map);
Box read_box(const Map& map);

}  // namespace repose::scene
