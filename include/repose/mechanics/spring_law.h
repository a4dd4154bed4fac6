#pragma once

/// The spring laws (docs/theory/model.md "Spring laws"; Teschner, Girod & Girod 2000, Eq. 13, Fig.
/// 3):
///     T(s) = k0 (1 + σ²)^p s,   σ = s / s_ref,   p ∈ {0, 1, 2},   E(s) = ∫₀ˢ T ds.
/// Free of any library, templated on the scalar so that a dual number differentiates it, and on the
/// spring's own numbers so that several springs can go through it at once.
namespace repose::mechanics {

/// Tension T(s) in N: k0 in N/mm, elongation s in mm, inverse_reference = 1 / s_ref in 1/mm.
template <int p, class Scalar, class Number>
Scalar spring_tension(Scalar s, Number k0, Number inverse_reference) {
  const Scalar q = (s * inverse_reference) * (s * inverse_reference);
  if constexpr (p == 0) return k0 * s;
  if constexpr (p == 1) return k0 * s * (1.0 + q);
  if constexpr (p == 2) return k0 * s * (1.0 + q) * (1.0 + q);
}

/// Energy E(s) in N·mm.
template <int p, class Scalar, class Number>
Scalar spring_energy(Scalar s, Number k0, Number inverse_reference) {
  const Scalar q = (s * inverse_reference) * (s * inverse_reference);
  if constexpr (p == 0) return 0.5 * k0 * s * s;
  if constexpr (p == 1) return 0.5 * k0 * s * s * (1.0 + 0.5 * q);
  if constexpr (p == 2) return 0.5 * k0 * s * s * (1.0 + q + q * q * (1.0 / 3.0));
}

/// Tangent stiffness dT/ds in N/mm; never negative.
template <int p, class Scalar, class Number>
Scalar spring_tangent(Scalar s, Number k0, Number inverse_reference) {
  const Scalar q = (s * inverse_reference) * (s * inverse_reference);
  if constexpr (p == 0) return Scalar(k0);
  if constexpr (p == 1) return k0 * (1.0 + 3.0 * q);
  if constexpr (p == 2) return k0 * (1.0 + q) * (1.0 + 5.0 * q);
}

/// d²T/ds² in N/mm².
template <int p, class Scalar, class Number>
Scalar spring_tangent_slope(Scalar s, Number k0, Number inverse_reference) {
  const Scalar once = k0 * s * inverse_reference * inverse_reference;
  if constexpr (p == 0) return Scalar(0.0);
  if constexpr (p == 1) return 6.0 * once;
  if constexpr (p == 2) {
    const Scalar q = (s * inverse_reference) * (s * inverse_reference);
    return 4.0 * once * (3.0 + 5.0 * q);
  }
}

/// Calls `visit` with the exponent as a compile-time constant: one branch a loop, none a spring.
template <class Visit>
decltype(auto) with_exponent(int p, Visit&& visit) {
  switch (p) {
    case 0:
      return visit.template operator()<0>();
    case 1:
      return visit.template operator()<1>();
    default:
      return visit.template operator()<2>();
  }
}

}  // namespace repose::mechanics
