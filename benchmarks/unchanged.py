"""Results of the program on fixed data, kept as JSON, and the differences between two versions of them.

    python -m benchmarks.unchanged record build/before     # some 40 minutes on two cores
    python -m benchmarks.unchanged record build/after --demonstrations build/before
    python -m benchmarks.unchanged compare build/before build/after

A change that only moves code leaves every result as it was: numbers to 1e-9 relative, everything else exactly. Recorded
are the real building's analyses, fit, comparison and diagnosis by command, 40 trials of the diagnosis, and every answer
of the API about the three demonstrations. Times, durations, versions and digests of settings are left out. The
earthquakes of a demonstration lie in the past of its first recording, so that a later one takes them from there.

Needs `pip install '.[test]'`, and the real building's records beside the checkout (../shared/data/bncs).
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from math import isclose
from pathlib import Path
from typing import TypeAlias

import httpx

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "tests" / "support"))  # the demonstration is driven as the tests do it

from demo_process import demo, seconds_to_end  # noqa: E402
from shared_data import BNCS  # noqa: E402

from benchmarks.diagnosis import read, run, wanted  # noqa: E402
from benchmarks.diagnosis_tables import GROUPS  # noqa: E402

Value: TypeAlias = "bool | int | float | str | list[Value] | dict[str, Value] | None"
"""Values that JSON can hold."""

TOLERANCE = 1e-9
"""Relative difference that counts as none."""
TRIALS = 40
RECORDS = ("CNP100", "LAC100", "SP100")
DEMONSTRATIONS: Mapping[str, tuple[tuple[str, ...], int]] = {
    "plain": ((), 32),
    "stiffness-loss": (("--stiffness-loss",), 28),
    "hidden-effect": (("--hidden-effect",), 6),
}
"""Options of each, and its earthquakes."""
PATIENCE = 1800.0
"""s for all analyses of a demonstration."""
LEFT_OUT = re.compile(
    r"(^|_)(at|seconds|version|versions|code|settings|hash|sha256|etag|address|url|link|location|job|jobs|progress)$"
    r"|^(last_look|next_look|uptime|origin|host|free)"
)
"""Names of values that differ from run to run."""
NUMBERED = re.compile(r"/analysis(/id)?$")
"""Places of numbers of analyses, which are those of who was done first."""
WITHOUT_RESULTS = re.compile(r"/(audit|jobs|sources|recordings|deliveries|messages)|healthz|readyz|metrics|progress")
"""Paths of the API whose answers are about the run itself."""
LISTS = {
    "event_id": "/api/v1/buildings/DEMO/events",
    "alert_id": "/api/v1/alerts",
    "model_id": "/api/v1/buildings/DEMO/models",
}
"""Lists that hold the values of a parameter in a path."""


def record(folder: Path, demonstrations: Path | None) -> None:
    """Keep all results in a folder; parts that are there already stay.

    Args:
        folder: gets a JSON file for every part.
        demonstrations: folder of an earlier recording, whose earthquakes happen again.
    """
    folder.mkdir(parents=True, exist_ok=True)
    _once(folder / "real-building.json", real_building)
    for name in DEMONSTRATIONS:
        earlier = None if demonstrations is None else demonstrations / f"{name}-earthquakes.json"
        _once(folder / f"{name}.json", lambda name=name, earlier=earlier: demonstration(name, folder, earlier))
    trials = folder / "trials.jsonl"
    run(wanted(GROUPS, first=1, most=100)[:TRIALS], trials)
    _once(folder / "trials.json", lambda: {f"{one.case} {one.seed}": asdict(one) for one in read(trials)[:TRIALS]})


def real_building() -> Value:
    """Documents of `menshin analyse` and `menshin model` about the building of ../shared/data/bncs."""
    building = ["--building", str(BNCS / "building.toml")]
    records = [str(BNCS / f"{name}.mseed") for name in RECORDS]
    station = str(BNCS / "station.xml")
    found: dict[str, Value] = {}
    with tempfile.TemporaryDirectory() as made:
        answer, first, linear = Path(made) / "answer.json", f"{made}/first.toml", f"{made}/linear.toml"
        to_json = ["--json", str(answer)]
        for name, path in zip(RECORDS, records, strict=True):
            _menshin(["analyse", path, station, *building, *to_json])
            found[f"analyse {name}"] = json.loads(answer.read_text())
        _menshin(["model", "new", *building, "-o", first])
        for act, model, more in (("fit", first, ["-o", linear]), ("compare", linear, []), ("diagnose", linear, [])):
            _menshin(["model", act, model, *records, station, *building, *more, *to_json])
            found[act] = json.loads(answer.read_text())
    return found


def demonstration(name: str, folder: Path, earlier: Path | None) -> Value:
    """Every answer of the API about a demonstration whose earthquakes have all been analysed, by path."""
    options, count = DEMONSTRATIONS[name]
    with tempfile.TemporaryDirectory() as made:
        kept = Path(made) / "kept"
        own = kept / name if options else kept
        own.mkdir(parents=True)
        if earlier is not None:
            shutil.copy(earlier, own / "earthquakes.json")
        more = (*options, "--earthquakes", str(count), "--next-after", "86400")
        with demo(kept, Path(made) / "said.txt", *more) as running:
            address = running.address()
            running.events(address, count, PATIENCE)
            with httpx.Client(base_url=address, timeout=60.0) as service:
                running.until(lambda: _is_idle(service), PATIENCE)
                answers: dict[str, Value] = {path: service.get(path).json() for path in _paths(service)}
            seconds_to_end(running)
        shutil.copy(own / "earthquakes.json", folder / f"{name}-earthquakes.json")
    return answers


def _paths(service: httpx.Client) -> Iterator[str]:
    """Paths of all questions that the OpenAPI document lists, with the values that their parameters have here."""
    ids = {"code": ["DEMO"]} | {
        name: [str(one["id"]) for one in service.get(path, params={"limit": 100}).json()["items"]]
        for name, path in LISTS.items()
    }
    for path, methods in service.get("/openapi.json").json()["paths"].items():
        names = re.findall(r"\{(\w+)\}", path)
        if "get" not in methods or WITHOUT_RESULTS.search(path) or len(names) > 1 or set(names) - ids.keys():
            continue
        yield from (path.replace(f"{{{name}}}", one) for name in names for one in ids[name]) if names else (path,)


def _is_idle(service: httpx.Client) -> bool:
    """True if no job waits or runs."""
    return all(
        not service.get("/api/v1/jobs", params={"state": state}).json()["items"] for state in ("waiting", "running")
    )


def _menshin(words: list[str]) -> None:
    command = [str(Path(sys.executable).with_name("menshin")), *words]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env={**os.environ, "OMP_NUM_THREADS": "1"})


def _once(path: Path, made: Callable[[], Value]) -> None:
    if not path.exists():
        found = made()
        path.write_text(json.dumps(found, indent=1, sort_keys=True), encoding="utf-8")
        print(path, flush=True)


def differences(before: Value, after: Value, place: str = "") -> Iterator[str]:
    """Every value that is not the same, with its place."""
    if isinstance(before, dict) and isinstance(after, dict):
        for name in sorted(before.keys() | after.keys()):
            if LEFT_OUT.search(name):
                continue
            if name not in before or name not in after:
                yield f"{place}/{name}: only {'after' if name in after else 'before'}"
            else:
                yield from differences(before[name], after[name], f"{place}/{name}")
    elif isinstance(before, list) and isinstance(after, list):
        if len(before) != len(after):
            yield f"{place}: {len(before)} values before, {len(after)} after"
        for number, pair in enumerate(zip(before, after, strict=False)):
            yield from differences(*pair, f"{place}/{number}")
    elif not (NUMBERED.search(place) or _is_same(before, after)):
        yield f"{place}: {before!r} -> {after!r}"


def _is_same(before: Value, after: Value) -> bool:
    numbers = (int, float)
    if isinstance(before, numbers) and isinstance(after, numbers) and bool not in (type(before), type(after)):
        return isclose(before, after, rel_tol=TOLERANCE, abs_tol=1e-300)
    return type(before) is type(after) and before == after


def main() -> None:
    """Record, or compare two recordings; exit code 1 where they differ."""
    parser = ArgumentParser(description="Results on fixed data, before and after a change.")
    acts = parser.add_subparsers(dest="act", required=True)
    recording = acts.add_parser("record")
    recording.add_argument("folder", type=Path)
    recording.add_argument("--demonstrations", type=Path, help="an earlier recording, whose earthquakes happen again")
    comparing = acts.add_parser("compare")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    asked = parser.parse_args()
    if asked.act == "record":
        record(asked.folder, asked.demonstrations)
        return
    found = [
        f"{path.stem}{line}"
        for path in sorted(asked.before.glob("*.json"))
        if not path.stem.endswith("-earthquakes")
        for line in differences(json.loads(path.read_text()), json.loads((asked.after / path.name).read_text()))
    ]
    print("\n".join(found) or "nothing differs")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
