#!/usr/bin/env bash
# Runs clang-tidy 14 (Debian 12) with the checks of .clang-tidy over src and drivers, rooms in
# batches; nothing need be built. Exit status 1 where it warns.
#   tests/tidy.sh                    # all
#   tests/tidy.sh 'solve|results'    # files and batches whose names match
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. drivers/setup.sh

install_packages clang-tidy-14
cmake --preset tidy >/dev/null
# Debian's ITK 5.2 knows GCC alone: all of its words on compilers that is used.
exec run-clang-tidy-14 -quiet -p build-tidy -j "${JOBS:-$(nproc)}" \
  -extra-arg=-DITK_COMPILER_DETECTION_H -extra-arg=-DITK_NOEXCEPT=noexcept "${1:-.}"
