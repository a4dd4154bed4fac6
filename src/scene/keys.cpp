#include "repose/scene/keys.h"

#include <algorithm>

#include "material_presets.h"
#include "repose/base/error.h"

namespace repose::scene {

namespace {

using base::Range;
using enum KeyKind;

using Keys = std::vector<Key>;

Keys joined(const std::vector<Keys>& parts) {
  Keys all;
  for (const Keys& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// A key whose value is one of some words.
Key one_of(const std::string& path, const char* standard, std::vector<std::string> words,
           const char* sentence) {
  return {path, choice, standard, sentence, "", {}, std::move(words)};
}

/// The keys of a surface taken from a volume, below `above`.
Keys volume_keys(const std::string& above) {
  return {{above + ".volume", volume, "",
           "CT or label map to take the surface from: its largest component."},
          {.path = above + ".level",
           .kind = number,
           .standard = "",
           .sentence = "Level of the surface; otsu finds it from the values. Excludes label.",
           .unit = "HU",
           .choices = {"otsu"}},
          {above + ".label", integer, "", "Label whose surface it is. Excludes level.", "",
           Range::between(1, 100000)},
          {above + ".box", numbers, "",
           "Lowest x, y, z and highest: the rest of the volume is left out.", "mm"},
          one_of(above + ".border", "closed", {"closed", "open"},
                 "How the surface ends at the border of the volume or box: capped, or open."),
          {above + ".voxel", number, "",
           "Average the volume to voxels this large first, for fewer triangles.", "mm",
           Range::above(0)},
          {above + ".close_holes", number, "0", "Close gaps and holes up to twice this wide.", "mm",
           Range::between(0, 1000)},
          {above + ".smooth", integer, "10", "Rounds of smoothing without shrinkage.", "",
           Range::between(0, 1000)}};
}

Keys surface_keys() {
  const Keys skin{{"skin", mesh, "required",
                   "Triangle mesh of the skin, open or closed, or what volume to take it from."}};
  const Keys bones{{"bones", list, "required",
                    "The bones, each a triangle mesh or taken from a volume; at least one."},
                   {"bones[].name", text, "required",
                    "The bone's name: 1 to 64 printable ASCII characters without '/'."},
                   {"bones[].file", file, "", "Triangle mesh of the bone; or give volume."}};
  return joined({skin, volume_keys("skin"), bones, volume_keys("bones[]")});
}

Keys attach_keys() {
  return {one_of("tissue.released", "contact", {"fixed", "slide", "contact", "free"},
                 "What such tissue does then: as attach."),
          one_of("tissue.attach", "fixed", {"fixed", "slide", "contact", "free"},
                 "What tissue that ends at bone does: move with it, slide along it at its "
                 "distance, touch it (lift off, never pass), or ignore it."),
          {"tissue.attach_regions", list, "",
           "Where tissue that ends at bone does otherwise; later ones beat earlier ones."},
          one_of("tissue.attach_regions[].attach", "required",
                 {"fixed", "slide", "contact", "free"}, "As tissue.attach."),
          {"tissue.attach_regions[].gap", number, "0",
           "How far short of bone tissue ends there, at most a third of its thickness; not with "
           "fixed or slide.",
           "mm", Range::between(0, 10)}};
}

Keys tissue_keys() {
  return {
      {"tissue", map, "required", "The soft tissue between skin and bone."},
      {"tissue.layers", integer, "required", "Point layers, skin and deepest included.", "",
       Range::between(2, 64)},
      {"tissue.depths", numbers, "",
       "Where each layer lies, as fractions of the skin–bone distance: one per layer, from 0 to 1, "
       "increasing; evenly spaced when not given.",
       "", Range::between(0, 1)},
      {"tissue.depths_mm", numbers, "",
       "How deep the upper layers lie below the skin, 0 first, at most one per layer, increasing; "
       "the others are spread evenly below. Excludes depths. Where tissue is too thin for them, "
       "layers are spread evenly.",
       "mm", Range::at_least(0)},
      {.path = "tissue.edge",
       .kind = number,
       .standard = "",
       .sentence =
           "Edge length of the mesh that is solved in place of the given skin: its outside over "
           "the bones that move, remeshed; auto: a seventieth of the head; given: the given skin "
           "is solved or refused. Unset: auto where the given skin is closed, has more than "
           "100 000 triangles or cannot be solved, else given.",
       .unit = "mm",
       .range = Range::between(1, 20),
       .choices = {"auto", "given"}},
      {"tissue.margin", number, "35",
       "With edge: how far the skin that is solved reaches along it beyond what lies within 25 mm "
       "of a moving bone, a force or an incision.",
       "mm", Range::between(5, 300)},
      {"tissue.face", list, "",
       "With edge: regions whose skin is solved in place of that; where they do not hang together, "
       "the largest part. Excludes margin."},
      {"tissue.attach_within", number, "30", "Tissue deeper than this is not attached to bone.",
       "mm", Range::at_least(0)},
      {"tissue.free_thickness", number, "12", "Thickness where there is no bone beneath.", "mm",
       Range::above(0)},
      {"tissue.release", number, "10",
       "Tissue lets go of bone this near to a piece that moves differently by 4 mm or more, and "
       "proportionally nearer where by less; 0 never does. A solid lets go gradually, from 1.4 "
       "down to 0.6 of that distance.",
       "mm", Range::at_least(0)},
      {"tissue.unattached", list, "",
       "Regions that touch bone but do not hold to it (lips, cheeks); an alias of attach_regions "
       "with attach: contact."},
      {"tissue.turgor", number, "0",
       "Initial strain of the skin: of its springs, or of a material's first stratum.", "",
       Range::between(0, 1)},
      {"tissue.mass", numbers, "", "Mass of each layer; excludes density.", "kg",
       Range::at_least(0)},
      {"tissue.density", number, "", "Density of the tissue; excludes mass.", "kg/mm³",
       Range::above(0)}};
}

/// The keys of a part of space, below the item of a list.
Keys region_keys(const std::string& item) {
  return {{item + ".sphere", map, "", "The region as a sphere, or"},
          {item + ".sphere.center", vector, "required", "Its center.", "mm"},
          {item + ".sphere.radius", number, "required", "Its radius.", "mm", Range::above(0)},
          {item + ".box", map, "", "as a box along the axes, or"},
          {item + ".box.center", vector, "required", "Its center.", "mm"},
          {item + ".box.size", vector, "required", "Its length along each axis, above 0.", "mm"},
          {item + ".mesh", file, "", "as the inside of a closed triangle mesh, or"},
          {item + ".volume", volume, "", "as the voxels of a label map that have"},
          {item + ".label", integer, "", "this label, or", "", Range::between(1, 100000)},
          {item + ".curve", curve, "", "as what is near a curve: its points, or a file of them."},
          {item + ".curve[]", vector, "", "One of the points.", "mm"},
          {item + ".radius", number, "", "How near to the curve.", "mm", Range::above(0)}};
}

Keys contact_keys() {
  return {{"contact", map, "", "Tissue against bones and itself; without it as for a material."},
          one_of("contact.bones", "on", {"on", "off"},
                 "Free tissue stays out of bones, if it began outside; on for a material, off for "
                 "springs."),
          one_of("contact.cuts", "on", {"on", "off"},
                 "The sides of incisions and of the mouth do not pass each other."),
          {"contact.grid", number, "",
           "Spacing of the grids from which distances to meshes are read, which round edges of "
           "bones by a fifth of it; when not given half the thickness of thin bone near the "
           "tissue, 0.5 to 0.6 mm, and 0.5 mm where bone is cut.",
           "mm", Range::between(0.1, 10)},
          {"contact.stiffness", number, "",
           "Of the penalty that multipliers make exact; by the tissue when not given.", "N/mm³",
           Range::between(1e-9, 1e9)},
          {"teeth", list, "",
           "Regions where mucosa slides on teeth; an alias of tissue.attach_regions with attach: "
           "slide."},
          {"mouth", map, "", "Parts the lips, through all layers, so that they open and meet."},
          {"mouth.path", curve, "required",
           "From one corner of the mouth to the other: points near the skin, or a file of them."},
          {"mouth.path[]", vector, "", "One of the points.", "mm"}};
}

/// Young's modulus and Poisson's ratio, below `above`.
Keys elasticity_keys(const std::string& above, const char* standard) {
  return {{above + ".young", number, standard, "Young's modulus at small strains.", "N/mm²",
           Range::between(1e-9, 1e9)},
          {above + ".poisson", number, "", "Poisson's ratio; that of the material when not given.",
           "", Range::between(-0.9, 0.4999)}};
}

/// A part of the skin that is painted on a mesh, below the item of a list.
Keys painted_keys(const std::string& item) {
  const std::string painted = item + ".painted";
  return {{painted, map, "", "A region painted on a mesh of the skin, and the tissue below it."},
          {painted + ".mesh", file, "required",
           "A PLY of the skin with colors or values at its vertices."},
          {painted + ".color", numbers, "",
           "Red, green and blue of the paint; excludes property. Vertices within 40 of each count.",
           "", Range::between(0, 255)},
          {painted + ".property", text, "",
           "In place of color a property of the vertices (quality, say, or a mask)."},
          {painted + ".at_least", number, "0.5", "The least value of it that counts as painted."}};
}

/// The items of all lists of regions.
Keys regions_keys() {
  return joined({region_keys("teeth[]"), region_keys("tissue.attach_regions[]"),
                 region_keys("tissue.unattached[]"), region_keys("tissue.face[]"),
                 region_keys("tissue.material.regions[]"), painted_keys("tissue.face[]"),
                 painted_keys("tissue.material.regions[]")});
}

Keys material_keys() {
  Keys rows{
      {"tissue.material", map, "",
       "The tissue as a neo-Hookean solid; excludes springs. The default, with the preset face, "
       "where neither is given."},
      one_of("tissue.material.law", "neo_hookean", {"neo_hookean"},
             "The law, of which there is one."),
      {.path = "tissue.material.preset",
       .kind = choice,
       .standard = "face",
       .sentence = "Moduli from the literature; the other keys override them.",
       .choices = preset_names()},
      {"tissue.material.young", number, "", "Young's modulus below all strata.", "N/mm²",
       Range::between(1e-9, 1e9)},
      {"tissue.material.poisson", number, "", "Poisson's ratio below all strata.", "",
       Range::between(-0.9, 0.4999)},
      one_of("tissue.material.dilatation", "prism", {"prism", "nodal"},
             "Changes of volume are resisted prism by prism, or averaged over the prisms around "
             "each point, for tissue that is nearly incompressible."),
      {"tissue.material.skin", map, "", "The outermost stratum; the preset's when not given."},
      {"tissue.material.skin.thickness", number, "required", "Its thickness.", "mm",
       Range::above(0)},
      {"tissue.material.strata", list, "",
       "Strata from the skin down, in place of skin; the deepest is what lies below them."},
      {"tissue.material.strata[].thickness", number, "required", "Its thickness.", "mm",
       Range::above(0)},
      {"tissue.material.regions", list, "",
       "Regions of another material; a later one overrides earlier ones."},
      {"tissue.material.regions[].painted.depth", number, "",
       "How deep the region reaches; all the way when not given.", "mm", Range::above(0)}};
  for (const char* above :
       {"tissue.material.skin", "tissue.material.strata[]", "tissue.material.regions[]"})
    for (const Key& key : elasticity_keys(above, "required")) rows.push_back(key);
  return rows;
}

Keys spring_keys() {
  return {
      {"tissue.springs", map, "",
       "The tissue as the paper's springs; excludes material. Rules by set: default, layer, "
       "connecting, diagonal, or one of them with its number (\"layer 0\" is the skin, "
       "\"connecting 0\" joins layers 0 and 1). What a rule leaves out comes from the more general "
       "one."},
      {"tissue.springs.isotropic", map, "",
       "In place of rules: moduli of the sets that resemble an isotropic solid, linear springs, "
       "and the bulk modulus of the volume term that goes with them."},
      {"tissue.springs.isotropic.young", number, "required", "Its Young's modulus.", "N/mm²",
       Range::between(1e-9, 1e9)},
      {"tissue.springs.isotropic.poisson", number, "required", "Its Poisson's ratio.", "",
       Range::between(0.25, 0.4999)},
      {"tissue.springs.*.stiffness", number, "", "Stiffness k0; excludes modulus.", "N/mm",
       Range::above(0)},
      {"tissue.springs.*.modulus", number, "",
       "Modulus Y, from which k0 = Y · v / r_0²; excludes stiffness.", "N/mm²", Range::above(0)},
      one_of("tissue.springs.*.law", "", {"linear", "quadratic", "quartic"},
             "Spring law: T = k0 (1 + σ²)^p s with p = 0, 1, 2."),
      {.path = "tissue.springs.*.reference",
       .kind = number,
       .standard = "",
       .sentence = "Elongation s_ref that makes σ = s / s_ref; initial means each spring's own "
                   "initial length.",
       .unit = "mm",
       .range = Range::above(0),
       .choices = {"initial"}}};
}

Keys load_keys() {
  return {{"gravity", vector, "", "Gravity field; needs tissue.mass or tissue.density.", "N/kg"},
          {"scan_gravity", vector, "",
           "Gravity field when the surfaces were recorded, for example lying in a CT; default: "
           "gravity.",
           "N/kg"},
          {"boundary", map, "", "What holds the skin where it ends."},
          one_of("boundary.rim", "auto", {"fixed", "free", "auto"},
                 "The outermost border of an open skin; auto: fixed over bone that does not move, "
                 "free elsewhere."),
          {"forces", list, "", "External forces on the skin."},
          {"forces[].at", vector, "required", "Where, on or near the skin.", "mm"},
          {"forces[].radius", number, "required", "Spread over the skin points within, by area.",
           "mm", Range::above(0)},
          {"forces[].force", vector, "required", "The total force.", "N"}};
}

/// The forms translate and rotate, below an entry of moves and below an item of a transform.
Keys form_keys(const std::string& above) {
  return {{above + ".landmark", map, "",
           "Form: puts a landmark of the bone in its place; a list of several pairs: the rigid "
           "motion that fits them best (see below)."},
          {above + ".landmark.from", place, "required",
           "Where it is before all moves; earlier moves of the bone carry it along."},
          {above + ".landmark.to", place, "required", "Where it goes."},
          {above + ".translate", vector, "", "Form: a translation.", "mm"},
          {above + ".rotate", map, "", "Form: a rotation by the right-hand rule."},
          {above + ".rotate.axis", vector, "required", "Direction of the axis, of any length."},
          {above + ".rotate.center", vector, "required", "A point on the axis.", "mm"},
          {above + ".rotate.angle", number, "required", "Angle.", "degrees",
           Range::between(-180, 180)}};
}

/// The form clinical, below an entry of moves.
Keys clinical_keys() {
  const std::string above = "moves[].clinical";
  const auto length = [&](const char* name, const char* sentence) {
    return Key{above + "." + name, number, "", sentence, "mm", Range::between(-30, 30)};
  };
  const auto angle = [&](const char* name, const char* sentence) {
    return Key{above + "." + name, number, "0", sentence, "degrees", Range::between(-45, 45)};
  };
  return {
      {above, map, "",
       "Form: a move in the words of surgery, in the axes of the head; rotations are about the "
       "pivot and made first."},
      length("advance", "Forward."),
      length("set_back", "Backward."),
      length("impaction", "Upward."),
      length("lower", "Downward."),
      length("left", "To the patient's left."),
      angle("yaw", "The front turns to the patient's left."),
      angle("roll", "The patient's left side goes up, which corrects a cant."),
      angle("pitch", "The front goes down."),
      angle("open", "As pitch, about the hinge axis through the condyles."),
      length(
          "overjet",
          "Target: upper incisors this far in front of the lower; excludes advance and set_back."),
      length("overbite",
             "Target: upper incisors this far below the edge of the lower; excludes impaction and "
             "lower."),
      {above + ".pivot", place, "",
       "Point of the axes of yaw, roll and pitch; by default the incisors of the jaw, or pogonion "
       "of a chin. For several bones the default is that of the first bone that has one."}};
}

Keys move_keys() {
  const Keys entry{
      {"moves", list, "",
       "Rigid motions of bones. Each entry has one form, or a list of that form's values applied "
       "in order; several entries of one bone apply in the order of the file."},
      {"moves[].bone", texts, "required",
       "The name of a bone or a piece, or several, which all make the move."}};
  const Keys transforms{
      {"moves[].transform", transform, "",
       "Form: a transform file of ITK or 3D Slicer (see below), a 4×4 matrix as four rows of four "
       "numbers, or a list of forms."},
      {"moves[].transform[]", transform, "",
       "One form of such a list: a file, a matrix, or one of those below."}};
  return joined(
      {entry, form_keys("moves[]"), clinical_keys(), transforms, form_keys("moves[].transform[]")});
}

Keys plan_keys() {
  return {
      {"plan", map, "",
       "Which pieces the plan moves and how far: attachment, border and contact follow from it, "
       "not from the moves."},
      {"plan.pieces", texts, "required", "The bones or pieces; no other bone may move."},
      {"plan.box", map, "", "Ranges of the motions, both ways: a rotation, then a translation."},
      {"plan.box.translate", vector, "[10, 10, 10]",
       "Largest components of the translation of a piece's centroid.", "mm",
       base::Range::between(0, 100)},
      {"plan.box.rotate", vector, "[10, 10, 10]",
       "Largest components of the rotation vector (axis times angle) about its centroid.",
       "degrees", base::Range::between(0, 90)}};
}

Keys solve_keys() {
  return {
      {"solve", map, "", "How the rest position is found."},
      one_of("solve.functional", "energy", {"energy", "force"}, "What is minimized."),
      {"solve.volume", map, "", "How the tissue keeps its volume."},
      {.path = "solve.volume.form",
       .kind = choice,
       .standard = "",
       .sentence = "Form of the volume term; when not given penalty, and none with functional "
                   "force, which takes none or paper only.",
       .choices = {"none", "paper", "penalty"},
       .removed = {{"exact",
                    "for tissue that keeps its volume remove the volume term and solve a solid "
                    "with tissue.material {poisson: 0.499, dilatation: nodal}, or give penalty"}}},
      {"solve.volume.bulk_modulus", number, "",
       "Bulk modulus κ of the penalty; when not given by poisson.", "N/mm²",
       Range{.min = 0, .max = 1e9, .min_excluded = true}},
      {"solve.volume.poisson", number, "0.45",
       "Poisson's ratio that springs, whose own is 1/4, are to have by the penalty; bulk_modulus "
       "overrides it.",
       "", Range::between(0.25, 0.4999)},
      {"solve.lambda", number, "0.5", "Weight λ of the volume form paper; no other form uses it.",
       "", Range{.min = 0, .max = 1, .min_excluded = true}},
      {"solve.accuracy", number, "0.1", "Largest distance to the rest position allowed.", "mm",
       Range::between(1e-12, 100)},
      {.path = "solve.load_steps",
       .kind = integer,
       .standard = "auto",
       .sentence = "Parts in which the bones are moved.",
       .range = Range::between(1, 100000),
       .choices = {"auto"}}};
}

Keys anatomy_keys() {
  return {
      {"anatomy", map, "", "Landmarks of the head, and what follows from them by default."},
      {"anatomy.landmarks", file, "required",
       "Landmarks under their standard names: .mrk.json, .fcsv, .csv or JSON; moves may name "
       "them."},
      one_of("anatomy.lips", "parted", {"parted", "joined"},
             "Lips are parted along their crease, between the corners of the mouth, or joined "
             "as in the scan; the key mouth overrides it."),
      one_of("anatomy.vestibule", "on", {"on", "off"},
             "Lips and cheeks in front of the teeth, from sulcus to sulcus, touch bone and are "
             "not attached to it; tissue.attach_regions override it."),
      {"anatomy.gap", number, "1", "Gap of the vestibule between mucosa and teeth.", "mm",
       Range::between(0, 10)},
      {"anatomy.lower_gap", number, "",
       "The gap in front of the lower teeth; unset, half of the overjet, at least gap and at "
       "most 4 mm.",
       "mm", Range::between(0, 10)},
      {"anatomy.adhesion", number, "0.0005",
       "Largest tension with which lips adhere to the teeth of their own jaw; 2 mm farther from "
       "them than at the start it is 0.7 of that.",
       "N/mm²", Range::between(0, 1)},
      {"anatomy.tone", number, "0.006",
       "Tone of the ring muscle of the mouth in a solid: stress along its fibers at the line "
       "between the lips, balanced as the head is recorded.",
       "N/mm²", Range::between(0, 1)},
      {"anatomy.pedicle", number, "0.5",
       "Least share of the tissue on the piece of a genioplasty that tissue.release leaves "
       "attached, by area of skin; 0 sets no limit.",
       "", Range::between(0, 1)},
      {"anatomy.septum", number, "",
       "Young's modulus of the nose within 5 mm of its septum's free edges, from the nasal "
       "spine to pronasale to nasion; tissue.material.regions override it.",
       "N/mm²", Range::between(1e-9, 1e9)}};
}

Keys osteotomy_keys() {
  return {
      {"landmarks", file, "",
       "Landmarks by name, for moves: JSON, {\"name\": [x, y, z], …}, or 3D Slicer's .mrk.json."},
      {"osteotomies", list, "", "Pieces cut off bones, one after the other."},
      {"osteotomies[].bone", text, "required",
       "The bone, or an earlier piece, that is cut; what is left keeps its name."},
      {"osteotomies[].piece", text, "required", "Name of the piece, from here on a bone."},
      one_of("osteotomies[].template", "", {"le_fort_1", "sagittal_split", "genioplasty"},
             "In place of planes or a surface, cuts that the landmarks of anatomy place."),
      {"osteotomies[].level", number, "",
       "With template: distance of the plane above the nasal spine (le_fort_1, default 5) or below "
       "point B (genioplasty, default 4).",
       "mm", Range::between(0, 30)},
      {"osteotomies[].planes", list, "",
       "Plane cuts. The piece is what lies in front of all of them."},
      {"osteotomies[].planes[].point", vector, "required", "A point of the plane.", "mm"},
      {"osteotomies[].planes[].normal", vector, "required", "Points to the piece; of any length."},
      {"osteotomies[].planes[].radius", number, "",
       "Cuts only within this distance of the point; everywhere when not given.", "mm",
       Range::above(0)},
      {"osteotomies[].surface", file, "",
       "A cutting surface, open or closed triangle mesh, facing the piece."},
      {"osteotomies[].kerf", number, "0", "Thickness of the saw blade, half on either side.", "mm",
       Range::between(0, 20)},
      {"osteotomies[].seed", vector, "",
       "A point inside the piece, which chooses it in place of the sides of the cuts.", "mm"}};
}

Keys collision_keys() {
  return {
      {"collision", map, "", "What is done about bones that touch on their way."},
      one_of("collision.mode", "report", {"report", "stop", "clamp"},
             "report: say so; stop: refuse the scene; clamp: move as far as there is no contact."),
      {"collision.clearance", number, "0", "Distance to be kept between bones.", "mm",
       Range::between(0, 50)},
      {"collision.tolerance", number, "0.05",
       "How much sooner than at contact a clamped motion may end.", "mm",
       Range::between(1e-4, 10)}};
}

Keys instrument_keys() {
  return {{"instruments", list, "",
           "Bodies pushed into the skin: each has one shape, where it is before the push."},
          {"instruments[].push", vector, "required", "How far and where to.", "mm"},
          one_of("instruments[].skin", "stick", {"stick", "slide"},
                 "What the skin does on it: stick, or slide without friction."),
          {"instruments[].sphere", map, "", "Shape: a ball."},
          {"instruments[].sphere.center", vector, "required", "Its center.", "mm"},
          {"instruments[].sphere.radius", number, "required", "Its radius.", "mm",
           Range{.min = 0, .max = 1e7, .min_excluded = true}},
          {"instruments[].capsule", map, "", "Shape: what is near a segment."},
          {"instruments[].capsule.from", vector, "required", "One end of the segment.", "mm"},
          {"instruments[].capsule.to", vector, "required", "The other end.", "mm"},
          {"instruments[].capsule.radius", number, "required", "Distance from the segment.", "mm",
           Range{.min = 0, .max = 1e7, .min_excluded = true}},
          {"instruments[].box", map, "", "Shape: a box along the axes."},
          {"instruments[].box.center", vector, "required", "Its center.", "mm"},
          {"instruments[].box.size", vector, "required", "Its lengths along x, y, z, > 0.", "mm"},
          {"instruments[].half_space", map, "", "Shape: all that lies behind a plane."},
          {"instruments[].half_space.point", vector, "required", "A point of the plane.", "mm"},
          {"instruments[].half_space.normal", vector, "required",
           "Its direction out of the body, of any length."},
          {"instruments[].mesh", file, "", "Shape: a closed triangle mesh."}};
}

Keys tearing_keys() {
  return {
      {"tearing", map, "", "Springs that a force pulls too hard tear; needs forces."},
      {"tearing.limit", number, "required", "Tension above which they do.", "N", Range::above(0)}};
}

Keys incision_keys() {
  return {{"incisions", list, "", "Cuts in the skin along a path, made in the stressed face."},
          {"incisions[].path", curve, "required",
           "Where the cut runs, within 5 mm of the skin: points, or 3D Slicer's .mrk.json."},
          {"incisions[].path[]", vector, "", "One of the points.", "mm"},
          {"incisions[].layers", integer, "required",
           "How many point layers it parts, from the skin down; at most tissue.layers.", "",
           Range::between(1, 64)}};
}

}  // namespace

const std::vector<Key>& all_keys() {
  static const Keys table =
      joined({surface_keys(), tissue_keys(), attach_keys(), material_keys(), spring_keys(),
              load_keys(), anatomy_keys(), osteotomy_keys(), move_keys(), plan_keys(),
              collision_keys(), instrument_keys(), contact_keys(), regions_keys(), incision_keys(),
              tearing_keys(), solve_keys()});
  return table;
}

const Key& find_key(std::string_view path) {
  const auto found = std::find_if(all_keys().begin(), all_keys().end(),
                                  [&](const Key& key) { return key.path == path; });
  if (found != all_keys().end()) return *found;
  throw base::InternalError(fmt::format("the table of scene keys has no {}", path));
}

std::vector<const Key*> keys_below(std::string_view path) {
  const std::string above = path.empty() ? "" : fmt::format("{}.", path);
  std::vector<const Key*> result;
  for (const Key& key : all_keys())
    if (key.path.starts_with(above) &&
        key.path.find_first_of(".[", above.size()) == std::string::npos)
      result.push_back(&key);
  return result;
}

std::string last_word(std::string_view path) {
  return std::string(path.substr(path.rfind('.') + 1));
}

std::string expected(const Key& key) {
  switch (key.kind) {
    case map:
      return "a map";
    case list:
      return "a list";
    case number:
    case integer:
      return base::expected_number(key.kind == integer, key.unit, key.range, key.choices);
    case numbers:
      return fmt::format("a list, each {}", base::expected_number(false, key.unit, key.range, {}));
    case vector:
      return fmt::format("three numbers [x, y, z]{}{}{}{}", key.unit.empty() ? "" : " of ",
                         key.unit, key.range.text().empty() ? "" : ", each ", key.range.text());
    case choice:
      return fmt::format("one of {}", fmt::join(key.choices, ", "));
    case text:
      return "a text";
    case texts:
      return "a text, or a list of texts";
    case place:
      return "three numbers [x, y, z] of mm, or the name of a landmark";
    case file:
      return "a file, relative to the scene's folder";
    case mesh:
      return "a file, relative to the scene's folder, or a map";
    case volume:
      return "a file or a folder of DICOM slices, relative to the scene's folder";
    case transform:
      return "a file, a 4×4 matrix, or a list";
    case curve:
      return "a list of points [x, y, z] of mm, or a file, relative to the scene's folder";
  }
  return {};
}

std::string describe_keys() {
  std::string text = "| key | value | default | meaning |\n|---|---|---|---|\n";
  for (const Key& key : all_keys())
    text += fmt::format("| `{}` | {} | {} | {} |\n", key.path, expected(key),
                        key.standard.empty() ? "–" : key.standard, key.sentence);
  return text;
}

}  // namespace repose::scene
