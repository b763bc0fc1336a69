"""Paths of documents that code, tests and documents mention exist, and no document names a folder of one machine.

Links and anchors between documents are checked by the strict build of the site in `.ci/run`.
"""

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LISTED = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
FILES = [path for name in LISTED if (path := ROOT / name).is_file()]
WRITTEN = (".md", ".py", ".html", ".jinja", ".toml", "run")
MENTIONED = re.compile(r"(?<![\w./-])docs/[\w./-]+\.(?:md|py|svg|png|html|ipynb|json|jinja)\b")
MACHINE = re.compile(r"(?<![\w.-])/(?:tmp|work|root)/\w|/home/\w+/")


def test_every_document_that_is_mentioned_exists() -> None:
    missing = {
        (str(path.relative_to(ROOT)), mention)
        for path in FILES
        if path.name.endswith(WRITTEN)
        for mention in MENTIONED.findall(path.read_text("utf-8"))
        if not (ROOT / mention).exists()
    }
    assert missing == set()


def test_no_document_names_a_folder_of_one_machine() -> None:
    documents = [path for path in FILES if path.suffix == ".md"]
    assert len(documents) > 30
    named = {(path.name, found) for path in documents for found in MACHINE.findall(path.read_text("utf-8"))}
    assert named == set()
