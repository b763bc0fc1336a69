"""Commands by an account that must heed permissions: root, who need not, gives the rights to pass them over away first.

Run as `setpriv ... python unprivileged.py` with a JSON list of [command, database address] on its standard input.
"""

import json
import logging
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

RIGHTS = "-dac_override,-dac_read_search,-net_bind_service"
WITHOUT_RIGHTS: tuple[str, ...] = (
    ("setpriv", "--bounding-set", RIGHTS, "--inh-caps", "-all") if os.geteuid() == 0 else ()
)


def can_be_given_away() -> bool:
    """True if this account obeys permissions, or can be made to."""
    try:
        return subprocess.run([*WITHOUT_RIGHTS, "true"], capture_output=True).returncode == 0
    except FileNotFoundError:
        return False


def ended(
    folder: Path, environment: dict[str, str], commands: Sequence[tuple[Sequence[str], str]]
) -> list[tuple[int, str]]:
    """Exit code and standard error of each command at its database, one after the other, in one process."""
    done = subprocess.run(
        [*WITHOUT_RIGHTS, sys.executable, __file__],
        input=json.dumps(commands),
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return [(code, printed) for code, printed in json.loads(done.stdout)]


def main() -> None:
    """Run the commands."""
    from typer.testing import CliRunner

    from service.cli import app

    answers = []
    for command, url in json.load(sys.stdin):
        os.environ["MENSHIN_DATABASE_URL"] = url
        done = CliRunner().invoke(app, command)
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
        answers.append((done.exit_code, done.stderr))
        logging.getLogger().handlers.clear()  # they write to the stream of the command that has ended
    json.dump(answers, sys.stdout)


if __name__ == "__main__":
    main()
