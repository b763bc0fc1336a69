"""The lock on a building. Transactions about one building run one after the other.

A transaction locks the job that it ends, then the building, then the building's events and models, then other rows. In
another order two transactions could wait for each other.
"""

from sqlalchemy.orm import Session

from service.buildings.tables import Building


def locked(session: Session, building_id: int) -> Building:
    """The building as it is now, locked until the transaction ends.

    The lock leaves the row's number alone (PostgreSQL's FOR NO KEY UPDATE): others may add rows that refer to the
    building meanwhile. With FOR UPDATE, every such row would be a lock on the building that is acquired last.
    """
    return session.get_one(Building, building_id, with_for_update={"key_share": True})
