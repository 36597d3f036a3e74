# SPDX-License-Identifier: BSD-3-Clause
"""What results have in common: settings and counts, events, solutions, files, tables.

Start with ``store``: what is saved, and what is believed of a file that is loaded. It must not know
which analyses there are: what derives from ``store.Stored`` enters itself.
"""
