"""Every command of the command line, with example arguments."""

WITH_DATABASE = {
    "up": ["--port", "0"],
    "api": ["--port", "0"],
    "poll": [],
    "poll --once": [],
    "work": [],
    "work --once": [],
    "notify": [],
    "notify --once": [],
    "import": ["building.toml", "--building", "TOWER"],
    "drill": ["--building", "TOWER", "--wait", "0"],
    "status": [],
    "building add": ["building.toml"],
    "building list": [],
    "building show": ["TOWER"],
    "building update": ["TOWER", "building.toml"],
    "building export": ["TOWER", "tower.zip"],
    "building import": ["building.toml"],
    "building inspect": ["TOWER", "--result", "fit", "--comment", "seen"],
    "report": ["1", "--out", "report.html"],
    "key link": ["TOWER", "NAME"],
    "key links": [],
    "key unlink": ["1"],
    "key create": ["NAME", "--role", "viewer"],
    "key list": [],
    "key revoke": ["NAME"],
    "key logout": [],
    "secret encrypt": [],
    "prune": [],
    "storage move": ["--to-store"],
    "storage check": [],
    "login": [],
}
"""Commands that use the database of the settings, with what each takes."""
WITHOUT = {  # `doctor` prints what is wrong with a database; `backup` and `restore` read its file, whatever it is
    *("demo", "analyse", "reproduce", "effects", "settings", "secret new-key", "doctor", "building draft"),
    *("model new", "model fit", "model compare", "model diagnose", "model add", "model improve", "model forecast"),
    *("model sketch", "building sensors", "backup", "restore"),
}
WAITING = {"up", "api", "poll", "work", "notify"}
"""Parts of the service, which may wait for a database that is away."""
