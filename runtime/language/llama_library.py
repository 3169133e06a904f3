"""The import of llama.cpp, with the buffers switched off that crash some processors."""

from __future__ import annotations

from typing import Any


def import_llama_cpp() -> Any:
    """The module llama_cpp without AMX buffers: its AMX kernels crash on Sapphire Rapids (llama.cpp issue 20824)."""
    import llama_cpp

    library = llama_cpp.llama_cpp
    if not getattr(library.llama_model_default_params, "without_amx", False):
        default_params = library.llama_model_default_params

        def params_without_extra_buffers() -> Any:
            params = default_params()
            params.use_extra_bufts = False
            return params

        params_without_extra_buffers.without_amx = True  # type: ignore[attr-defined]
        library.llama_model_default_params = llama_cpp.llama_model_default_params = params_without_extra_buffers
    return llama_cpp
