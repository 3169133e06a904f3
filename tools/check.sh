#!/usr/bin/env bash
# The checks that CI runs: lint, format, types, documentation. PYTHON names the interpreter of an environment with the
# extras dev and docs.
set -euo pipefail
cd "$(dirname "$0")/.."
PYTHON="${PYTHON:-python}"
mkdir -p build/types/placegraph
for folder in configs models_onnx nodes runtime tools; do  # type checkers cannot follow the mapped editable install
    ln -sfn "../../../$folder" "build/types/placegraph/$folder"
done
"$PYTHON" -m ruff check --output-format=concise .
"$PYTHON" -m ruff format --check .
"$PYTHON" -m mypy build/types/placegraph/{configs,models_onnx,nodes,runtime,tools} docs/generate.py
"$PYTHON" docs/generate.py --check
NO_MKDOCS_2_WARNING=1 "$PYTHON" -m mkdocs build --quiet
