"""All tables of the service: SQLAlchemy knows a table only once its module is imported."""

import service.access.tables
import service.alerts.tables
import service.analyses.tables
import service.buildings.tables
import service.drift.tables
import service.jobs.tables
import service.models.tables
import service.notify.tables
import service.records.tables  # noqa: F401
