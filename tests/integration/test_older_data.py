"""The whole stack on a data folder of version 0.1.0."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import grazemap
from tests.older_data import BEGUN, DISMISSED, FINISHED, QUEUED, unpack


def test_a_folder_of_an_earlier_version_is_opened(tmp_path: Path) -> None:
    with grazemap.local(data=unpack(tmp_path), workers=1) as client:
        assert [job.id for job in client.jobs()] == [DISMISSED, BEGUN, QUEUED, FINISHED]
        finished = client.job(FINISHED)
        assert finished.status == "successful"
        result = finished.result()
        assert isinstance(result, grazemap.results.GrazingCurve)
        assert result.meta["core_version"] == grazemap.__version__ != "0.1.0"
        assert np.isfinite(result.clearance).all()
        assert len(client.jobs()) == 5
        with pytest.raises(grazemap.errors.JobFailed, match="post its request again"):
            client.job(QUEUED).result()
