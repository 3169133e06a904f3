"""Writes the low-rank adapter of the request reader as a GGUF file for llama.cpp. Source: llama-adapter.cpp."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from placegraph.tools.training.reader_network import ALPHA, GROUPS, ReaderNetwork


def write_adapter(network: ReaderNetwork, path: Path, card: Mapping[str, str]) -> None:
    """Writes the low-rank pairs in half precision, replacing the file atomically; card: its metadata."""
    import gguf

    partial = path.with_suffix(".part")
    writer = gguf.GGUFWriter(partial, "llama")
    writer.add_type(gguf.GGUFType.ADAPTER)
    writer.add_string(gguf.Keys.Adapter.TYPE, "lora")
    writer.add_float32(gguf.Keys.Adapter.LORA_ALPHA, ALPHA)
    for key, value in card.items():
        writer.add_string(f"general.{key}", value)
    for i, block in enumerate(network.blocks):
        for group, linear in zip(GROUPS, block, strict=True):
            for name, a, b in zip(group, linear.a, linear.b, strict=True):
                for half, pair in (("lora_a", a), ("lora_b", b)):
                    writer.add_tensor(f"blk.{i}.{name}.weight.{half}", pair.detach().numpy().astype(np.float16))
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()
    os.replace(partial, path)
