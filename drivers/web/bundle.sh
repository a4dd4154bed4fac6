#!/usr/bin/env bash
# Makes three.js of three_exports.js: one script without imports, so that pages work from a file and
# without a network. Needed only to take another version: the result is committed. Needs npm.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
version=0.187.0
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm init -y >/dev/null
npm install --silent "three@$version" esbuild@0.28.2
cp "$here/three_exports.js" entry.js
{
  printf '// three.js %s, bundled by bundle.sh of this folder.\n/*\n' "$version"
  cat node_modules/three/LICENSE
  printf '*/\n'
  npx esbuild entry.js --bundle --minify --format=iife --global-name=THREE --legal-comments=none \
    --charset=utf8 --target=es2020
} >"$here/three.js"
