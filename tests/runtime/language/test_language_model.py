import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from placegraph.nodes.grounding.llm_parser import default_adapter_path
from placegraph.runtime.errors import ModelError, QueryError
from placegraph.runtime.language.grammar_options import enum_rule
from placegraph.runtime.language.language_model import MAX_CACHED_PREFIXES, LanguageModel, default_model_path


@pytest.fixture(scope="module")
def model():
    made = LanguageModel(n_ctx=256)
    yield made
    made.close()


@pytest.fixture(scope="module")
def adapted():
    made = LanguageModel(n_ctx=256, adapter_path=default_adapter_path())
    yield made
    made.close()


def test_the_packaged_model_is_there():
    assert default_model_path().stat().st_size > 50_000_000


def test_a_prompt_that_does_not_fit_is_refused_and_the_model_lives_on(model):
    for _ in range(2):
        with pytest.raises(QueryError, match="do not fit the context of 256"):
            model.complete("word " * 300, "root ::= " + enum_rule(["O1"]), 8)
    with pytest.raises(QueryError, match="do not fit"):
        model.log_probabilities("word " * 150, " word" * 150, [" a"])
    assert model.complete("Say O1:", "root ::= " + enum_rule(["O1"]), 8).text == "O1"


def test_a_reply_that_is_cut_off_is_refused(model):
    with pytest.raises(QueryError, match="longer than 2 tokens"):
        model.complete("Say:", "root ::= " + enum_rule(["a very long reply that needs many tokens"]), 2)


def test_log_probabilities(model):
    options = [" bedroom", " garage", " dining room"]
    values = model.log_probabilities("A bed is found in the bedroom. A", " pillow is found in the", options)
    assert values.shape == (3,)
    assert (values < 0).all()
    assert int(np.argmax(values)) == 0
    model.complete("Say O1:", "root ::= " + enum_rule(["O1"]), 8)
    again = model.log_probabilities("A bed is found in the bedroom. A", " pillow is found in the", options[::-1])
    np.testing.assert_array_equal(values, again[::-1])
    assert model.log_probabilities("A", " b", []).shape == (0,)


OPENING, TEXT, OPTIONS = "A bed is found in the bedroom. A", " pillow is found in the", (" bedroom", " dining room")


def probabilities(model):
    return model.log_probabilities(OPENING, TEXT, OPTIONS).tobytes()


def decoded(model, prefix="Say O2 or O1."):
    """A reply and every bit of what the model would say next."""
    reply = model.complete(" Say:", 'root ::= " " ("O1" | "O2")', 8, prefix=prefix)
    return reply, model._next_log_probabilities().tobytes()


def test_replies_do_not_depend_on_what_was_asked_before(model):
    first = probabilities(model), decoded(model), decoded(model, "")
    model.complete("word " * 200, "root ::= " + enum_rule(["O1"]), 8)
    assert (decoded(model), decoded(model, ""), probabilities(model)) == (first[1], first[2], first[0])
    model.log_probabilities("Another opening of other words", TEXT, OPTIONS[::-1])
    assert decoded(model, "") == first[2]
    assert [probabilities(model), probabilities(model)] == [first[0]] * 2
    assert [decoded(model), decoded(model)] == [first[1]] * 2


def test_replies_are_the_same_in_a_new_process(model):
    code = (
        "from placegraph.runtime.language.language_model import LanguageModel;"
        f"print(LanguageModel(n_ctx=256).log_probabilities({OPENING!r}, {TEXT!r}, {OPTIONS!r}).tobytes().hex())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert bytes.fromhex(done.stdout.strip()) == probabilities(model)


def mapping_of_the_model(pid):
    """Permissions of the model file's mapping in a process, and its sizes in kB by name (proc(5), smaps)."""
    regions = re.split(r"(?m)^(?=[0-9a-f]+-[0-9a-f]+ )", Path(f"/proc/{pid}/smaps").read_text())
    (region,) = [region for region in regions if str(default_model_path()) in region.split("\n")[0]]
    return region.split()[1], {name: int(size) for name, size in re.findall(r"(?m)^(\w+): +(\d+) kB", region)}


@pytest.mark.skipif(not Path("/proc/self/smaps").exists(), reason="only Linux says how memory is mapped")
def test_processes_share_the_pages_of_the_model_file(model):
    model.complete("Say O1:", "root ::= " + enum_rule(["O1"]), 8)
    file = os.open(default_model_path(), os.O_RDONLY)
    os.fsync(file)  # pages of a file that was written just now count as dirty until they are on the disk
    os.close(file)
    code = (
        "from placegraph.runtime.language.language_model import LanguageModel; model = LanguageModel(n_ctx=256);"
        "model.complete('Say O1:', 'root ::= \"O1\"', 8); print('loaded', flush=True); input()"
    )
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, "-c", code], **pipes) as other:
        assert other.stdout.readline() == "loaded\n"
        mappings = [mapping_of_the_model(pid) for pid in ("self", other.pid)]
        other.communicate("\n")
    for permissions, kb in mappings:
        assert permissions == "r--s"  # shared, never written
        assert kb["Rss"] > 80_000  # of a file of 92 MB: nothing was copied into memory of the process's own
        assert kb["Private_Dirty"] == kb["Private_Clean"] == kb["Anonymous"] == 0
        assert kb["Pss"] <= 0.51 * kb["Rss"]


def test_what_fits(model):
    assert model.fits("word " * 100, "word " * 100, 8)
    assert not model.fits("word " * 100, "word " * 100, 100)
    assert not model.fits("word " * 150, "word " * 150, 8)


def test_marks_in_a_text_after_a_prefix_are_only_words(model):
    assert len(model.tokenize_prompt("<|im_end|>")) == 1
    assert len(model.tokenize_prompt("<|im_end|>", "a")) > 2


def test_the_prefix_states_kept_are_bounded(model):
    first = decoded(model)
    for number in range(MAX_CACHED_PREFIXES + 2):
        decoded(model, f"Opening {number}.")
        assert len(model._prefix_states) <= MAX_CACHED_PREFIXES
    assert decoded(model) == first


def test_a_reply_says_how_likely_it_was_among_what_is_allowed(model):
    prompt, rules = "One, two, three, four,", 'root ::= " five" | " seven"'
    free = model.complete(prompt, rules, 8)
    assert free.text == " five"
    values = model.log_probabilities("One, two, three,", " four,", [" five", " seven"])
    assert free.log_probability == pytest.approx(values[0], abs=0.02)  # read in one piece there, in two here
    forced = model.complete(prompt, 'root ::= " seven"', 8)
    assert forced.text == " seven"
    assert forced.log_probability > values[1] + 1  # " s" and " se" are allowed, too
    assert values[1] < -3


def test_where_the_end_and_more_are_allowed_the_model_decides(model):
    rules = 'root ::= "O1" ("2" | "3")?'
    assert model.complete("O12 O12 O12 O12 ", rules, 8).text == "O12"
    assert model.complete("Say O1 and nothing else.\nO1\nO1\nO1\nO1\n", rules + ' | "O1\n"', 8).text.strip() == "O1"


def test_a_grammar_that_cannot_be_read_is_an_error_and_not_a_crash(model):
    for rules in ("root ::= nothing", 'foot ::= "x"', "{{"):
        with pytest.raises(ModelError, match="cannot read this grammar"):
            model.complete("Say:", rules, 8)


def test_the_adapter_is_on_for_the_calls_that_ask_for_it_alone(model, adapted):
    def pair(asked):
        return decoded(asked), probabilities(asked)

    plain = pair(model)
    assert pair(adapted) == plain
    rules = 'root ::= " O1" | " O2"'
    first = adapted.complete(" Say:", rules, 8, prefix="A lamp.", use_adapter=True)
    assert first != adapted.complete(" Say:", rules, 8, prefix="A lamp.")
    assert pair(adapted) == plain
    assert adapted.complete(" Say:", rules, 8, prefix="A lamp.", use_adapter=True) == first


def test_an_adapter_that_is_not_there_or_does_not_fit_is_named(tmp_path, model):
    with pytest.raises(QueryError, match="has no adapter"):
        model.complete("Say:", "root ::= " + enum_rule(["O1"]), 8, use_adapter=True)
    with pytest.raises(ModelError, match=r"nothing\.gguf: no such adapter"):
        LanguageModel(adapter_path=tmp_path / "nothing.gguf").load()
    broken = tmp_path / "broken.gguf"
    for content in (b"", b"no adapter", default_adapter_path().read_bytes()[:100_000]):
        broken.write_bytes(content)
        with pytest.raises(ModelError, match=r"broken\.gguf: llama\.cpp cannot load it as an adapter of SmolLM2"):
            LanguageModel(adapter_path=broken).load()
    with pytest.raises(ModelError, match=r"Q4_1\.gguf: llama\.cpp cannot load it as an adapter"):
        LanguageModel(adapter_path=default_model_path()).load()


def test_a_chat_prompt_is_in_the_template_of_the_model(model):
    prefix, suffix = model.apply_chat_template("Say yes. ")
    assert prefix.endswith("<|im_start|>user\nSay yes. ")
    assert suffix == "<|im_end|>\n<|im_start|>assistant\n"
    grammar = "root ::= " + enum_rule(["yes", "no"])
    replies = {model.complete("Now", grammar, 8, prefix=prefix, suffix=suffix) for _ in range(2)}
    assert len(replies) == 1
    assert not model.fits(prefix, "Now", 256, suffix)


@pytest.fixture
def templated(monkeypatch):
    """A model whose file holds another chat template."""

    def make(template):
        made = LanguageModel(n_ctx=256)
        made.load()
        made._llama.metadata["tokenizer.chat_template"] = template
        return made

    return make


def test_a_model_without_a_template_gets_the_words_alone(templated):
    assert templated("").apply_chat_template("Say yes. ") == ("Say yes. ", "\n")


def test_a_template_sees_no_clock_and_the_marks_of_its_model(templated):
    template = "{{ bos_token }}{{ strftime_now('%Y') }} {{ messages[0]['content'] }}{{ eos_token }}"
    assert templated(template).apply_chat_template("Hi ") == ("<|im_start|>2024 Hi ", "<|im_end|>")


def test_a_template_that_cannot_be_used_is_named(templated):
    for template in ("{{ nothing() }}", "{% if %}", "{{ raise_exception('no user') }}"):
        with pytest.raises(QueryError, match="chat template"):
            templated(template).apply_chat_template("Hi ")
    with pytest.raises(QueryError, match="leaves out what the user says"):
        templated("no words").apply_chat_template("Hi ")
