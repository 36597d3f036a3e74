# SPDX-License-Identifier: BSD-3-Clause
"""`python -m filippov` is the command `filippov`."""

import sys

from ._cli import main

sys.exit(main())
