from pathlib import Path

import pytest

from placegraph.runtime.bus.flow_control import Envelope
from placegraph.runtime.bus.session import BusConfig
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Answer, Graph, LastKeyframe, Message, Question
from placegraph.runtime.messages.codec import encode
from placegraph.runtime.node import Context, Node, build_node
from placegraph.runtime.process import NodeProcess, ProcessSpec
from placegraph.tools.replay import replay_crash


def process(node: str | Node, folder: Path) -> NodeProcess:
    name = node if isinstance(node, str) else "grounding"
    context = Context(out_dir=str(folder))
    spec = ProcessSpec(node=name, settings={}, context=context, bus=BusConfig(), consumers={}, question_timeout_s=0.05)
    shell = NodeProcess(spec, build_node(name, {}, context) if isinstance(node, str) else node)
    shell._send_receipt = lambda payload, attachment: None
    return shell


def last_keyframe() -> LastKeyframe:
    return LastKeyframe(frame_id=-1, stamp_ns=0, keyframes=0)


def fail(shell: NodeProcess) -> None:
    shell._publishers = dict.fromkeys(shell.node.outputs, lambda payload, attachment: None)
    for number in (1, 2):  # the second one is one too many
        shell._handle(Envelope(LastKeyframe, number, encode(last_keyframe())))


def test_a_step_that_fails_leaves_a_crash_file_that_fails_again(tmp_path: Path, capsys) -> None:
    with pytest.raises(SchemaError, match="after the last keyframe"):
        fail(process("fusion", tmp_path))
    with pytest.raises(SchemaError, match="after the last keyframe"):
        replay_crash(tmp_path / "crash" / "fusion.rec")
    assert "gives Map of frame -1" in capsys.readouterr().out


def test_a_crash_file_that_cannot_be_written_does_not_hide_the_error(tmp_path: Path, caplog) -> None:
    (tmp_path / "crash").write_text("a file where the folder should be")
    with pytest.raises(SchemaError, match="after the last keyframe"):
        fail(process("fusion", tmp_path))
    assert "no whole crash file" in caplog.text


class SlowAnswers(Node):
    """Answers nothing in time."""

    inputs, outputs, serves = (Graph, Question), (Answer,), (Question, Answer)
    stepped: int = 0

    def step(self, message: Message) -> list[Message]:
        self.stepped += 1
        return []


class Asker:
    """Stands where the bus's IncomingQuery stands."""

    payload = b'{"text": "cup"}'
    replied = False

    def reply(self, payload: bytes) -> None:
        self.replied = True


@pytest.mark.parametrize("in_time", [True, False])
def test_a_question_that_nobody_waits_for_any_more_is_not_stepped(tmp_path: Path, in_time: bool) -> None:
    node, asker = SlowAnswers(None, Context()), Asker()
    shell = process(node, tmp_path)
    shell._publishers = {Question: lambda payload, attachment: None}
    shell._query_server.receive(asker)  # type: ignore[arg-type]
    envelope = shell.inbox.get(1.0)
    assert envelope is not None
    if not in_time:
        shell._query_server._waiting[envelope.sequence].timer.join()
        assert asker.replied
    shell._handle(envelope)
    assert node.stepped == int(in_time)
    shell.end()
