"""Training the reader: what is predicted of which tokens, and a run of a few steps that is stopped and gone on with."""

from __future__ import annotations

import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")
pytest.importorskip("gguf", reason="training needs the extra `train`")

from placegraph.nodes.grounding.llm_parser import parse_by_model  # noqa: E402
from placegraph.runtime.errors import ConfigError, ModelError  # noqa: E402
from placegraph.runtime.language.language_model import LanguageModel  # noqa: E402
from placegraph.tools.training import reader_training  # noqa: E402
from placegraph.tools.training.request_grammar import Example  # noqa: E402

torch.set_num_threads(1)
EXAMPLES = (
    Example("The lamp on the desk.", "lamp; on (desk)"),
    Example("the chair", "chair"),
    Example("the red box, near the door", "box; is red; near (door)"),
)


@pytest.fixture(scope="module")
def model():
    made = LanguageModel(n_ctx=128)
    yield made
    made.close()


def test_the_reply_alone_is_predicted_from_what_stands_before_each_of_its_tokens(model):
    seen = {}

    def network(tokens, wanted):
        seen.update(tokens=tokens, wanted=wanted)
        return torch.zeros(len(wanted), 10)

    _, targets = reader_training.TokenBatch(model, EXAMPLES).logits(network)
    laid_out = [token for tokens in seen["tokens"] for token in [*tokens, None]]  # None: the last is never read
    ends = torch.tensor([len(tokens) for tokens in seen["tokens"]]).cumsum(0)
    following = [laid_out[at + 1 + int((ends <= at).sum())] for at in seen["wanted"].tolist()]
    assert all(found in (None, target) for found, target in zip(following, targets.tolist(), strict=True))
    assert following.count(None) == len(EXAMPLES)
    model.load()
    written = model._llama.detokenize(targets.tolist()).decode()
    assert written == "".join(f" {example.program}\n" for example in EXAMPLES)


def test_a_request_is_right_when_all_its_tokens_are(model):
    def network(tokens, wanted):
        made = torch.nn.functional.one_hot(targets, 50_000).float()
        made[0] = 0  # of the first request
        return made

    _, targets = reader_training.TokenBatch(model, EXAMPLES).logits(lambda tokens, wanted: wanted)
    assert reader_training.count_exact(model, network, EXAMPLES) == len(EXAMPLES) - 1


def test_unusable_settings_are_named(tmp_path):
    with pytest.raises(ConfigError, match="set aside for validation"):
        reader_training.train_reader(tmp_path / "a.gguf", 1, seed=reader_training.VALIDATION_SEED)
    with pytest.raises(ConfigError, match=r"ends in \.gguf"):
        reader_training.train_reader(tmp_path / "a.bin", 1)
    with pytest.raises(ModelError, match=r"none\.gguf: no such language model"):
        reader_training.train_reader(tmp_path / "a.gguf", 1, model_path=tmp_path / "none.gguf")


def test_a_run_learns_stops_and_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(reader_training, "examples", lambda seed, start, count, held_out=False: list(EXAMPLES))
    monkeypatch.setattr(reader_training, "VALIDATION", len(EXAMPLES))
    monkeypatch.setattr(reader_training, "WARM_UP", 2)
    out = tmp_path / "reader.gguf"
    reader_training.train_reader(out, 12, batch=3, threads=1)
    first = out.read_bytes()
    reader_training.train_reader(out, 24, batch=3, threads=1)
    assert out.read_bytes() != first
    said = capsys.readouterr().out
    assert "step 12: " in said
    assert f"step 24: {len(EXAMPLES)} of {len(EXAMPLES)} held-out requests read exactly" in said
    learned = LanguageModel(adapter_path=out, n_ctx=128)
    assert parse_by_model(learned, EXAMPLES[0].text).thing.noun == "lamp"
    learned.close()
