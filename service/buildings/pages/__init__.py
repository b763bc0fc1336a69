"""The pages of buildings: the first page, and one page for each building."""

from fastapi import APIRouter

from service.buildings.pages import building, home, sensors

router = APIRouter()
router.include_router(home.router)
router.include_router(building.router)
router.include_router(sensors.router)
router.include_router(sensors.charts, include_in_schema=False)
