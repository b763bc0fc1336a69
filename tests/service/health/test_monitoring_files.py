"""The rules for Prometheus and the dashboard for Grafana in docker/monitoring: rules raise what they should, and every
metric and label is one that /metrics has."""

import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from prometheus_client import CollectorRegistry

from service.health.metrics import GAUGES, Measured

FOLDER = Path(__file__).resolve().parents[3] / "docker" / "monitoring"
PROMTOOL = shutil.which("promtool")
DURATION = "menshin_http_request_duration_seconds"
SELECTOR = re.compile(r"(menshin_\w+)(?:\{([^}]*)\})?")
LEGEND = re.compile(r"\{\{(\w+)\}\}")


def promtool(*arguments: object) -> str:
    if PROMTOOL is None:
        pytest.skip("promtool is not installed; Debian's package prometheus has it")
    done = subprocess.run([PROMTOOL, *map(str, arguments)], capture_output=True, text=True, cwd=FOLDER)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def metrics() -> dict[str, set[str]]:
    """Labels of every metric."""
    registry = CollectorRegistry()
    Measured(lambda *_: None, registry)  # type: ignore[arg-type,return-value]
    [durations] = registry.collect()
    assert durations.name == DURATION
    labels = {name: {label} if label else set() for name, (_, label, _) in GAUGES.items()}
    return labels | {f"{DURATION}_{part}": {"route", "status", "le"} for part in ("count", "sum", "bucket")}


def panels() -> Iterator[tuple[str, str]]:
    """Expression and legend of every line of the dashboard."""
    for panel in json.loads((FOLDER / "grafana.json").read_text("utf-8"))["panels"]:
        for target in panel["targets"]:
            yield target["expr"], target["legendFormat"]


def expressions() -> tuple[str, ...]:
    """Expressions of the rules; one that goes over several lines is written behind `>-`."""
    text = (FOLDER / "alerts.yaml").read_text("utf-8")
    found = re.findall(r"^ +expr: (?:>-\n)?((?:.+\n)(?: {10,}.+\n)*)", text, re.MULTILINE)
    assert len(found) == text.count("- alert:")
    return tuple(found)


@pytest.mark.parametrize("where", ["rules", "dashboard"])
def test_every_metric_and_label_is_there(where: str) -> None:
    known = metrics()
    given = expressions() if where == "rules" else tuple(expression for expression, _ in panels())
    used = [found for expression in given for found in SELECTOR.findall(expression)]
    assert {name for name, _ in used} <= set(known)
    for name, selected in used:
        assert set(re.findall(r"(\w+)\s*[=!]", selected)) <= known[name], (name, selected)
    if where == "dashboard":
        assert {name for name, _ in used} | {f"{DURATION}_sum"} == set(known), "the dashboard shows every metric"
        for expression, legend in panels():
            labels = {label for name, _ in SELECTOR.findall(expression) for label in known[name]}
            assert set(LEGEND.findall(legend)) <= labels, expression


def test_every_rule_raises_what_it_should_and_only_then() -> None:
    promtool("test", "rules", "rules_test.yaml")
    tests = (FOLDER / "rules_test.yaml").read_text("utf-8")
    for name in re.findall(r"- alert: (\w+)", (FOLDER / "alerts.yaml").read_text("utf-8")):
        assert f"- alertname: {name}\n" in tests, f"{name} is never raised by a test"
        assert f"{{alertname: {name}, " in tests, f"{name} is never quiet in a test"


def test_the_page_about_the_rules_counts_them() -> None:
    of_service, of_buildings = (FOLDER / "alerts.yaml").read_text("utf-8").split("name: menshin buildings")
    counts = f"{of_service.count('- alert:')} about the service and {of_buildings.count('- alert:')} about buildings"
    assert counts in (FOLDER.parents[1] / "docs" / "operate" / "running.md").read_text("utf-8")


def test_prometheus_can_read_the_configuration_and_every_line_of_the_dashboard(tmp_path: Path) -> None:
    promtool("check", "config", "--syntax-only", "prometheus.yaml")
    rules = [{"record": f"line_{number}", "expr": expression} for number, (expression, _) in enumerate(panels())]
    (tmp_path / "rules.json").write_text(json.dumps({"groups": [{"name": "dashboard", "rules": rules}]}))  # also YAML
    assert f"{len(rules)} rules found" in promtool("check", "rules", tmp_path / "rules.json")
