"""The OpenAPI document leaves nothing out."""

from pathlib import Path
from typing import Any

import databases
import pytest

from service.app import create
from service.settings import Settings


@pytest.fixture
def document(tmp_path: Path) -> dict[str, Any]:
    url = databases.sqlite(tmp_path)
    return create(Settings(database_url=url)).openapi()


def test_every_operation_and_parameter_is_documented(document: dict[str, Any]) -> None:
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            assert operation["description"], (method, path)
            assert operation["tags"], (method, path)
            for parameter in operation.get("parameters", []):
                assert parameter.get("description"), (path, parameter["name"])
            for status, answer in operation["responses"].items():
                assert status < "400" or "application/problem+json" in answer["content"], (path, status)


def test_operations_have_ids_of_their_own_and_errors_are_ours(document: dict[str, Any]) -> None:
    assert "HTTPValidationError" not in document["components"]["schemas"]
    identifiers = [o["operationId"] for ops in document["paths"].values() for o in ops.values()]
    assert len(identifiers) == len(set(identifiers))


def test_every_route_is_in_the_guide(document: dict[str, Any]) -> None:
    guide = (Path(__file__).parents[3] / "docs/reference/api.md").read_text("utf-8")
    for path, operations in document["paths"].items():
        for method in operations:
            assert f"{method.upper()} {path}`" in guide, (method, path)


def test_every_field_is_described(document: dict[str, Any]) -> None:
    for name, schema in document["components"]["schemas"].items():
        for field, described in schema.get("properties", {}).items():
            assert described.get("description"), (name, field)
