#pragma once
#include "repose/model/build.h"

/// Cheaper models of a scene, and what they say about its own.
namespace repose::adapt {

/// Resolution of a model: edge length of the skin and number of layers.
struct Resolution {
  double edge = 0;  ///< mm, of the skin's triangles; 0: the skin as it is
  int layers = 0;   ///< point layers; 0: the scene's
};

/// A model of the same anatomy and material at another resolution: the skin is remeshed, and each
/// kind of spring gets the modulus Σ k0 r_0² / Σ v_j and the strain reference s_ref / r_0 (mean by
/// volume) that its springs have in `fine`, the model of the anatomy as it is, so that constant
/// stiffnesses, too, mean the same material. Without initial stress (solve/prestress.h) and
/// incisions. Serial. Throws InputError where no valid model exists at that resolution.
model::BuiltModel coarse_model(const model::Anatomy& anatomy, const model::Model& fine,
                               const Resolution& resolution);

/// Returns whether the number of layers may differ from the scene's: it names none of them.
bool layers_are_free(const scene::Tissue& tissue);

}  // namespace repose::adapt
