"""Live odometry goes on while `keyframe` is blocked by a slow model; real processes over Zenoh. (contract)"""

import os
import signal
import time

import numpy as np
import pytest

from placegraph.runtime.config import RunConfig, build
from placegraph.runtime.launcher import Launcher
from placegraph.runtime.messages import Frame, Health, Keyframe, Pose, Segments
from placegraph.runtime.messages.topics import TOPICS

pytestmark = pytest.mark.bus

BLOCKED_S = 5.0  # at most; Zenoh drops a process that is silent for 10 s


def test_live_odometry_survives_a_blocked_keyframe(bus_config, tmp_path, wait_until) -> None:
    flat = {"width": 160, "height": 120, "rate_hz": 25.0, "frames": 1500}
    nodes = {
        "camera": {"source": "flat", "realtime": True, "settings": flat},
        "pose": {"stride": 2},
        "keyframe": {"translation_m": 0.01, "period_s": 0.1},
        "instances": {"model": "drawn_scene"},
    }
    received: dict[type, list] = {kind: [] for kind in (Frame, Pose, Keyframe, Segments)}
    health: dict[str, Health] = {}
    with Launcher(build(RunConfig(bus=bus_config, nodes=nodes), tmp_path), tmp_path) as launcher:
        for kind, messages in received.items():
            launcher.observe(kind, messages.append)
        launcher.observe(Health, lambda message: health.update({message.node: message}))  # type: ignore[attr-defined]
        launcher.start()
        frames, poses, keyframes = received[Frame], received[Pose], received[Keyframe]
        wait_until(lambda: received[Segments] and len(health) == 4, "segments and health")
        memory_mb = health["keyframe"].memory_mb

        os.kill(launcher.pids()["instances"], signal.SIGSTOP)  # a model that takes seconds
        sent = len(keyframes)
        wait_until(lambda: len(keyframes) - sent >= TOPICS[Keyframe].credit - 2, "the credit is used up", 3.0)
        time.sleep(0.3)
        blocked_keyframes, first_pose, first_frame = len(keyframes), len(poses), len(frames)
        wait_until(lambda: len(poses) - first_pose > TOPICS[Pose].credit + 8, "poses keep coming", BLOCKED_S)
        blocked_poses = poses[first_pose:]
        assert len(keyframes) == blocked_keyframes
        assert len(blocked_poses) > 0.9 * (len(frames) - first_frame)
        assert np.mean([pose.trusted for pose in blocked_poses]) > 0.95
        assert health["keyframe"].memory_mb < memory_mb + 10

        os.kill(launcher.pids()["instances"], signal.SIGCONT)
        newest_pose = poses[-1].frame_id
        wait_until(lambda: (launcher.poll(), len(keyframes) > blocked_keyframes + 10)[1], "keyframes go on")
        wait_until(
            lambda: keyframes[-1].frame_id > newest_pose and received[Segments][-1].frame_id > newest_pose, "new"
        )
        # the one that was being published, then the newest frames: those between were dropped
        assert keyframes[blocked_keyframes + 1].frame_id > newest_pose - 2 * TOPICS[Frame].keep_newest
        wait_until(lambda: health["keyframe"].drops > 0, "dropped frames are counted")
        assert health["pose"].drops == 0
        assert health["keyframe"].memory_mb < memory_mb + 10
