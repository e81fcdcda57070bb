# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays (k, n): columns that are added to."""

import numpy as np
import pytest

from hybrid_addon.tracer.core.vectors import add

INDICES = {"all": slice(None), "a run": slice(1, 4), "some": np.array([4, 0, 2]), "none": np.array([], np.intp)}


@pytest.mark.parametrize("index", INDICES.values(), ids=list(INDICES))
@pytest.mark.parametrize("is_grey", [False, True])
def test_what_is_added_to_columns_is_numpys_sum(index, is_grey):
    a = np.arange(15, dtype=np.float32).reshape(3, 5)
    many = len(np.arange(5)[index])
    columns = (
        np.arange(many, dtype=np.float32) + 1 if is_grey else np.arange(3 * many, dtype=np.float32).reshape(3, many)
    )
    expected = a.copy()
    expected[:, index] += columns
    add(a, index, columns)
    np.testing.assert_array_equal(a, expected)
