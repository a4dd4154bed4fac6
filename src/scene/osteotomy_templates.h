#pragma once
#include <optional>
#include <string>
#include <vector>

#include "repose/scene/scene.h"

namespace repose::scene {

/// Gives an osteotomy the cuts of its template (made_by), by landmarks and in the head's axes:
///
/// - le_fort_1: a level plane `level` mm (default 5) above the nasal spine, and one behind the
///   upper jaw, 0.57 of the way from the upper incisors to the condyles;
/// - genioplasty: a plane `level` mm (default 4) below point B that falls by 25° towards the back;
/// - sagittal_split: on either side a buccal, a sagittal and a lingual sheet, at fixed fractions of
///   the mandible's length, width and height, the lingual one above the lingula.
///
/// Throws InputError naming a landmark that is missing.
void place_template(const AnatomyPlan& anatomy, std::optional<double> level, Osteotomy& cut);

/// Warnings, each a line without the osteotomy's name, about a plane that crosses the hard palate,
/// roots of teeth or the mandibular canal by rule. Roots end 27 mm above or 25 mm below the
/// incisors' edges; the canal's foramen lies 0.36 of the symphysis' height above menton, 0.25 of
/// the way from the incisors to the condyles, and the canal up to 5 mm below it.
std::vector<std::string> check_cut(const AnatomyPlan& anatomy, const Osteotomy& cut);

}  // namespace repose::scene
