"""A graph of ROS 1 on the loopback: a master, and other processes."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

MISSING = [name for name in ("rosmaster", "rosbag") if shutil.which(name) is None]
PEER = Path(__file__).parent / "ros1_peer.py"
PATIENCE = 15.0
"""s that something may take on a busy machine; nothing is measured."""


class Ros1Graph:
    """The processes of a graph on the loopback."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        with closing(socket.socket()) as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.uri = f"http://127.0.0.1:{self.port}"
        self.environment = {
            **os.environ,
            "ROS_MASTER_URI": self.uri,
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder),
            "PYTHONUNBUFFERED": "1",
        }
        self.running: list[subprocess.Popen[str]] = []
        self.readers: list[threading.Thread] = []
        self.heard: list[Any] = []

    def start(self, *command: str, output: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
        log = (self.folder / f"{len(self.running)}-{Path(command[0]).name}.log").open("w")
        with log:
            process = subprocess.Popen(
                command, env=self.environment, stdout=output, stderr=log, text=True, start_new_session=True
            )
        self.running.append(process)
        return process

    def peer(self, *arguments: str, output: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
        return self.start(sys.executable, str(PEER), *arguments, output=output)

    def master(self) -> subprocess.Popen[str]:
        process = self.start("rosmaster", "--core", "-p", str(self.port))

        def answers() -> bool:
            with closing(socket.socket()) as probe:
                return probe.connect_ex(("127.0.0.1", self.port)) == 0

        until(answers)
        return process

    def node(self, settings: str, *arguments: str) -> subprocess.Popen[str]:
        config = self.folder / "brake.toml"
        config.write_text(settings)
        return self.start(
            sys.executable, "-m", "ttc_fast.cli", "node", "--ros1", "--config", str(config), "--", *arguments
        )

    def listen(self) -> None:
        process = self.peer("listen", output=subprocess.PIPE)

        def read() -> None:
            assert process.stdout is not None
            with process.stdout as lines:
                for line in lines:
                    if line.startswith("["):  # rospy prints as well
                        self.heard.append(json.loads(line))

        self.readers.append(threading.Thread(target=read, daemon=True))
        self.readers[-1].start()

    def said(self, kind: str) -> list[Any]:
        return [values[0] if len(values) == 1 else values for name, *values in list(self.heard) if name == kind]

    def brakes(self, expected: bool) -> None:
        """Wait until the node says so, from now on."""
        self.heard.clear()
        until(lambda: self.said("brake")[-3:] == [expected] * 3)

    def end(self) -> None:
        for process in reversed(self.running):
            kill(process)
        for reader in self.readers:
            reader.join()

    def logs(self) -> str:
        return "\n".join(f"{path.name}: {path.read_text()[-1500:]}" for path in sorted(self.folder.glob("*.log")))


def kill(process: subprocess.Popen[str]) -> None:
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def until(holds: Callable[[], object]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.01)
