# SPDX-License-Identifier: BSD-3-Clause
"""Maps, orbits, branches, exponents, and the sliding region.

Start with ``maps`` and ``orbit``. It must not know basins.
"""
