# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of results, by matplotlib, which is imported when one is drawn.

Results come here by their ``plot`` methods, and nothing else of the package knows this folder.
"""
