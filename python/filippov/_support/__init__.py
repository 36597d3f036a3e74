# SPDX-License-Identifier: BSD-3-Clause
"""What all of the package uses: checks of arguments, words of statuses, types, progress.

Start with ``check``: what an argument has to be, and what is said of one that is not. It must not
import any other folder.
"""
