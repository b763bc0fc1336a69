"""`menshin demo --stiffness-loss` as a user runs it: the messages about the loss."""

from pathlib import Path

import httpx
import pytest
from demo_process import demo, seconds_to_end, surviving_processes
from receivers import mail_server, webhook_server
from rendered_messages import KEY
from standardwebhooks import Webhook

from service.demo.stiffness_loss import LAST_HEALTHY, LOSS

pytestmark = pytest.mark.slow
PAST = LAST_HEALTHY + 3
"""Earthquakes: a loss of this size shows within two, and one more shows whether it is reported again."""
PATIENCE = 900.0
"""s; it takes 4 to 6 minutes on two cores that have other work too."""
PICTURE_BYTES = 10_000
"""Fewer than the loop has: an empty chart has fewer still."""


def test_the_loss_reaches_a_mail_server_and_a_program_and_is_reported_as_new_once(tmp_path: Path) -> None:
    with webhook_server() as program, mail_server() as box:
        settings = {
            "MENSHIN_NOTIFY__ALLOWED_PRIVATE_HOSTS": '["localhost"]',
            "MENSHIN_NOTIFY__ALLOW_PLAIN_HTTP": "true",
            "MENSHIN_SMTP__HOST": "localhost",
            "MENSHIN_SMTP__PORT": str(box.port),
            "MENSHIN_SMTP__SECURITY": "none",
        }
        options = ("--stiffness-loss", "--earthquakes", str(PAST), "--next-after", "3600")
        with (
            demo(tmp_path / "kept", tmp_path / "said.txt", *options, **settings) as running,
            httpx.Client(base_url=f"{running.address()}/api/v1", timeout=30.0) as service,
        ):
            service.headers["X-API-Key"] = running.key()
            for wanted in (
                {"name": "manager", "kind": "email", "address": "manager@example.org"},
                {"name": "program", "kind": "webhook", "address": program.address, "secret": KEY},
            ):
                added = service.post("/buildings/DEMO/receivers", json=wanted)
                assert added.status_code == 201, added.text
            running.events(str(service.base_url).removesuffix("/api/v1/"), PAST, PATIENCE, service.headers["X-API-Key"])
            running.until(lambda: box.mails and program.posted and _is_idle(service), PATIENCE)
            [alert] = service.get("/alerts", params={"building": "DEMO", "state": "active"}).json()["items"]
            listed = service.get("/buildings/DEMO/events", params={"limit": 100}).json()["items"]
            after = sorted(listed, key=lambda one: one["start"])[LAST_HEALTHY:]
            addresses = ["/buildings/DEMO/verdict", *(f"/events/{one['id']}/verdict" for one in after)]
            levels = [service.get(address).json()["level"] for address in addresses]
            link = f"{str(service.base_url).removesuffix('/api/v1/')}/alerts/{alert['id']}"
            seconds_to_end(running)
            assert not surviving_processes(running.process.pid)
    assert "Traceback" not in running.printed.read_text()

    assert len(levels) == 1 + PAST - LAST_HEALTHY
    assert "normal" not in levels, levels

    signed = [Webhook(KEY).verify(one.body, dict(one.headers)) for one in program.posted]
    reported = [one["data"] for one in signed if one["type"] == "menshin.alert.v1"]
    assert [one["sequence"] for one in reported] == ["new"] + ["updated"] * (len(reported) - 1)
    for one in reported:
        [raised] = one["values"]["alerts"]
        assert (raised["id"], raised["kind"]) == (alert["id"], "deterioration")
        assert raised["evidence"]["drift"] == pytest.approx(-LOSS, abs=0.01)  # three times its 95 % interval

    assert [mail["Subject"] for mail in box.mails] == [one["heading"] for one in reported], "the same headings"
    mail = box.mails[0]
    text, page = mail.get_body(("plain",)), mail.get_body(("html",))
    assert text is not None
    assert page is not None
    for words in (" ".join(text.get_content().split()), " ".join(page.get_content().split())):
        assert "% softer" in words
        assert link in words
        assert "Have them inspected by a specialist." in words
    [picture] = [part for part in mail.walk() if part.get_content_type() == "image/png"]
    assert picture.get_content().startswith(b"\x89PNG")
    assert len(picture.get_content()) > PICTURE_BYTES
    assert picture["Content-ID"].strip("<>") in page.get_content()


def _is_idle(service: httpx.Client) -> bool:
    """True if no job waits and every message has arrived."""
    jobs = service.get("/jobs").json()["items"]
    deliveries = service.get("/deliveries").json()["items"]
    return all(one["state"] == "done" for one in jobs) and {one["state"] for one in deliveries} == {"delivered"}
