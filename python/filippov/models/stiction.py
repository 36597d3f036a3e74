# SPDX-License-Identifier: BSD-3-Clause
"""The belt with constant kinetic friction and a static one above it, law (4.4); compiled.

Such a law is not a Filippov system: while the block sticks the friction may exceed what either
side gives. This is the named model of it: stick lasts while `|s| <= mu_s/mu_0`, slip has `mu_0`.
Chapter, (4.2), (4.4).
"""

from __future__ import annotations

from filippov._system.built_in import compiled

stiction = compiled("stiction", ["v - V"])
