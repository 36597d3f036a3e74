# SPDX-License-Identifier: BSD-3-Clause
"""What results have in common: settings and counts, events, solutions, files, tables.

Start with ``store``: what is saved, and what is believed of a file that is loaded, which is checked
by ``_support.sound`` and ``sizes``, by each result's ``_verify``, and for a system by
``_system.plain``.
It must not know any analysis by name: what derives from ``store.Stored`` enters itself.
"""
