"""The network that is trained, beside what llama.cpp computes of the same file and adapter."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")
pytest.importorskip("gguf", reason="training needs the extra `train`")

from placegraph.nodes.grounding.llm_parser import OPENING, model_input  # noqa: E402
from placegraph.runtime.errors import ModelError  # noqa: E402
from placegraph.runtime.language.language_model import LanguageModel, default_model_path  # noqa: E402
from placegraph.tools.training.lora_export import write_adapter  # noqa: E402
from placegraph.tools.training.reader_network import RANK, AdaptedLinear, ReaderNetwork  # noqa: E402

torch.set_num_threads(1)
TEXTS = ("the chair near the window", "the lamp", "facing the bed, the second pillow from the left")


@pytest.fixture(scope="module")
def network():
    """With an adapter that changes a lot."""
    torch.manual_seed(4)
    made = ReaderNetwork(default_model_path(), torch.float32)
    for weights in made.parameters():
        torch.nn.init.normal_(weights, std=0.03)
    return made


@torch.no_grad()
def last_logits(network, sentences):
    ends = torch.tensor([len(sentence) for sentence in sentences]).cumsum(0) - 1
    return network(sentences, ends).numpy()


def similarity(a, b):
    return float(np.corrcoef(a, b)[0, 1])


def test_it_computes_what_llama_cpp_computes_with_the_adapter_written_and_read(network, tmp_path):
    write_adapter(network, tmp_path / "adapter.gguf", {"name": "random"})
    model = LanguageModel(adapter_path=tmp_path / "adapter.gguf", n_ctx=128)
    sentences = [model.tokenize_prompt(model_input(text), OPENING) for text in TEXTS]
    computed = last_logits(network, sentences)
    for tokens, expected in zip(sentences, computed, strict=True):
        found = {}
        for adapted in (True, False):
            model._restore_prefix("", adapted)
            model._llama.eval(tokens)
            found[adapted] = model._next_log_probabilities()
        # llama.cpp rounds what enters a product to 8 bits
        assert similarity(found[True], expected) > 0.998
        assert int(found[True].argmax()) == int(expected.argmax())
        assert similarity(found[False], expected) < 0.99  # so the adapter was not left out
    model.close()


def test_a_sentence_is_computed_alike_alone_and_among_others(network):
    sentences = [[1, 30, 200, 7], [1, 5], [1, 40, 41, 42, 43, 44, 45]]
    together = last_logits(network, sentences)
    for sentence, expected in zip(sentences, together, strict=True):
        np.testing.assert_allclose(last_logits(network, [sentence])[0], expected, atol=2e-3)


def test_only_the_low_rank_pairs_are_trained(network):
    assert sum(weights.numel() for weights in network.parameters()) == 4_884_480
    assert all(RANK in weights.shape for weights in network.parameters())


def test_the_gradient_is_that_of_the_written_out_product():
    torch.manual_seed(1)
    linear = AdaptedLinear([torch.randn(3, 4), torch.randn(2, 4)], torch.float64)
    for pair in (*linear.a, *linear.b):
        torch.nn.init.normal_(pair)
    linear = linear.double()
    x = torch.randn(5, 4, dtype=torch.float64, requires_grad=True)
    changed = [b @ a * 2.0 for a, b in zip(linear.a, linear.b, strict=True)]
    written_out = x @ (linear.weight + torch.cat(changed)).t()
    torch.testing.assert_close(linear(x), written_out)
    inputs = [x, *linear.parameters()]
    torch.testing.assert_close(
        torch.autograd.grad((linear(x) ** 2).sum(), inputs), torch.autograd.grad((written_out**2).sum(), inputs)
    )


def test_another_family_is_refused(tmp_path):
    import gguf

    writer = gguf.GGUFWriter(tmp_path / "other.gguf", "gpt2")
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()
    with pytest.raises(ModelError, match="family llama is trained, not gpt2"):
        ReaderNetwork(tmp_path / "other.gguf")
