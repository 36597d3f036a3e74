# SPDX-License-Identifier: BSD-3-Clause
"""Cells, basins of attraction, their boundaries and their numbers.

Start with ``basins``.
"""
