#include "repose/base/usage.h"

#include <malloc.h>

#include <ctime>

namespace repose::base {

double heap_bytes() {
  const auto use = mallinfo2();
  return static_cast<double>(use.uordblks) + static_cast<double>(use.hblkhd);
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace repose::base
