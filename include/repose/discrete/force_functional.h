#pragma once
#include <memory>

#include "repose/discrete/tangent.h"

namespace repose::discrete {

/// The force functional (docs/theory/model.md Eqs. 7, 11): Φ = λ Σ_{i ∈ P_s} (√(|F_i|² + ε²) − ε),
/// with (1 − λ) f_v where the volume term is the paper's. All members collective unless said
/// otherwise.
class ForceFunctional : public Function {
 public:
  /// `elastic` is f_e + W alone; `weights` are λ and the volume term, none or paper.
  ForceFunctional(Objective& elastic, const mechanics::Weights& weights);

  void set_epsilon(double epsilon) { epsilon_ = epsilon; }  ///< N, > 0; not collective
  double epsilon() const { return epsilon_; }
  double largest_force(Vec displacement);  ///< N, max |F_i|

  const mechanics::Weights& weights() const { return weights_; }
  Objective& elastic() { return elastic_; }
  Objective* volume() { return volume_.get(); }  ///< (1 − λ) f_v alone; null without volume term
  /// [local points] F/√(|F|² + ε²) at soft tissue, as of the positions' last update. Collective.
  std::span<const Vec3> directions();

 private:
  double value_and_gradient(Vec displacement, Vec gradient) override;

  Objective& elastic_;
  mechanics::Weights weights_;
  std::unique_ptr<Objective> volume_;
  double epsilon_ = 1;
  base::VecHandle unit_, volume_gradient_;
  std::vector<Vec3> direction_;  // [local points] F/√(|F|² + ε²) at soft tissue, else zero
};

/// The force functional's second derivatives, with H the exact Hessian of f_e, w_i = F_i/ρ_i,
/// ρ_i = √(|F_i|² + ε²) and D_i = (1 − w wᵀ)/ρ:
///     exact    λ (H D H − ∂(H w)/∂x at fixed w) + (1 − λ) ∇²f_v
///     convex   λ H D H + 2 (1 − λ) Σ ∇v ∇vᵀ, the Gauss–Newton operator, never indefinite
class ForceHessian : public Hessian {
 public:
  ForceHessian(ForceFunctional& functional, Tangent& elastic);  ///< assembled at no displacement

  void assemble(Vec displacement) override;  ///< collective
  Mat exact() override { return exact_; }
  Mat spd_approximation() override { return spd_; }
  Mat model() override { return spd_; }
  bool elliptic() const override { return false; }  // its square

 private:
  void make_metric();
  void fill_metric();
  void lift_diagonal();

  ForceFunctional& functional_;
  Tangent& elastic_;
  std::unique_ptr<Tangent> volume_;
  base::MatHandle metric_;  // λ D, block diagonal
  base::MatHandle third_;
  base::MatHandle spd_, exact_;
  int64_t elastic_assemblies_ = -1;  // of H and …
  double epsilon_ = 0;               // … ε, at the last assembly
};

}  // namespace repose::discrete
