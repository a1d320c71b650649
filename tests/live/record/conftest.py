"""What the tests of the recorder share."""

import pytest

from tests.live.record.desk import Desk


@pytest.fixture
def desk(tmp_path):
    made = Desk(tmp_path)
    yield made
    made.close()
