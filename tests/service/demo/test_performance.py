"""The settings that a demonstration runs with."""

from pathlib import Path

import pytest

from service.demo.performance import address, settings_of


def test_messages_link_to_the_demonstrations_own_pages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MENSHIN_PUBLIC_URL", raising=False)
    settings = settings_of(tmp_path, 8123)
    assert settings.public_url == address(settings) == "http://127.0.0.1:8123"


def test_another_address_that_is_set_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MENSHIN_PUBLIC_URL", "https://menshin.example.org")
    assert settings_of(tmp_path, 8123).public_url == "https://menshin.example.org"
