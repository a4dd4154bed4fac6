#!/usr/bin/env bash
# Installs what is missing (apt), builds with warnings as errors, checks the formatting, runs every
# test. Ends with ctest's own summary.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. drivers/setup.sh

install_packages "${build_packages[@]}" "${test_packages[@]}"
cmake --preset ci
cmake --build --preset ci

if command -v clang-format-14 >/dev/null; then
  find drivers examples include src tests \( -name '*.h' -o -name '*.cpp' \) -print0 |
    xargs -0 clang-format-14 --dry-run --Werror
else
  echo "formatting: not checked, the layout is that of clang-format 14 (Debian 12)"
fi

mpi_environment
exec ctest --preset ci
