"""An S3 server on loopback, moto's, that answers 503 now and then: ``python -m tests.support.bucket EVERY``.

It prints its address. Every request whose number is a multiple of EVERY is answered by 503; 0 is never.
"""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

SLOW_DOWN = (
    b'<?xml version="1.0"?><Error><Code>SlowDown</Code><Message>Please reduce your request rate.</Message></Error>'
)
KEYS = {"AWS_ACCESS_KEY_ID": "key", "AWS_SECRET_ACCESS_KEY": "secret", "AWS_DEFAULT_REGION": "us-east-1"}


def serve(every: int) -> None:
    """Serve until standard input is closed."""
    from moto.server import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import make_server

    moto, numbers = DomainDispatcherApplication(create_backend_app), itertools.count(1)

    def answer(environment: Any, start: Any) -> Any:
        if every and not next(numbers) % every:
            environment["wsgi.input"].read(int(environment.get("CONTENT_LENGTH") or 0))
            start("503 Slow Down", [("Content-Type", "application/xml"), ("Content-Length", str(len(SLOW_DOWN)))])
            return [SLOW_DOWN]
        return moto(environment, start)

    server = make_server("127.0.0.1", 0, answer, threaded=True)
    print(f"http://127.0.0.1:{server.port}", flush=True)
    server.serve_forever()


@contextmanager
def bucket(every: int) -> Iterator[dict[str, str]]:
    """Run the server in a process of its own, and yield the environment by which S3 is found there."""
    command = [sys.executable, "-m", "tests.support.bucket", str(every)]
    server = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env={**os.environ, **KEYS}
    )
    try:
        assert server.stdout is not None
        yield {"AWS_ENDPOINT_URL": server.stdout.readline().strip(), **KEYS}
    finally:
        server.kill()
        server.communicate()


if __name__ == "__main__":
    serve(int(sys.argv[1]))
