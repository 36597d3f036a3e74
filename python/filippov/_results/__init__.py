# SPDX-License-Identifier: BSD-3-Clause
"""What results have in common: settings and counts, events, solutions, files, tables.

Start with ``store``: what is saved, and what is believed of a file that is loaded (checked by
``_support.sound`` and ``sizes``, and by each result's ``_verify``; a system's by ``_support.plain``).
It must not know any analysis by name: what derives from ``store.Stored`` enters itself.
"""
