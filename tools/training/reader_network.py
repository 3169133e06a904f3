"""SmolLM2 as llama.cpp runs it, frozen, with a trainable low-rank adapter on every linear layer.

Source: LoRA (Hu et al. 2021). Not as in transformers and peft, whose layers are not used: sentences are concatenated
without padding, and q, k, v (gate, up) are one product. This trains several times as fast on two cores, and the weights
keep the order of the GGUF file.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from placegraph.runtime.errors import ModelError

RANK = 16  # a trial read 18 of 20 requests with it
ALPHA = 32.0  # LoRA: twice the rank is the usual choice; the product is scaled by ALPHA / RANK
# Linear layers that read the same input are computed together.
GROUPS = (("attn_q", "attn_k", "attn_v"), ("attn_output",), ("ffn_gate", "ffn_up"), ("ffn_down",))


class _Adapted(torch.autograd.Function):
    """x (T, in) times frozen weight (out, in) plus the low-rank part; the weight gets no gradient."""

    @staticmethod
    def forward(ctx: Any, x: Tensor, weight: Tensor, a: Tensor, b: Tensor) -> Tensor:
        inner = functional.linear(x, a)
        ctx.save_for_backward(x, weight, a, b, inner)
        return functional.linear(x, weight).addmm_(inner, b.t())

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor, None, Tensor, Tensor]:
        x, weight, a, b, inner = ctx.saved_tensors
        (grad,) = grads
        grad_inner = grad @ b
        return (grad @ weight).addmm_(grad_inner, a), None, grad_inner.t() @ x, grad.t() @ inner


class AdaptedLinear(nn.Module):
    """Linear layers of one input, each with its own low-rank pair `a` (RANK, in) and `b` (out, RANK)."""

    def __init__(self, weights: Sequence[Tensor], dtype: torch.dtype) -> None:
        super().__init__()
        self.weight = torch.cat(list(weights)).to(dtype)  # no buffer: it is in no checkpoint
        self.sizes = [len(weight) for weight in weights]
        wide = weights[0].shape[1]
        self.a = nn.ParameterList([nn.Parameter(torch.empty(RANK, wide)) for _ in weights])
        self.b = nn.ParameterList([nn.Parameter(torch.zeros(size, RANK)) for size in self.sizes])
        for a in self.a:
            nn.init.kaiming_uniform_(a, a=5**0.5)  # as peft does; b is zero, so nothing changes before the first step

    def forward(self, x: Tensor) -> Tensor:
        """(T, in) to (T, sum of outs)."""
        a = torch.cat(list(self.a)).to(self.weight.dtype)
        b = torch.block_diag(*self.b).mul(ALPHA / RANK).to(self.weight.dtype)
        product: Tensor = _Adapted.apply(x, self.weight, a, b)
        return product


class ReaderNetwork(nn.Module):
    """The language model of a GGUF file of the llama family; only the adapter is trained."""

    def __init__(self, model_path: Path, dtype: torch.dtype = torch.bfloat16) -> None:
        """Raises ModelError when the file is not such a model."""
        super().__init__()
        fields, tensors = _read_gguf(model_path)
        self.dtype = dtype
        self.layers, self.heads = int(fields["block_count"]), int(fields["attention.head_count"])
        self.key_heads = int(fields["attention.head_count_kv"])
        self.epsilon, self.base = float(fields["attention.layer_norm_rms_epsilon"]), float(fields["rope.freq_base"])
        self.embedding = tensors["token_embd.weight"].to(dtype)
        self.norms = [
            (tensors[f"blk.{i}.attn_norm.weight"], tensors[f"blk.{i}.ffn_norm.weight"]) for i in range(self.layers)
        ]
        self.last_norm = tensors["output_norm.weight"]
        self.blocks = nn.ModuleList(
            nn.ModuleList(
                AdaptedLinear([tensors[f"blk.{i}.{name}.weight"] for name in group], dtype) for group in GROUPS
            )
            for i in range(self.layers)
        )

    def forward(self, sentences: Sequence[Sequence[int]], predicted_at: Tensor) -> Tensor:
        """Logits (M, vocabulary) at positions `predicted_at` (M,) among the concatenated tokens of all sentences."""
        lengths = [len(sentence) for sentence in sentences]
        ids = torch.tensor([token for sentence in sentences for token in sentence])
        longest = max(lengths)
        place = torch.cat([torch.arange(length) + row * longest for row, length in enumerate(lengths)])
        turn = self._rotary_angles(longest)
        x = functional.embedding(ids, self.embedding).float()
        for (attention_norm, inner_norm), (qkv, out, gate_up, down) in zip(self.norms, self.blocks, strict=True):
            heads = self._attend(qkv(self._normed(x, attention_norm)), place, (len(lengths), longest), turn)
            x = x + out(heads)
            gate, up = gate_up(self._normed(x, inner_norm)).chunk(2, dim=1)
            x = x + down(functional.silu(gate) * up)
        return functional.linear(self._normed(x[predicted_at], self.last_norm), self.embedding).float()

    def _normed(self, x: Tensor, weight: Tensor) -> Tensor:
        return functional.rms_norm(x, weight.shape, weight, self.epsilon).to(self.dtype)

    def _rotary_angles(self, longest: int) -> Tensor:
        """Rotary turns (longest, 1, size / 2), complex; pairs of neighbours turn together, as in llama.cpp's order."""
        size = self.embedding.shape[1] // self.heads
        rates = self.base ** (-torch.arange(0, size, 2, dtype=torch.float64) / size)
        angles = torch.outer(torch.arange(longest, dtype=torch.float64), rates)
        return torch.polar(torch.ones_like(angles), angles).to(torch.complex64)[:, None]

    def _attend(self, qkv: Tensor, place: Tensor, shape: tuple[int, int], turn: Tensor) -> Tensor:
        """Causal attention within each sentence: (T, all heads' q, k, v) to (T, width).

        place: (T,) position of each token among rows of equal length; padding follows the tokens, so it is never
        attended.
        """
        rows, longest = shape
        all_heads = self.heads + 2 * self.key_heads
        padded = qkv.new_zeros(rows * longest, qkv.shape[1]).index_copy(0, place, qkv)
        padded = padded.view(rows, longest, all_heads, -1)
        random_transform, value = padded.split([self.heads + self.key_heads, self.key_heads], dim=2)
        pairs = torch.view_as_complex(random_transform.float().unflatten(-1, (-1, 2)))
        random_transform = torch.view_as_real(pairs * turn).flatten(-2).to(self.dtype)
        # heads that share a key lie behind each other, as further rows: (rows, key heads, shared * longest, size)
        query = (
            random_transform[:, :, : self.heads]
            .transpose(1, 2)
            .reshape(rows, self.key_heads, -1, random_transform.shape[-1])
        )
        key, value = random_transform[:, :, self.heads :].transpose(1, 2), value.transpose(1, 2)
        scores = (query @ key.transpose(2, 3)).view(rows, self.heads, longest, longest)
        ahead = torch.full((longest, longest), -torch.inf, dtype=self.dtype).triu(1)
        # written out: PyTorch's own attention takes six times as long for sentences this short
        weights = (scores * key.shape[-1] ** -0.5 + ahead).softmax(-1).view(rows, self.key_heads, -1, longest)
        mixed = (weights @ value).view(rows, self.heads, longest, -1)
        return mixed.transpose(1, 2).reshape(rows * longest, -1)[place]


def _read_gguf(path: Path) -> tuple[dict[str, Any], dict[str, Tensor]]:
    """Settings of the family and dequantised tensors of a GGUF file."""
    import gguf

    reader = gguf.GGUFReader(path)
    family = reader.fields["general.architecture"].contents()
    if family != "llama":
        raise ModelError(f"{path}: a model of the family llama is trained, not {family}")
    fields = {name.removeprefix("llama."): field.contents() for name, field in reader.fields.items()}
    tensors = {
        tensor.name: torch.from_numpy(np.array(gguf.quants.dequantize(tensor.data, tensor.tensor_type), np.float32))
        for tensor in reader.tensors
    }
    if "output.weight" in tensors:
        raise ModelError(f"{path}: its output has weights of its own; trained is what shares them with the input")
    return fields, tensors
