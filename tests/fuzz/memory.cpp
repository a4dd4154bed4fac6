#include <cstdio>
#include <cstdlib>
#include <new>

/// Memory for the fuzzer: a request beyond all reason ends the process, for files of some kilobytes
/// justify none.
namespace {

constexpr size_t largest_request = 256 << 20;  // bytes at once

}  // namespace

void* operator new(size_t bytes) {
  if (bytes > largest_request) {
    std::fprintf(stderr, "asks for %zu bytes\n", bytes);
    std::abort();
  }
  if (void* memory = std::malloc(bytes > 0 ? bytes : 1)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }
