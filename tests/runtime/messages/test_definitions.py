import dataclasses

import numpy as np
import pytest

from placegraph.runtime import messages as m
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages.codec import decode, encode
from placegraph.runtime.messages.topics import TOPICS


def detections(n: int) -> m.Detections:
    return m.Detections(
        frame_id=3,
        stamp_ns=5,
        names=tuple(f"n{i}" for i in range(n)),
        boxes_px=np.arange(4 * n, dtype=np.float32).reshape(n, 4),
        scores=np.ones(n, np.float32),
    )


@pytest.mark.parametrize("n", [0, 1, 3])
def test_codec_gives_back_every_field_exactly(n: int) -> None:
    sent = detections(n)
    got = decode(m.Detections, encode(sent))
    assert (got.frame_id, got.stamp_ns, got.names) == (3, 5, sent.names)
    assert got.boxes_px.dtype == np.float32 and np.array_equal(got.boxes_px, sent.boxes_px)
    assert got.boxes_px.shape == (n, 4)


def test_nan_survives_and_decoded_arrays_are_read_only() -> None:
    sent = m.Question(
        frame_id=-1, stamp_ns=0, question_id="", text="?", k=1, mode="program", viewpoint_world=np.full(3, np.nan)
    )
    got = decode(m.Question, encode(sent))
    assert np.isnan(got.viewpoint_world).all()
    with pytest.raises(ValueError, match="read-only"):
        got.viewpoint_world[0] = 1.0


def test_wrong_dtype_shape_letter_and_scalar_are_named() -> None:
    good = detections(2)
    with pytest.raises(SchemaError, match=r"Detections.scores: expected dtype float32, got float64"):
        encode(dataclasses.replace(good, scores=np.ones(2)))
    with pytest.raises(SchemaError, match=r"Detections.boxes_px: expected shape"):
        encode(dataclasses.replace(good, boxes_px=np.ones((2, 5), np.float32)))
    with pytest.raises(SchemaError, match=r"scores: size N is 3 but 2 in Detections.boxes_px"):
        encode(dataclasses.replace(good, scores=np.ones(3, np.float32)))
    with pytest.raises(SchemaError, match=r"Detections.frame_id: expected int, got str"):
        encode(dataclasses.replace(good, frame_id="3"))  # type: ignore[arg-type]
    with pytest.raises(SchemaError, match=r"Detections.names: expected a tuple of strings"):
        encode(dataclasses.replace(good, names=["a", "b"]))  # type: ignore[arg-type]


def test_other_kind_other_version_and_rubbish_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    payload = encode(detections(1))
    with pytest.raises(SchemaError, match="expected a Tags, the payload is a Detections"):
        decode(m.Tags, payload)
    with pytest.raises(SchemaError, match="not a message"):
        decode(m.Detections, b"\xc1rubbish")
    with pytest.raises(SchemaError, match=r"damaged|not a message"):
        decode(m.Detections, payload[:-3])
    known = m.Detections.checksum()
    monkeypatch.setattr(m.Detections, "checksum", classmethod(lambda cls: "0000beef"))
    with pytest.raises(SchemaError, match=rf"declared as {known}, this process knows 0000beef: .* versions"):
        decode(m.Detections, payload)


def test_offsets_are_one_longer_than_items() -> None:
    empty, none = np.zeros(0, np.uint8), np.zeros((0, 4), np.int32)
    fields = {"frame_id": 0, "stamp_ns": 0, "names": (), "scores": np.zeros(0, np.float32), "mask_bits": empty}
    m.Segments(boxes_px=none, mask_offsets=np.zeros(1, np.int64), **fields).check()
    with pytest.raises(SchemaError, match="mask_offsets: size N is -1 but 0"):
        m.Segments(boxes_px=none, mask_offsets=np.zeros(0, np.int64), **fields).check()


def test_masks_pack_and_unpack() -> None:
    masks = [np.zeros((0, 3), bool), np.array([[True, False, True]] * 5), np.ones((2, 4), bool)]
    bits, offsets = m.Segments.pack(masks)
    boxes = np.array([[0, 0, 3, 0], [1, 1, 4, 6], [0, 0, 4, 2]], np.int32)
    scores = np.ones(3, np.float32)
    segments = m.Segments(
        frame_id=0,
        stamp_ns=0,
        names=("a", "b", "c"),
        scores=scores,
        boxes_px=boxes,
        mask_bits=bits,
        mask_offsets=offsets,
    )
    for want, got in zip(masks, segments.masks(), strict=True):
        assert np.array_equal(want, got)
    assert m.Segments.pack([])[1].tolist() == [0]


def test_every_message_has_a_topic_and_no_two_share_a_key() -> None:
    assert set(TOPICS) == set(m.all_kinds())
    keys = [topic.key for topic in TOPICS.values()]
    assert len(set(keys)) == len(keys)


def test_every_array_declares_its_unit() -> None:
    for kind in m.all_kinds():
        for name, spec in kind.array_specs().items():
            assert spec.unit, f"{kind.__name__}.{name}"


def test_checksum_depends_on_the_declaration() -> None:
    checksums = {kind.checksum() for kind in m.all_kinds()}
    assert len(checksums) == len(m.all_kinds())
