#!/usr/bin/env bash
# Build sdist and wheel, install the wheel into an empty environment, and use it from another folder.
# PYTHON names the interpreter; the packages stay in dist/.
set -euo pipefail
cd "$(dirname "$0")/.."
PYTHON="${PYTHON:-python}"
export CMAKE_ARGS="${CMAKE_ARGS:--DGGML_NATIVE=OFF -DLLAVA_BUILD=OFF}"  # see the Makefile
root="$PWD"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
"$PYTHON" -m venv "$work/build"
"$work/build/bin/python" -m pip install --quiet --constraint constraints.txt build
rm -rf dist
"$work/build/bin/python" -m build --outdir dist
"$PYTHON" -m venv "$work/user"
"$work/user/bin/python" -m pip install --quiet --constraint constraints.txt dist/*.whl
cd "$work"
"$work/user/bin/placegraph" check flat.toml > check.txt
"$work/user/bin/placegraph" run flat.toml --limit 60 --out map --quiet --endpoint tcp/127.0.0.1:7463
"$work/user/bin/placegraph" graph map
echo "the wheel works: $(cd "$root" && ls dist)"
