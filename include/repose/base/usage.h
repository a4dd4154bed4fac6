#pragma once

namespace repose::base {

/// Bytes that this process holds on the heap, blocks mapped on their own included (glibc).
double heap_bytes();

/// CPU time of this process so far, s.
double cpu_seconds();

}  // namespace repose::base
