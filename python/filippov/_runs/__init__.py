# SPDX-License-Identifier: BSD-3-Clause
"""Runs: single ones, many at once, smoothed or by equal steps, and diagrams of them.

Start with ``simulate`` and ``ensemble``. It must not know what runs are good for.
"""
