#include "column_sweep_loops.h"

namespace repose::linear {

namespace {

/// Column by column of a block.
class Products {
 public:
  void add(const PackedBlock* block, Lanes x) {
    const Lanes scaled = x * block->unit();
    sums_ += column(block->entry) * scaled[0] + column(block->entry + 3) * scaled[1] +
             column(block->entry + 6) * scaled[2];
  }
  Lanes total() const { return sums_; }

 private:
  static Lanes column(const int16_t* entry) {
    return Lanes{static_cast<float>(entry[0]), static_cast<float>(entry[1]),
                 static_cast<float>(entry[2])};
  }
  Lanes sums_{};
};

}  // namespace

const Sweeps plain_sweeps = SweepLoops<Products>::table;

}  // namespace repose::linear
