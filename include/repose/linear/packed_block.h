#pragma once
#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <cstdint>

/// 3×3 blocks of matrices in half the memory of single precision, for preconditioners, which are
/// as fast as memory brings them their matrices.
namespace repose::linear {

/// Entries as whole multiples of a unit, which is the block's own: an entry is rounded by less than
/// 2⁻¹⁵ of the block's largest.
struct PackedBlock {
  int16_t entry[9];     ///< column by column
  uint16_t upper_bits;  ///< of the unit, a float; its lower ones are 0

  float unit() const { return std::bit_cast<float>(uint32_t{upper_bits} << 16); }
  Eigen::Matrix3f unpacked() const {
    return unit() * Eigen::Map<const Eigen::Matrix<int16_t, 3, 3>>(entry).cast<float>();
  }
  PackedBlock transposed() const {
    const int16_t(&e)[9] = entry;
    return {{e[0], e[3], e[6], e[1], e[4], e[7], e[2], e[5], e[8]}, upper_bits};
  }
  /// What is nearest to a block; 0 where its largest entry is no normal number.
  static PackedBlock of(const Eigen::Matrix3f& exact) {
    constexpr float most = 32767;
    const float largest = exact.cwiseAbs().maxCoeff();
    PackedBlock block{};
    block.upper_bits =
        static_cast<uint16_t>((std::bit_cast<uint32_t>(largest / most) >> 16) + 1);  // rounded up
    if (!std::isnormal(block.unit())) return {};
    const float inverse = 1 / block.unit();
    for (int k = 0; k < 9; ++k)
      block.entry[k] = static_cast<int16_t>(std::lrint(inverse * exact.data()[k]));
    return block;
  }
};

}  // namespace repose::linear
