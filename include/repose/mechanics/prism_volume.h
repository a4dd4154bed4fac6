#pragma once
#include <array>

#include "repose/mechanics/triple.h"
#include "repose/model/prism_geometry.h"

/// Derivatives of the volume of a prism with bilinear lateral faces (docs/theory/model.md "Prism
/// volume"):
///     v = D · [ 2 A1×A2 + A1×B2 + B1×A2 + 2 B1×B2 ] / 12,
/// a cubic polynomial of its six corners a0 a1 a2 b0 b1 b2. S is double, or Pair for two prisms.
namespace repose::mechanics {

using model::prism_volume;

template <class S>
using PrismTriples = std::array<Triple<S>, 6>;

inline PrismTriples<double> triples(const std::array<Vec3, 6>& corners) {
  PrismTriples<double> triples;
  for (int c = 0; c < 6; ++c) triples[c] = triple(corners[c]);
  return triples;
}

/// The edge vectors of which v is a cubic form, and the sums of them that its derivatives need.
/// Coordinates are subtracted first of all, so that nothing is lost far from the origin.
template <class S>
struct PrismEdges {
  Triple<S> a1, a2, b1, b2;    ///< A1 A2 B1 B2
  Triple<S> d;                 ///< 3 D
  Triple<S> top1, top2;        ///< 2 A + B
  Triple<S> bottom1, bottom2;  ///< A + 2 B
  explicit PrismEdges(const PrismTriples<S>& p)
      : a1(p[1] - p[0]),
        a2(p[2] - p[0]),
        b1(p[4] - p[3]),
        b2(p[5] - p[3]),
        d((p[3] - p[0]) + (p[4] - p[1]) + (p[5] - p[2])),
        top1(2.0 * a1 + b1),
        top2(2.0 * a2 + b2),
        bottom1(a1 + 2.0 * b1),
        bottom2(a2 + 2.0 * b2) {}
};

/// Derivatives by A1 A2 B1 B2 and 3 D, each times 36.
template <class S>
struct EdgeDerivatives {
  Triple<S> a1, a2, b1, b2, d;
  /// Those by the corners.
  PrismTriples<S> corners() const {
    constexpr double t = 1.0 / 36;
    return {t * (-a1 - a2 - d), t * (a1 - d), t * (a2 - d),
            t * (d - b1 - b2),  t * (d + b1), t * (d + b2)};
  }
};

/// v (mm³) and ∂v/∂(a0 a1 a2 b0 b1 b2) (mm²).
template <class S>
struct PrismSlope {
  S volume;
  PrismTriples<S> gradient;
  explicit PrismSlope(const PrismEdges<S>& e) {
    const Triple<S> normals = e.a1.cross(e.top2) + e.b1.cross(e.bottom2);
    volume = e.d.dot(normals) / 36.0;
    gradient = EdgeDerivatives<S>{e.top2.cross(e.d), e.d.cross(e.top1), e.bottom2.cross(e.d),
                                  e.d.cross(e.bottom1), normals}
                   .corners();
  }
};

/// (∂²v/∂x∂x) δx for corners that move by δx: `c` are the edges of the moves.
template <class S>
PrismTriples<S> prism_slope_change(const PrismEdges<S>& e, const PrismEdges<S>& c) {
  return EdgeDerivatives<S>{
      c.top2.cross(e.d) + e.top2.cross(c.d), c.d.cross(e.top1) + e.d.cross(c.top1),
      c.bottom2.cross(e.d) + e.bottom2.cross(c.d), c.d.cross(e.bottom1) + e.d.cross(c.bottom1),
      c.a1.cross(e.top2) + e.a1.cross(c.top2) + c.b1.cross(e.bottom2) + e.b1.cross(c.bottom2)}
      .corners();
}

/// Second derivatives of v. Every 3×3 block is skew: ∂²v/∂p_i∂p_j = [w_ij]×, with
/// [w]× y = w × y and w_ji = −w_ij, so w is what is returned (mm) for i < j; w_ii = 0.
inline std::array<PrismTriples<double>, 6> prism_volume_hessian(const PrismEdges<double>& e) {
  constexpr double t = 1.0 / 36;
  const Triple<double> f = t * e.d, g = 2.0 * f, o = {0, 0, 0};
  const Triple<double> p = t * e.top2, q = -t * e.top1, r = t * e.bottom2, s = -t * e.bottom1;
  const Triple<double> a = p + q, b = r + s;
  return {{{o, p + a - g, q + a + g, -a - b, r - a - f, s - a + f},
           {o, o, q - p - g, p - b + f, p + r, p + s - f},
           {o, o, o, q - b - f, q + r + f, q + s},
           {o, o, o, o, -r - b - g, -s - b + g},
           {o, o, o, o, o, r - s - g},
           {o, o, o, o, o, o}}};
}

}  // namespace repose::mechanics
