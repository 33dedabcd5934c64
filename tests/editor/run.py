#!/usr/bin/env python3
"""Asks rust-analyzer for hover and completion inside `model!`.

    python3 tests/editor/run.py

This script is not part of CI. It needs `rustup component add rust-analyzer` and some minutes for the first index.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]

SOURCE = """
use ppl::prelude::*;

ppl::model! {
    fn level(measured: &[f64], width: f64) {
        let mu ~ Normal(0.0, 10.0);
        let sd ~ HalfNormal(width);
        let shifted = mu + sd;
        let wave = mu.ta;
        for y in measured.iter() {
            y ~ Normal(shifted, sd);
        }
        let _later ~ Nor(0.0, 1.0);
    }
}

fn main() {
    let _ = level(&[1.0], 2.0);
}
"""

MANIFEST = """
[package]
name = "edited"
version = "0.1.0"
edition = "2024"

[dependencies]
ppl = {{ path = {path!r} }}

[workspace]
"""

# text before the cursor (its first occurrence), and text that the answer must contain
HOVERS = [
    ("let mu ~ Nor", ["Normal"]),
    ("let shifted = m", ["mu", "Real"]),
    ("for y in meas", ["measured", "[f64]"]),
    ("HalfNormal(wid", ["width", "f64"]),
]
COMPLETIONS = [
    ("let wave = mu.ta", "tanh"),
    ("for y in measured.ite", "iter"),
    ("let _later ~ Nor", "Normal"),
]


class Server:
    """A language server that communicates through pipes."""

    def __init__(self, folder):
        self.process = subprocess.Popen(
            ["rust-analyzer"], cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self.number = 0
        self.is_ready = False

    def send(self, message):
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.process.stdin.flush()

    def receive(self):
        length = 0
        while (line := self.process.stdout.readline().strip()):
            name, value = line.split(b":")
            if name.lower() == b"content-length":
                length = int(value)
        message = json.loads(self.process.stdout.read(length))
        if message.get("method") == "experimental/serverStatus":
            self.is_ready = message["params"]["quiescent"]
        if "method" in message and "id" in message:
            self.send({"id": message["id"], "result": None})
        return message

    def notify(self, method, params):
        self.send({"method": method, "params": params})

    def ask(self, method, params):
        self.number += 1
        self.send({"id": self.number, "method": method, "params": params})
        while True:
            message = self.receive()
            if message.get("id") == self.number and "method" not in message:
                if "error" in message:
                    raise RuntimeError(message["error"])
                return message["result"]


def after(text):
    """Returns the position after the first occurrence of `text`."""
    offset = SOURCE.index(text) + len(text)
    line = SOURCE.count("\n", 0, offset)
    return {"line": line, "character": offset - SOURCE.rfind("\n", 0, offset) - 1}


def main():
    failures = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name).resolve()
        (folder / "src").mkdir()
        (folder / "Cargo.toml").write_text(MANIFEST.format(path=str(ROOT / "ppl")))
        (folder / "Cargo.lock").write_text((ROOT / "Cargo.lock").read_text())
        file = folder / "src" / "main.rs"
        file.write_text(SOURCE)
        server = Server(folder)
        server.ask("initialize", {
            "processId": os.getpid(),
            "rootUri": folder.as_uri(),
            "capabilities": {"experimental": {"serverStatusNotification": True}},
            "initializationOptions": {"checkOnSave": False, "cachePriming": {"enable": False}},
        })
        server.notify("initialized", {})
        document = {"uri": file.as_uri()}
        server.notify("textDocument/didOpen", {
            "textDocument": {**document, "languageId": "rust", "version": 1, "text": SOURCE},
        })
        started = time.monotonic()
        while not server.is_ready and time.monotonic() - started < 600:
            server.receive()

        for text, expected in HOVERS:
            where = {"textDocument": document, "position": after(text)}
            answer = server.ask("textDocument/hover", where)
            said = json.dumps(answer["contents"]) if answer else ""
            good = all(part in said for part in expected)
            failures += not good
            print(f"{'ok' if good else 'FAILED'}  hover after `{text}`: {said[:160]}")
        for text, expected in COMPLETIONS:
            where = {"textDocument": document, "position": after(text)}
            answer = server.ask("textDocument/completion", where) or []
            items = answer["items"] if isinstance(answer, dict) else answer
            labels = [item["label"] for item in items]
            good = any(label.startswith(expected) for label in labels)
            failures += not good
            print(f"{'ok' if good else 'FAILED'}  completion after `{text}`: {labels[:6]}")
        server.ask("shutdown", None)
        server.notify("exit", None)
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
